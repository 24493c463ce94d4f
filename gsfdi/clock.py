"""Which stamps of a recording can be believed, and what its clock is like.

A sample whose time cannot be believed has no place on a record's axis: it is left out and counted.
"""

import bisect
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gsfdi.passes import quantile, rises, sampled
from gsfdi.types import Array, Mask

LEFT_OUT = ("duplicate", "out_of_order", "clock_jump", "no_stamp", "undecodable", "corrupt_row")
"""Kinds of rows that are counted under ``"time"`` and are not in the record."""
GAP = 5.0
"""A pause of more than this many usual spacings is a gap."""
FARTHEST_NS = 2.0**61
"""Further than 73 years from 1970 nothing was recorded; differences of such stamps would overflow."""
JUMP_NS = 3_600_000_000_000
"""Stamps further than this from the bulk of the recording come from a clock that jumped."""


class Timed(NamedTuple):
    """Rows whose stamps can be believed, in order, and what was wrong with the rest."""

    rows: npt.NDArray[np.intp]
    counts: dict[str, float]


def believable_times(time_ns: npt.NDArray[np.int64], after: int | None = None) -> Timed:
    """Pick the rows whose stamps rise.

    Parameters
    ----------
    time_ns : (n,) array of int64
        Stamps in the order of the file [ns].
    after : int, optional
        Stamp that the first row must exceed [ns]: the end of the piece before.

    Returns
    -------
    Timed
        The longest rising choice of rows; the others are counted as ``duplicate`` (the same stamp again),
        ``out_of_order`` or ``clock_jump`` (far from everything else).
    """
    counts: dict[str, float] = {}
    rows = np.arange(len(time_ns))
    if len(rows) and (after is None or time_ns[0] > after) and rises(time_ns, FARTHEST_NS, JUMP_NS):
        return Timed(rows, counts)
    if len(rows) and after is not None:
        late = time_ns <= after
        if late.any():
            counts["out_of_order"] = float(late.sum())
            rows = rows[~late]
    far = _far(time_ns[rows]) | (np.abs(time_ns[rows].astype(np.float64)) > FARTHEST_NS)
    if far.any():
        counts["clock_jump"] = float(far.sum())
        rows = rows[~far]
    steps = np.diff(time_ns[rows])
    if (steps < 0).any():
        chosen = _rising(time_ns[rows])
        counts["out_of_order"] = counts.get("out_of_order", 0.0) + float(len(rows) - len(chosen))
        rows = rows[chosen]
    seconds = (time_ns[rows] - time_ns[rows[0]]) * 1e-9 if len(rows) else np.zeros(0)
    again = np.diff(seconds, prepend=-1.0) <= 0.0  # also what float seconds, far from the start, cannot tell apart
    if again.any():
        counts["duplicate"] = float(again.sum())
        rows = rows[~again]
    return Timed(rows, counts)


def _far(time_ns: npt.NDArray[np.int64]) -> Mask:
    """Stamps in small groups, an hour or more away from the bulk."""
    if len(time_ns) < 20 or int(time_ns.max()) - int(time_ns.min()) < JUMP_NS:
        return np.zeros(len(time_ns), dtype=np.bool_)
    order = np.argsort(time_ns, kind="stable")
    ranked = time_ns[order].astype(np.float64)
    group = np.concatenate([[0], np.cumsum(np.diff(ranked) > JUMP_NS)])
    sizes = np.bincount(group)
    small = sizes[group] < max(2.0, 0.01 * len(time_ns))
    far = np.zeros(len(time_ns), dtype=np.bool_)
    far[order] = small
    return far


def _rising(time_ns: npt.NDArray[np.int64]) -> npt.NDArray[np.intp]:
    """Rows of the longest choice of stamps that never falls (patience sorting)."""
    tails: list[int] = []
    tail_rows: list[int] = []
    before = np.full(len(time_ns), -1, dtype=np.intp)
    for row, stamp in enumerate(time_ns.tolist()):
        place = bisect.bisect_right(tails, stamp)
        if place == len(tails):
            tails.append(stamp)
            tail_rows.append(row)
        else:
            tails[place] = stamp
            tail_rows[place] = row
        before[row] = tail_rows[place - 1] if place else -1
    chosen = np.empty(len(tails), dtype=np.intp)
    row = tail_rows[-1]
    for place in range(len(tails) - 1, -1, -1):
        chosen[place] = row
        row = before[row]
    return chosen


def time_summary(t: Array) -> dict[str, float]:
    """Rate, span and gaps of a clock.

    Parameters
    ----------
    t : (n,) array
        Time [s], rising.
    """
    if len(t) < 2:
        return {"samples": float(len(t)), "span_s": 0.0, "rate_hz": 0.0, "gaps": 0.0, "longest_gap_s": 0.0}
    steps = np.diff(t)
    usual = quantile(sampled(steps), 0.5)
    gaps = steps > GAP * usual
    return {
        "samples": float(len(t)),
        "span_s": float(t[-1] - t[0]),
        "rate_hz": 1.0 / usual,
        "gaps": float(gaps.sum()),
        "longest_gap_s": float(steps.max()) if gaps.any() else 0.0,
    }
