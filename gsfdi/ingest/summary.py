"""A row for every robot and joint: records, rate, span, gaps, and what was masked."""

from collections.abc import Iterable
from collections.abc import Mapping as Map
from typing import Any

from gsfdi.types import JointRecord

CLOCK = ("samples", "span_s", "rate_hz", "gaps", "longest_gap_s")
"""What a record's clock says beside the rows that were left out."""


def summary(records: Iterable[JointRecord]) -> list[dict[str, object]]:
    """One row per robot and joint: records, rate, span, gaps, and what was masked.

    Parameters
    ----------
    records : iterable of JointRecord
        Gone through once and not kept, so it may be as long as it likes.
    """
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for record in records:
        clock = record.quality.get("time", {})
        row = rows.setdefault(
            (record.robot, record.joint),
            {
                "robot": record.robot, "joint": record.joint, "records": 0, "samples": 0, "span_s": 0.0,
                "rate_hz": 0.0, "gaps": 0, "longest_gap_s": 0.0, "channels": [], "left_out": {}, "masked": {},
            },
        )  # fmt: skip
        row["records"] += 1
        row["samples"] += len(record.t)
        row["span_s"] += clock.get("span_s", 0.0)
        row["rate_hz"] = max(row["rate_hz"], clock.get("rate_hz", 0.0))
        row["gaps"] += int(clock.get("gaps", 0.0))
        row["longest_gap_s"] = max(row["longest_gap_s"], clock.get("longest_gap_s", 0.0))
        row["channels"] = sorted({*row["channels"], *record.channels})
        add_counts(row["left_out"], {kind: count for kind, count in clock.items() if kind not in CLOCK})
        for channel in record.channels:
            add_counts(row["masked"].setdefault(channel, {}), record.quality.get(channel, {}))
    return [rows[key] for key in sorted(rows)]


def add_counts(total: dict[str, float], counts: Map[str, float] | Map[str, int]) -> None:
    """Add `counts` to `total`, kind by kind, but for those that are zero."""
    for kind, count in counts.items():
        if count:
            total[kind] = total.get(kind, 0.0) + count
