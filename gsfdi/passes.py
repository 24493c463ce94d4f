"""Compiled passes over a channel: a day of seven joints is a quarter of a billion values to judge."""

from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from gsfdi.types import Array, Mask


@numba.njit(cache=True)
def screen(values: Array, limit: float, kept: Array) -> tuple[int, int]:
    """Copy the values within the limit, NaN in place of the others; says how many were missing and how many beyond."""
    missing = beyond = 0
    for i in range(len(values)):
        value = values[i]
        if np.isnan(value):
            missing += 1
        elif abs(value) > limit:
            beyond += 1
            value = np.nan
        kept[i] = value
    return missing, beyond


@numba.njit(cache=True)
def alone(course: Array, threshold: float, found: Mask) -> int:
    """Mark samples that stand further than the threshold off the mean of two neighbours that agree with each other."""
    n, count = len(course), 0
    for i in range(n):
        # An end is held against the line through the two samples next to it.
        before = course[i - 1] if i > 0 else 3.0 * course[1] - 2.0 * course[2]
        after = course[i + 1] if i < n - 1 else 3.0 * course[n - 2] - 2.0 * course[n - 3]
        off = abs(course[i] - 0.5 * (before + after))
        if off > threshold and off > 5.0 * abs(after - before):
            found[i] = True
            count += 1
    return count


@numba.njit(cache=True)
def extent(values: Array) -> tuple[int, float, float]:
    """How many values there are, the least and the greatest."""
    count, least, greatest = 0, np.inf, -np.inf
    for i in range(len(values)):
        value = values[i]
        if not np.isnan(value):
            count += 1
            least = min(least, value)
            greatest = max(greatest, value)
    return count, least, greatest


@numba.njit(cache=True)
def repeats(values: Array, t: Array, samples: int, seconds: float) -> Any:
    """Runs of one value that are long in both senses; how many pairs repeat within them, and how many elsewhere."""
    runs: list[tuple[int, int]] = [(0, 0) for _ in range(0)]
    within = elsewhere = 0
    first = 0
    for i in range(1, len(values) + 1):
        if i < len(values) and values[i] == values[i - 1]:
            continue
        length = i - first
        if length >= samples and t[i - 1] - t[first] >= seconds:
            runs.append((first + 1, i))
            within += length - 1
        else:
            elsewhere += length - 1
        first = i
    return runs, within, elsewhere


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
