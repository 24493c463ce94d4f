"""Position-dependent friction: a tight spot around one joint angle."""

import math

import numpy as np

from gsfdi.motion import JOINT_ANGLE, Param, PhysicsTerm, Vector
from gsfdi.sliding import SMOOTH, sliding


def level(m: Vector, p: Vector, s: Vector) -> float:
    """Give F exp(-((θ - centre) / width)² / 2)."""
    x = (m[JOINT_ANGLE] - p[1]) / p[2]
    return p[0] * math.exp(-0.5 * min(x * x, 1400.0)) * sliding(m, p[3])


TERM = PhysicsTerm(
    name="position_dependent_friction",
    component="friction",
    meaning="friction is greater around one joint angle",
    maintenance="inspect the bearing race or tooth at that angle",
    place="dry",
    law=level,
    params=(
        Param(
            "torque_nm",
            "N m",
            "friction at the centre of the spot",
            start=2.0,
            low=0.0,
            high=1e5,
            typical=2.0,
            neutral=0.0,
            linear=True,
        ),
        Param(
            "centre_rad",
            "rad",
            "joint angle of the spot",
            start=0.0,
            low=-1e3,
            high=1e3,
            typical=0.5,
            trials=lambda s: list(np.linspace(s.centre - s.reach, s.centre + s.reach, 11)[1:-1:2]),
            plausible=lambda s, centre: (s.centre - 1.05 * s.reach, s.centre + 1.05 * s.reach),
            step=lambda s: 0.3 * s.reach,
        ),
        Param(
            "width_rad",
            "rad",
            "standard deviation of the spot",
            start=0.1,
            low=1e-5,
            high=1e3,
            typical=0.1,
            trials=lambda s: (0.1 * s.reach, 0.25 * s.reach),
            plausible=lambda s, width: (0.01 * s.reach, 0.6 * s.reach),
        ),
        SMOOTH,
    ),
    source="B. Armstrong, Control of Machines with Friction (1991), who measured it; the Gaussian shape is ours",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    several=True,
)
