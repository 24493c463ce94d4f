"""Recordings with gaps: cut where too much is lost, with empty rows where little is."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from gsfdi.types import Array, JointRecord, Mask
from gsfdi.whiten import LONGEST

MEASURED = ("position", "motor_velocity", "joint_velocity")
"""Channels that a lost sample leaves empty."""
SMOOTH = 10.0
"""Jump of an acceleration within two samples, over the usual one, up to which a setpoint is smooth."""
CORNER = 0.05
"""The same over the largest one."""
SUDDEN, RAMP = 3.0, 8
"""Times the usual jump within so many samples on either side from which one stands alone."""


def stretches(record: JointRecord, period: float, shortest: float) -> list[JointRecord]:
    """Cut `record` at its gaps, and give each missing sample of a short gap a row without measurement.

    Effort and command run straight over such a row; a longer gap hides more than a line can bridge. What lies between
    gaps and is shorter than `shortest` [s] is left out.
    """
    record = without_lost(record)
    ends = np.flatnonzero(np.diff(record.t) > (LONGEST + 0.5) * period) + 1
    found = []
    for part in np.split(np.arange(len(record.t)), ends):
        if len(part) < shortest / period + 20:
            continue
        t = record.t[part]
        missing = np.round(np.diff(t) / period).astype(np.int64) - 1
        rows = np.flatnonzero(missing > 0)
        extra = [t[k] + (t[k + 1] - t[k]) * (i + 1) / (missing[k] + 1) for k in rows for i in range(missing[k])]
        times = np.sort(np.concatenate([t, extra]))
        lost = ~np.isin(times, t)
        channels = {}
        for name in record.channels:
            values = record[name][part]
            good = np.isfinite(values)
            full = np.interp(times, t[good], values[good]) if good.any() else np.full(len(times), np.nan)
            bare = lost | (np.interp(times, t, good.astype(float)) < 1)
            channels[name] = np.where(bare, np.nan, full) if name in MEASURED else full
        found.append(replace(record, t=times, channels=channels, valid={}))
    return found


def without_lost(record: JointRecord) -> JointRecord:
    """Leave out the samples of a long run without effort or position: they are a gap, whatever else was logged."""
    lost = ~(np.isfinite(record[record.effort]) & np.isfinite(record["position"]))
    edges = np.flatnonzero(np.diff(lost, prepend=False, append=False))
    keep = np.ones(len(lost), dtype=np.bool_)
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        keep[first:end] = end - first <= LONGEST
    return replace(record, t=record.t[keep], channels={name: record[name][keep] for name in record.channels}, valid={})


def beside_lost(record: JointRecord) -> Mask:
    """Samples whose position is lost, and those beside them."""
    lost = ~np.isfinite(record["position"])
    beside = lost.copy()
    beside[1:] |= lost[:-1]
    beside[:-1] |= lost[1:]
    return beside


def at_corners(setpoint: Array, t: Array) -> Mask:
    """Samples at which a setpoint's acceleration jumps, so that the slope between neighbours is no rate of it.

    Central differences err there by a quarter of the jump times the period; where the setpoint runs smoothly, by as
    little everywhere.
    """
    jump = jumps(setpoint, t)
    return jump > max(SMOOTH * float(np.median(jump)), CORNER * float(jump.max()))


def at_jolts(setpoint: Array, t: Array) -> Mask:
    """Corners at which the acceleration itself jumps, rather than runs along a steep ramp for a while.

    On such a ramp central differences err as much from sample to sample, by what a spring that is half a percent
    stiffer would do to the motor's speed.
    """
    jump = jumps(setpoint, t)
    return at_corners(setpoint, t) & (jump > SUDDEN * median_filter(jump, 2 * RAMP + 1, mode="nearest"))


def jumps(setpoint: Array, t: Array) -> Array:
    """Change of a setpoint's acceleration from the sample before to the one after."""
    push = np.gradient(np.gradient(setpoint, t), t)
    jump = np.zeros(len(t))
    jump[3:-3] = np.abs(push[4:-2] - push[2:-4])  # nearer the ends the slopes themselves are one-sided
    return jump
