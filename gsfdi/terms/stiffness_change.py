"""Gearbox stiffness off its nominal value: cracked teeth, a loose flange."""

from gsfdi.motion import Param, PhysicsTerm
from gsfdi.types import Array


def factor(m: Array, p: Array, s: Array) -> float:
    """Give c / nominal c."""
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
        ),
    ),
    source="the paper's component fault, A(1 + ΔA) of its eq. 5-1",
    signature=("windup",),
    structures=("flexible",),
)
