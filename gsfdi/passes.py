"""Compiled passes over a channel: a day of seven joints is a quarter of a billion values to judge."""

from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from gsfdi.types import Array, Mask

SAMPLED = 2_048
"""Samples that a median or a percentile is taken from, evenly spread; a long channel is not sorted whole."""


def sampled(values: Array) -> Array:
    """Every so manieth value, so that not many more than `SAMPLED` are left; every one of a short channel."""
    return values[:: len(values) // SAMPLED | 1] if len(values) >= 2 * SAMPLED else values


def quantile(values: Array, share: float) -> float:
    """The value that this share of the values lies below, one of them."""
    at = int(share * (len(values) - 1))
    return float(np.partition(values, at)[at])


@numba.njit(cache=True)
def screen(values: Array, limit: float) -> tuple[int, int]:
    """Count the values that are missing, and those beyond the limit."""
    missing = beyond = 0
    for i in range(len(values)):
        missing += np.isnan(values[i])
        beyond += abs(values[i]) > limit
    return missing, beyond


@numba.njit(cache=True)
def stray(before: float, value: float, after: float, threshold: float) -> bool:
    """Whether a value is further than the threshold off the mean of two neighbours that agree with each other."""
    off = abs(value - 0.5 * (before + after))
    return off > threshold and off > 5.0 * abs(after - before)


@numba.njit(cache=True)
def alone(course: Array, threshold: float, ends: bool, found: Mask) -> None:
    """Mark the strays; an end is held, if asked, against the line through the two samples next to it."""
    n = len(course)
    for i in range(1, n - 1):
        if stray(course[i - 1], course[i], course[i + 1], threshold):
            found[i] = True
    if ends:
        found[0] = stray(3.0 * course[1] - 2.0 * course[2], course[0], course[1], threshold)
        found[n - 1] = stray(course[n - 2], course[n - 1], 3.0 * course[n - 2] - 2.0 * course[n - 3], threshold)


def extent(values: Array) -> tuple[int, float, float]:
    """How many values there are, the least and the greatest."""
    if len(values):
        least = float(values.min())  # NaN as soon as one value is
        if not np.isnan(least):
            return len(values), least, float(values.max())
    known = values[~np.isnan(values)]
    return (len(known), float(known.min()), float(known.max())) if len(known) else (0, np.inf, -np.inf)


@numba.njit(cache=True)
def runs(values: Array, t: Array, samples: int, seconds: float) -> Any:
    """Runs of one value that are long in both senses: first and one past the last repeated sample of each.

    A window as long as the shortest run is walked from its end, so that most samples are never looked at.
    """
    found: list[tuple[int, int]] = [(0, 0) for _ in range(0)]
    first = 0
    while first + samples <= len(values):
        at = first + samples - 1
        while at > first and values[at] == values[at - 1]:
            at -= 1
        if at > first:
            first = at
            continue
        end = first + samples
        while end < len(values) and values[end] == values[first]:
            end += 1
        if t[end - 1] - t[first] >= seconds:
            found.append((first + 1, end))
        first = end
    return found


@numba.njit(cache=True)
def at_limit(values: Array, least: float, greatest: float) -> npt.NDArray[np.int64]:
    """For the least and the greatest value: samples that sit on it, and those that do so three or more in a row."""
    counts = np.zeros((2, 2), dtype=np.int64)
    run, last = 0, -1
    for i in range(len(values) + 1):
        side = -1
        if i < len(values):
            side = 0 if values[i] == least else 1 if values[i] == greatest else -1
        if side == last and side >= 0:
            run += 1
            continue
        if last >= 0:
            counts[last, 0] += run
            counts[last, 1] += run if run >= 3 else 0
        run, last = 1, side
    return counts


@numba.njit(cache=True)
def rises(time_ns: npt.NDArray[np.int64], farthest: float, jump: int) -> bool:
    """Whether stamps are near enough, rise without a jump, and differ still as float seconds from the first."""
    before = -1.0
    for i in range(len(time_ns)):
        if not abs(np.float64(time_ns[i])) <= farthest or (i > 0 and time_ns[i] - time_ns[i - 1] > jump):
            return False
        seconds = (time_ns[i] - time_ns[0]) * 1e-9
        if seconds <= before:
            return False
        before = seconds
    return True
