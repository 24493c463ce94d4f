"""Innovations made white: one noise model for every hypothesis, so that only physics tells them apart.

A replay in prediction mode corrects its state with one steady gain, chosen fast enough that even a wrong model stays
beside the recording. What it leaves is then refiltered, exactly, to what a Kalman filter with less process noise would
have left: two observers that see the same measurement differ by a linear system driven by the innovations. So the
costly, non-linear replay runs once per hypothesis, while the size of the process noise stays free to be estimated.

Process noise is a white torque on either side. It stands for everything that no hypothesis describes; its size comes
from maximum likelihood on the recording and falls as the model improves.
"""

from gsfdi.whiten.responding import respond
from gsfdi.whiten.system import LONGEST, Observed, observed, steady_gain, steps_of
from gsfdi.whiten.whitening import Whitener, pushes, whitener

__all__ = [
    "LONGEST",
    "Observed",
    "Whitener",
    "observed",
    "pushes",
    "respond",
    "steady_gain",
    "steps_of",
    "whitener",
]
