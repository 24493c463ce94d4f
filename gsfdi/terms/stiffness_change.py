"""Gearbox stiffness off its nominal value: cracked teeth, a loose flange."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def factor(m: Vector, p: Vector, s: Vector) -> float:
    """Give the stiffness c over its nominal value."""
    return p[0]


TERM = PhysicsTerm(
    name="stiffness_change",
    component="gearbox",
    meaning="the gearbox is softer or stiffer than it should be",
    maintenance="inspect the gearbox for cracks and loose fasteners",
    place="stiffness",
    law=factor,
    params=(
        Param(
            "ratio",
            "1",
            "stiffness over its nominal value",
            start=0.9,
            low=1e-3,
            high=1e3,
            typical=0.1,
            neutral=1.0,
            linear=True,
            plausible=lambda s, ratio: (0.2, 1.6),
        ),
    ),
    source="the paper's eq. 5-1: c in A(2,3) and A(4,3)",
    signature=("windup",),
    structures=("flexible",),
)
