"""Asymmetric friction: one direction of motion costs more than the other."""

from gsfdi.motion import DIRECTION, SPEED, Param, PhysicsTerm, Vector
from gsfdi.sliding import SMOOTH, sliding


def level(m: Vector, p: Vector, s: Vector) -> float:
    """Give half the difference, added in positive and taken away in negative motion."""
    return 0.5 * m[DIRECTION] * (p[0] * sliding(m, p[2]) + p[1] * abs(m[SPEED]))


TERM = PhysicsTerm(
    name="asymmetric_friction",
    component="friction",
    meaning="friction differs between the directions of motion",
    maintenance="inspect for one-sided wear, a bent screw or preload on one flank",
    place="dry",
    law=level,
    params=(
        Param(
            "difference_nm",
            "N m",
            "dry friction in positive less that in negative motion",
            start=1.0,
            low=-1e5,
            high=1e5,
            typical=1.0,
            neutral=0.0,
            linear=True,
            step=lambda s: 0.1 * s.of("N m"),  # either may be next to nothing beside the other
        ),
        Param(
            "difference_nms_rad",
            "N m s/rad",
            "viscous coefficient in positive less that in negative motion",
            start=0.0,
            low=-1e6,
            high=1e6,
            typical=10.0,
            neutral=0.0,
            linear=True,
            step=lambda s: 0.1 * s.of("N m s/rad"),
        ),
        SMOOTH,
    ),
    source="A. Janot, M. Gautier and M. Brunot, Data Set and Reference Models of EMPS (2019): Fc± and Fv±",
    signature=("balance",),
    sides=("motor", "output"),
    sided=True,
)
