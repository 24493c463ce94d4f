"""What of a recording may be believed: each check takes numbers and says where they fail it.

Nothing is mended: a value that fails is masked, counted and named. What is wrong with the clock stands in
`gsfdi.clock`; its counts are kept under ``"time"``.
"""

from collections.abc import Mapping

import numpy as np

from gsfdi.channels import Axis
from gsfdi.clock import time_summary
from gsfdi.types import Array, Mask

_LIMITS: dict[str, float] = {
    "position": 1e6,
    "setpoint": 1e6,
    "setpoint_rate": 1e5,
    "joint_velocity": 1e5,
    "motor_velocity": 1e6,
    "motor_current": 1e5,
    "motor_current_feedforward": 1e5,
    "drive_torque": 1e7,
    "drive_torque_feedforward": 1e7,
    "temperature": 1e3,
}
"""Beyond these no joint of any robot goes (SI)."""

_RESTS = {"setpoint", "setpoint_rate", "motor_current_feedforward", "drive_torque_feedforward", "temperature"}
"""Channels that may honestly keep one value."""

_SPEEDS = ("joint_velocity", "motor_velocity")
_DRIVES = {"motor_current", "drive_torque"}
"""Channels that saturate."""

_SAMPLED = 20_000
"""Samples that a percentile is taken from, evenly spread; a long channel is not sorted whole."""
STUCK_SAMPLES = 25
STUCK_SECONDS = 0.5


def absurd(values: Array, channel: str) -> Mask:
    """Where a value is infinite or beyond what any joint reaches.

    Parameters
    ----------
    values : (n,) array
    channel : str

    Examples
    --------
    >>> absurd(np.array([0.1, 1e165, np.nan]), "position")
    array([False,  True, False])
    """
    with np.errstate(invalid="ignore"):
        beyond: Mask = np.abs(values) > _LIMITS.get(channel, 1e30)
    return beyond


def spikes(values: Array) -> Mask:
    """Where a single sample stands far off both of its neighbours, which agree with each other.

    Its distance from their mean is set against what nine tenths of the channel keep below, so that a noisy channel is
    judged by its noise; what lasts two samples or more is left to the detectors, since a fault lasts.

    Parameters
    ----------
    values : (n,) array
        NaN where there is no value.
    """
    found = np.zeros(len(values), dtype=np.bool_)
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < 20:
        return found
    course = values[known]
    # An end is held against the line through the two samples next to it.
    before, after = 3 * course[1] - 2 * course[2], 3 * course[-2] - 2 * course[-3]
    course = np.concatenate([[before], course, [after]])
    off = np.abs(course[1:-1] - 0.5 * (course[:-2] + course[2:]))
    every = len(known) // _SAMPLED + 1
    spread = float(np.percentile(off[::every], 90))
    # A smooth channel has corners; they are no spikes while they are small beside its whole course.
    sampled = course[::every]
    span = float(np.percentile(np.abs(sampled - np.median(sampled)), 99))
    # Nor is the flicker of the last digit of a resting one; what rounding leaves is no digit.
    digit = float(np.min(off, where=off > 1e-9 * max(float(np.abs(sampled).max()), 1e-3), initial=np.inf))
    far = np.flatnonzero(off > max(20.0 * spread, 1e-2 * span, min(10.0 * digit, 1e-2), 1e-9))
    alone = off[far] > 5.0 * np.abs(course[far + 2] - course[far])
    found[known[far[alone]]] = True
    return found


def frozen_runs(values: Array, t: Array) -> list[tuple[int, int]]:
    """Where a channel that otherwise always flickers repeats one value for long.

    Parameters
    ----------
    values : (n,) array
    t : (n,) array
        Time [s].

    Returns
    -------
    list of (int, int)
        First and one past the last repeated sample of each run.
    """
    if len(values) < 4 * STUCK_SAMPLES:
        return []
    same = values[1:] == values[:-1]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(np.int8)))
    first, last = edges[::2], edges[1::2]
    long = (last - first + 1 >= STUCK_SAMPLES) & (t[last] - t[first] >= STUCK_SECONDS)
    in_long = int(np.sum((last - first)[long]))
    others = len(same) - in_long
    # A coarse or resting channel repeats all the time; only one that never does can be said to have frozen.
    if others < 2 * STUCK_SAMPLES or np.sum(same) - in_long > 0.05 * others:
        return []
    return [(int(a) + 1, int(b) + 1) for a, b in zip(first[long], last[long], strict=True)]


