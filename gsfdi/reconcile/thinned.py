"""Logs that hold but some of the efforts a controller made: what acted between two samples is only guessed.

Held from sample to sample, an effort logged at 100 Hz of a loop at 1 kHz acts half a sample late: a joint that lacks
20 N m of friction was said to lack a mode of 9 Hz besides, in 222 s. So between samples it runs smoothly (see
`gsfdi.drive.course`), and here is mended what that leaves.

A controller answers the noise of its sensors for one tick, and the log makes that the effort around its sample. Where
nothing moves fast, a delay or a damping then gains by smoothing that noise: 57 and 230 on a joint without a fault, its
noise told to the whitener or not; nothing once the effort is smoothed there first. What moves, however little, must not
be smoothed with it: joints excited up to 9 Hz lacked a mode of that frequency when smoothing might take nine tenths of
the noise of it. And a jump between two samples may have come at any tick.
"""

from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.signal import savgol_filter

from gsfdi.reconcile.sensing import noise_of
from gsfdi.types import Array, JointRecord

WIDTHS = (5, 9, 17)
"""Samples over which an effort is smoothed, the most over which cubics leave nothing but noise."""
LONG = 6
"""Widths over which what they leave is averaged: the least motion that is smoothed away with the noise is a mode."""
MEAN, MOST = 1.25, 4.0
"""Times what is left of noise that they may leave, in the mean square over so long, and times the noise at most."""
JUMPS = 5.0
"""Times its usual bend from sample to sample by which an effort jumps."""


def calmed(record: JointRecord) -> JointRecord:
    """Smooth the effort of a record where it runs smoothly; elsewhere it stays as it is."""
    effort = record[record.effort]
    if len(effort) < WIDTHS[-1] or not np.isfinite(effort).all():
        return record
    noise, calm = noise_of(record.t, effort), effort
    for width in WIDTHS:
        smooth = savgol_filter(effort, width, 3)
        left, free = effort - smooth, 1 - 4 / width  # a cubic takes four of the samples' freedoms
        mean, most = uniform_filter1d(left**2, LONG * width), maximum_filter1d(np.abs(left), width)
        calm = np.where((mean < MEAN * free * noise**2) & (most < MOST * noise), smooth, calm)
    return replace(record, channels={**record.channels, record.effort: calm})


def unseen_jumps(effort: Array) -> Array:
    """Doubt about the mean effort over the step before each sample, where it jumps; 0 elsewhere.

    A jump of 1 bends an effort by 2 from sample to sample (third difference), and its mean is in doubt by 1/√12.
    """
    bend = np.nan_to_num(np.abs(np.diff(effort, 3, prepend=[effort[0]] * 2, append=effort[-1])))
    near = maximum_filter1d(bend, 7)
    return np.asarray(np.where(near > JUMPS * np.median(bend), near / 48**0.5, 0.0))
