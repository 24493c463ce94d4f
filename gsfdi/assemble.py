"""From the columns of one joint, which may come from several topics, to one record on one clock."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsfdi.clock import believable_times
from gsfdi.quality import judge
from gsfdi.types import Array, JointRecord, sealed
from gsfdi.wire import Key, Stamps

Blocks = list[tuple[str, Stamps, dict[Key, Array]]]
"""Origin, clock and columns, as they came."""
_BASES = ("position", "joint_velocity", "motor_velocity", "motor_current", "drive_torque", "setpoint")
"""Channels whose clock a record keeps, the first that is there."""
STALE = 5.0
"""A held value older than this many of its own spacings is no longer believed."""


@dataclass(frozen=True, slots=True)
class _Series:
    """One source's clock and its channels of one joint, with believable stamps."""

    time_ns: Stamps
    values: dict[str, Array]
    rank: dict[str, int]
    counts: dict[str, float]


def assemble(
    robot: str,
    joint: str,
    blocks: Blocks,
    after: int | None,
    faults: Mapping[str, float],
    source: str,
    sha256: str,
) -> JointRecord | None:
    """Make one joint's record.

    Parameters
    ----------
    robot, joint : str
    blocks : list
        What was read of it.
    after : int or None
        Stamp of the last sample handed on before [ns].
    faults : mapping of str to float
        Rows of its file that could not be read, by kind.
    source, sha256 : str
        The file, and its hash.

    Returns
    -------
    JointRecord or None
        None if nothing can be believed. The clock is that of the source of the position, else of the first channel
        there is; other sources' values are carried to it.
    """
    axis = next(iter(blocks[0][2])).axis
    series = [
        made for made in (_series(blocks, origin, after) for origin in dict.fromkeys(b[0] for b in blocks)) if made
    ]
    if not series:
        return None
    base = min(series, key=_worth)
    channels: dict[str, Array] = {}
    counts = dict(base.counts)
    for other in sorted(series, key=lambda each: each is not base):
        for name, values in other.values.items():
            if other is base:
                channels[name] = values
            elif name not in channels or other.rank[name] < base.rank.get(name, 99):
                channels[name], stale = _carried(base.time_ns, other.time_ns, values)
                if stale:
                    counts[f"stale {name}"] = float(stale)
    channels = {name: values for name, values in channels.items() if _says(values)}
    if not channels:
        return None
    t0 = int(base.time_ns[0])
    t = sealed((base.time_ns - t0) * np.float64(1e-9))
    valid, told = judge(t, channels, axis)
    told["time"] |= counts | dict(faults)
    return JointRecord(robot, joint, t0, t, channels, axis, valid, source, sha256, told)


def _says(values: Array) -> bool:
    """Whether there is any number, be it infinite."""
    return bool(len(values)) and not (np.isnan(values[0]) and np.isnan(values).all())


def _worth(series: _Series) -> tuple[int, int]:
    first = next((i for i, name in enumerate(_BASES) if name in series.values), len(_BASES))
    return first, series.rank.get(_BASES[first], 0) if first < len(_BASES) else 0


def _series(blocks: Blocks, origin: str, after: int | None) -> _Series | None:
    own = [(time_ns, columns) for name, time_ns, columns in blocks if name == origin]
    time_ns = _together([block for block, _ in own])
    timed = believable_times(time_ns, after)
    if not len(timed.rows):
        return None
    rows = slice(None) if len(timed.rows) == len(time_ns) else timed.rows  # as a rule nothing is left out
    ranks = {key.channel: key.rank for _, columns in own for key in columns}
    values = {}
    for name in ranks:
        parts = []
        for block, columns in own:
            found = [column for key, column in columns.items() if key.channel == name]
            parts.append(found[0] if found else np.full(len(block), np.nan))
        values[name] = _together(parts)[rows]
    return _Series(time_ns[rows], values, ranks, timed.counts)


def _together(parts: list[np.ndarray]) -> np.ndarray:
    """Parts one after another; one alone is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _carried(base_ns: Stamps, time_ns: Stamps, values: Array) -> tuple[Array, int]:
    """Another clock's values at the base's stamps: the newest that is not later, or later by half a spacing at most.

    The allowance lets two publishers of one cycle meet whichever stamps first; a value older than `STALE` of its own
    spacings is not carried on.
    """
    spacings = [float(np.median(np.diff(each))) for each in (base_ns, time_ns) if len(each) > 1]
    allowance = int(0.5 * min(spacings)) if spacings else 0
    at = np.searchsorted(time_ns, base_ns + allowance, side="right") - 1
    there = at >= 0
    at = np.maximum(at, 0)
    old = there & (base_ns - time_ns[at] > STALE * max(spacings, default=0.0))
    return np.where(there & ~old, values[at], np.nan), int(old.sum())