def stuck(name: str, channels: Mapping[str, Array], t: Array) -> Mask:
    """Where a channel has frozen although another one shows that the joint moves.

    A joint at rest, or jammed, honestly repeats its position: speed then reads next to nothing.

    Parameters
    ----------
    name : str
    channels : mapping of str to (n,) array
        NaN where a value is not believed.
    t : (n,) array
        Time [s].
    """
    found = np.zeros(len(t), dtype=np.bool_)
    if name in _RESTS:
        return found
    for a, b in frozen_runs(channels[name], t):
        if name in _DRIVES and abs(channels[name][a]) >= np.nanmax(np.abs(channels[name])):
            continue  # it has reached its limit, which is physics
        if name in _SPEEDS:
            found[a:b] = channels[name][a] != 0.0
        else:
            found[a:b] = _moves_within(name, channels, slice(a, b))
    return found


def _moves_within(name: str, channels: Mapping[str, Array], run: slice) -> bool:
    speeds = [channels[speed] for speed in _SPEEDS if speed in channels]
    for speed in speeds if name == "position" else ():
        usual = float(np.nanpercentile(np.abs(speed), 90)) if np.isfinite(speed).any() else 0.0
        here = np.abs(speed[run])
        if np.isfinite(here).any() and float(np.nanmedian(here)) > 0.1 * usual > 0.0:
            return True
    courses = ("position",) if name != "position" else () if speeds else ("setpoint",)
    return any(
        _range(channels[course][run]) > 0.01 * _range(channels[course]) for course in courses if course in channels
    )


def _range(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if len(known) else 0.0


def dead(values: Array, channel: str, moves: bool) -> bool:
    """Whether a channel says one and the same throughout while the joint moves.

    Parameters
    ----------
    values : (n,) array
    channel : str
    moves : bool
        Whether another channel shows that the joint moves.
    """
    known = values[np.isfinite(values)]
    return channel not in _RESTS and moves and len(known) >= STUCK_SAMPLES and float(np.ptp(known)) == 0.0


def saturated(values: Array) -> int:
    """Count the samples that sit, three or more in a row, on the channel's own largest or smallest value.

    Parameters
    ----------
    values : (n,) array
    """
    known = values[np.isfinite(values)]
    if len(known) < STUCK_SAMPLES or np.ptp(known) == 0.0:
        return 0
    count = 0
    for extreme in (known.max(), known.min()):
        at = known == extreme
        if at.sum() < 0.5 * len(known):  # a channel at rest on its extreme is resting
            inside = at[:-2] & at[1:-1] & at[2:]
            count += int(np.sum(np.convolve(inside, [1, 1, 1]) > 0))
    return count


def judge(t: Array, channels: Mapping[str, Array], axis: Axis) -> tuple[dict[str, Mask], dict[str, dict[str, float]]]:
    """Say where each channel may be believed, and count why not.

    Parameters
    ----------
    t : (n,) array
        Time [s].
    channels : mapping of str to (n,) array
        As read.
    axis : {'rotary', 'linear'}

    Returns
    -------
    dict of str to (n,) bool array, dict of str to dict of str to float
        Masks, and counts by channel and kind of defect.
    """
    valid: dict[str, Mask] = {}
    counts: dict[str, dict[str, float]] = {"time": time_summary(t)}
    clean: dict[str, Array] = {}
    for name, values in channels.items():
        missing = np.isnan(values)
        wild = absurd(values, name)
        kept = np.where(missing | wild, np.nan, values)
        lone = spikes(kept)
        counts[name] = {
            "missing": float(missing.sum()),
            "absurd": float(wild.sum()),
            "spike": float(lone.sum()),
            "stuck": 0.0,
            "dead": 0.0,
            "saturated": float(saturated(kept)) if name in _DRIVES else 0.0,
        }
        valid[name] = ~(missing | wild | lone)
        clean[name] = np.where(valid[name], values, np.nan)
    for name in channels:
        frozen = stuck(name, clean, t)
        if frozen.any():
            counts[name]["stuck"] = float(frozen.sum())
            valid[name] &= ~frozen
        if dead(clean[name], name, _moves(clean, besides=name)):
            counts[name]["dead"] = float(valid[name].sum())
            valid[name] = np.zeros(len(t), dtype=np.bool_)
    return valid, counts


def _moves(channels: Mapping[str, Array], besides: str) -> bool:
    """Whether any other channel of position or speed varies."""
    for name in ("position", "joint_velocity", "motor_velocity", "setpoint"):
        if name != besides and name in channels:
            known = channels[name][np.isfinite(channels[name])]
            if len(known) and float(np.ptp(known)) > 1e-3:
                return True
    return False
