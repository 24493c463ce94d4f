"""Sliding: dry friction turns round with the motion, at once or over a range of speed.

At once it holds the joint still; many simulators, and seals that shear, spread the turn over a range of speed instead.

References
----------
.. [1] S. Andersson, A. Söderberg and S. Björklund, Tribology Int. 40 (2007) 580: F = Fc tanh(k v).
"""

import math

from gsfdi.motion import SPEED, Param, Vector

SMOOTH = Param(
    "smooth_rad_s",
    "rad/s",
    "speed v0 over which it turns round, as tanh(v / v0); at 0 at once",
    start=0.0,
    low=0.0,
    high=1e3,
    typical=0.005,
    kind="detail",
    trials=lambda s: [share * s.speed for share in (0.002, 0.006, 0.02)],
    # Below all speeds it turns at once, beyond that it is drag that builds up with speed.
    plausible=lambda s, speed: (0.0005 * s.speed, 0.05 * s.speed),
)


def sliding(m: Vector, smooth: float) -> float:
    """Give the share of a dry friction that is there at speed; laws that are compiled may call it (see `packed`)."""
    return math.tanh(abs(m[SPEED]) / smooth) if smooth > 0.0 else 1.0
