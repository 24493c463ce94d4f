"""Load-dependent friction: meshing teeth rub the harder the more torque they pass on."""

from gsfdi.motion import LOAD, Param, PhysicsTerm
from gsfdi.types import Array


def level(m: Array, p: Array, s: Array) -> float:
    """Give ratio |load|."""
    return p[0] * abs(m[LOAD])


TERM = PhysicsTerm(
    name="load_dependent_friction",
    component="friction",
    meaning="friction grows with the torque that the gearbox passes on",
    maintenance="inspect gear mesh and lubrication",
    place="dry",
    law=level,
    params=(
        Param(
            "ratio",
            "1",
            "friction per transmitted torque",
            start=0.05,
            low=0.0,
            high=1.0,
            typical=0.05,
            neutral=0.0,
            linear=True,
        ),
    ),
    source="P. Hamon, M. Gautier and P. Garrec, IEEE/RSJ IROS (2010), eq. 8",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
)
