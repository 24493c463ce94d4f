"""Quadratic friction: churning and windage grow with the square of speed."""

from gsfdi.motion import SPEED, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give c v |v|."""
    return p[0] * m[SPEED] * abs(m[SPEED])


TERM = PhysicsTerm(
    name="quadratic_friction",
    component="friction",
    meaning="drag grows with the square of speed",
    maintenance="check the amount of lubricant",
    place="torque",
    law=torque,
    params=(
        Param(
            "coefficient_nms2_rad2",
            "N m s²/rad²",
            "torque per squared speed",
            start=50.0,
            low=0.0,
            high=1e8,
            typical=50.0,
            neutral=0.0,
            linear=True,
        ),
    ),
    source="F. M. White, Fluid Mechanics (2011): drag F = ½ ρ C A v |v|",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    sets_in="rarely",
)
