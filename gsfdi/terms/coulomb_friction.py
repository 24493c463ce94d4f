"""Coulomb friction: a constant torque against the motion, which holds the joint still below it."""

from gsfdi.motion import Param, PhysicsTerm
from gsfdi.types import Array


def level(m: Array, p: Array, s: Array) -> float:
    """Give the level."""
    return p[0]


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
    ),
    source="H. Olsson et al., Friction models and friction compensation, Eur. J. Control 4 (1998), eq. 1",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
)
