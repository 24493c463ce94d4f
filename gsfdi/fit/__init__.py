"""Fits a joint's model to recordings by replaying it: knobs to turn, a noise model, and damped least squares.

The misfit is the sequence of white innovations (see `gsfdi.whiten`) of the model run as an observer beside the
recordings. It needs no controller, forgets its initial state, and under feedback it is what maximum likelihood asks
for; a fit on positions alone would see nothing, for the controller hides there whatever the model lacks.
"""

from gsfdi.fit.knobs import BRISTLES, INTEGRAL, SHIFT, START, START_RATE, SWING, SWING_RATE, Knob, Started, turned
from gsfdi.fit.levenberg import Fitted, Misfit, covariance, levenberg, slopes

__all__ = [
    "BRISTLES",
    "INTEGRAL",
    "SHIFT",
    "START",
    "START_RATE",
    "SWING",
    "SWING_RATE",
    "Fitted",
    "Knob",
    "Misfit",
    "Started",
    "covariance",
    "levenberg",
    "slopes",
    "turned",
]
