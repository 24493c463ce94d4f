"""Coulomb friction: a constant torque against the motion, which holds the joint still below it."""

from gsfdi.motion import Param, PhysicsTerm, Vector
from gsfdi.sliding import SMOOTH, sliding


def level(m: Vector, p: Vector, s: Vector) -> float:
    """Give the level."""
    return p[0] * sliding(m, p[1])


TERM = PhysicsTerm(
    name="coulomb_friction",
    component="friction",
    meaning="dry friction of constant torque",
    maintenance="inspect bearings, seals and lubrication",
    place="dry",
    law=level,
    params=(
        Param(
            "torque_nm", "N m", "friction torque", start=2.0, low=0.0, high=1e5, typical=2.0, neutral=0.0, linear=True
        ),
        SMOOTH,
    ),
    source="H. Olsson et al., Eur. J. Control 4 (1998) 176: F = Fc sgn(v), any value up to Fc at rest",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
)
