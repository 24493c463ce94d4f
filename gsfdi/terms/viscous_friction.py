"""Viscous friction: a torque in proportion to speed."""

from gsfdi.motion import SPEED, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give b times speed."""
    return p[0] * m[SPEED]


TERM = PhysicsTerm(
    name="viscous_friction",
    component="friction",
    meaning="viscous friction",
    maintenance="inspect the lubricant's grade and condition",
    place="torque",
    law=torque,
    params=(
        Param(
            "coefficient_nms_rad",
            "N m s/rad",
            "torque per speed",
            start=20.0,
            low=0.0,
            high=1e6,
            typical=20.0,
            neutral=0.0,
            linear=True,
        ),
    ),
    source="H. Olsson et al., Eur. J. Control 4 (1998) 176: F = Fv v",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    damping=lambda p: p[0],
)
