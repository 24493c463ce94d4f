"""A line for every joint of a file: how much of it there is, what of that is not believed, and what would mend it."""

from collections.abc import Iterator, Mapping
from typing import Any

MENDS = {
    "absurd": "check its unit and the program that wrote it",
    "spike": "check the sensor's line",
    "stuck": "check the sensor",
    "dead": "check the sensor",
    "duplicate": "check the recorder's clock",
    "out_of_order": "check the recorder's clock",
    "clock_jump": "check the recorder's clock",
    "no_stamp": "check the recorder's clock",
    "undecodable": "fetch the file again",
    "corrupt_row": "fetch the file again",
}
"""What would mend each kind of defect; a value that is missing or at its limit is not one by itself."""


def quality_line(row: Mapping[str, Any]) -> str:
    """Say of one joint in one file how much there is of it, what is not believed, and what would mend that.

    Parameters
    ----------
    row : mapping
        A row of `gsfdi.ingest.summary`, with its source and whether it is new to the store.

    Examples
    --------
    >>> quality_line({"source": "night.mcap", "joint": "EL", "samples": 98, "span_s": 1.0, "rate_hz": 100.0,
    ...               "gaps": 0, "masked": {"position": {"spike": 1.0}}, "left_out": {"duplicate": 2.0}, "new": True})
    "night.mcap: EL: 98 samples, 1.0 s at 100 Hz, 0 gaps; masked: position spike 1; left out: duplicate 2; \
check the sensor's line; check the recorder's clock"
    """
    masked = ", ".join(f"{channel.replace('_', ' ')} {told}" for channel, told in _by_channel(row["masked"]))
    lost = _counted(row["left_out"])
    kinds = [kind for counts in (*row["masked"].values(), row["left_out"]) for kind in counts]
    return "; ".join(
        [
            f"{row['source']}: {row['joint']}: {row['samples']} samples, {row['span_s']:.1f} s "
            f"at {row['rate_hz']:.4g} Hz, {row['gaps']} gaps",
            f"masked: {masked or 'nothing'}",
            *([f"left out: {lost}"] if lost else []),
            *dict.fromkeys(MENDS[kind] for kind in kinds if kind in MENDS),
            *([] if row["new"] else ["in the store already"]),
        ]
    )


def _by_channel(masked: Mapping[str, Mapping[str, float]]) -> Iterator[tuple[str, str]]:
    """Channels of which anything is masked, and what."""
    return ((channel, _counted(counts)) for channel, counts in masked.items() if counts)


def _counted(counts: Mapping[str, float]) -> str:
    return ", ".join(f"{kind.replace('_', ' ')} {count:g}" for kind, count in counts.items())
