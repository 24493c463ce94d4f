"""Stiffening spring: teeth and flexspline stiffen as they wind up."""

from gsfdi.motion import STIFFNESS, WINDUP, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give c k ε³."""
    return m[STIFFNESS] * p[0] * m[WINDUP] ** 3


TERM = PhysicsTerm(
    name="stiffening",
    component="gearbox",
    meaning="the gearbox stiffens under load",
    maintenance="use the stiffening curve in planning; no repair",
    place="spring",
    law=torque,
    params=(
        Param(
            "cubic_per_rad2",
            "1/rad²",
            "relative rise of stiffness per squared wind-up",
            start=1e4,
            low=0.0,
            high=1e12,
            typical=1e4,
            neutral=0.0,
            linear=True,
            plausible=lambda s, cubic: (0.0, 10.0 * s.windup**-2),
        ),
    ),
    source="T. D. Tuttle and W. P. Seering, IEEE Trans. Robot. Autom. 12 (1996) 368: cubic spring k1 ε + k2 ε³",
    signature=("windup",),
    structures=("flexible",),
    sets_in="rarely",
)
