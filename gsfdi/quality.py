"""What of a recording may be believed: each check takes numbers and says where they fail it.

Nothing is mended: a value that fails is masked, counted and named. What is wrong with the clock stands in
`gsfdi.clock`; its counts are kept under ``"time"``.
"""

from collections.abc import Mapping

import numpy as np

from gsfdi.channels import Axis
from gsfdi.clock import time_summary
from gsfdi.passes import alone, at_limit, extent, quantile, runs, sampled, screen
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
    lacking = np.isnan(values)
    whole = not lacking.any()
    course = values if whole else values[~lacking]
    lone = np.zeros(len(course), dtype=np.bool_)
    if len(course) >= 20:
        alone(course, _far_off(course), True, lone)
    if whole:
        return lone
    found = np.zeros(len(values), dtype=np.bool_)
    found[~lacking] = lone
    return found


def _far_off(course: Array) -> float:
    """Distance from its neighbours' mean that an honest sample keeps below."""
    some = sampled(course[1:-1])
    off = np.abs(some - 0.5 * (sampled(course[:-2]) + sampled(course[2:])))
    spread = quantile(off, 0.9)
    # A smooth channel has corners; they are no spikes while they are small beside its whole course.
    span = quantile(np.abs(some - quantile(some, 0.5)), 0.99)
    # Nor is the flicker of the last digit of a resting one; what rounding leaves is no digit.
    digit = float(np.min(off, where=off > 1e-9 * max(float(np.abs(some).max()), 1e-3), initial=np.inf))
    return max(20.0 * spread, 1e-2 * span, min(10.0 * digit, 1e-2), 1e-9)


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
    found = runs(values, t, STUCK_SAMPLES, STUCK_SECONDS)
    if not found:
        return []
    within = sum(end - first for first, end in found)
    others = len(values) - 1 - within
    elsewhere = int(np.sum(values[1:] == values[:-1])) - within
    # A coarse or resting channel repeats all the time; only one that never does can be said to have frozen.
    return list(found) if others >= 2 * STUCK_SAMPLES and elsewhere <= 0.05 * others else []


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
        _reach(extent(channels[course][run])) > 0.01 * _reach(extent(channels[course]))
        for course in courses
        if course in channels
    )


Extent = tuple[int, float, float]
"""How many values a channel has, the least and the greatest."""


def _reach(one: Extent) -> float:
    count, least, greatest = one
    return float(greatest - least) if count else 0.0


def dead(name: str, extents: Mapping[str, Extent]) -> bool:
    """Whether a channel says one and the same throughout while another one shows that the joint moves.

    Parameters
    ----------
    name : str
    extents : mapping of str to (int, float, float)
        Of each channel: number of values, least, greatest.
    """
    count, least, greatest = extents[name]
    if name in _RESTS or count < STUCK_SAMPLES or least != greatest:
        return False
    courses = ("position", "joint_velocity", "motor_velocity", "setpoint")
    return any(_reach(extents[one]) > 1e-3 for one in courses if one != name and one in extents)


def saturated(values: Array, within: Extent) -> int:
    """Count the samples that sit, three or more in a row, on the channel's own largest or smallest value.

    Parameters
    ----------
    values : (n,) array
    within : (int, float, float)
        Number of values, least, greatest.
    """
    count, least, greatest = within
    if count < STUCK_SAMPLES or least == greatest:
        return 0
    sides = at_limit(values, least, greatest)
    # A channel at rest on its extreme is resting.
    return int(sum(in_rows for on, in_rows in sides if on < 0.5 * count))


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
    extents: dict[str, Extent] = {}
    for name, values in channels.items():
        clean[name], counts[name] = _screened(np.ascontiguousarray(values), _LIMITS.get(name, 1e30))
        extents[name] = extent(clean[name])
        if name in _DRIVES:
            counts[name]["saturated"] = float(saturated(clean[name], extents[name]))
        valid[name] = ~np.isnan(clean[name])
    for name in channels:
        frozen = stuck(name, clean, t)
        if frozen.any():
            counts[name]["stuck"] = float(frozen.sum())
            valid[name] &= ~frozen
        if dead(name, extents):
            counts[name]["dead"] = float(valid[name].sum())
            valid[name] = np.zeros(len(t), dtype=np.bool_)
    for mask in valid.values():
        mask.setflags(write=False)
    return valid, counts


def _screened(values: Array, limit: float) -> tuple[Array, dict[str, float]]:
    """A channel with NaN for what is absurd or a spike, the same array where nothing is; and how many those are."""
    missing, beyond = screen(values, limit)
    kept = np.where(np.abs(values) > limit, np.nan, values) if beyond else values
    lone = spikes(kept)
    spiked = int(lone.sum())
    if spiked:
        kept = np.where(lone, np.nan, kept)
    counts = {"missing": missing, "absurd": beyond, "spike": spiked, "stuck": 0, "dead": 0, "saturated": 0}
    return kept, {kind: float(count) for kind, count in counts.items()}
