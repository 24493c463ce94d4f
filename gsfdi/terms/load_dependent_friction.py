"""Load-dependent friction: meshing teeth rub the harder the more torque they pass on."""

from gsfdi.motion import LOAD, Param, PhysicsTerm, Vector
from gsfdi.sliding import SMOOTH, sliding


def level(m: Vector, p: Vector, s: Vector) -> float:
    """Give ratio |load|."""
    return p[0] * abs(m[LOAD]) * sliding(m, p[1])


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
            size=lambda s: 0.02,
            plausible=lambda s, ratio: (0.0, 0.5),
        ),
        SMOOTH,
    ),
    source="P. Hamon, M. Gautier and P. Garrec, IEEE/RSJ IROS (2010): dry friction in proportion to the load",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    sets_in="rarely",
)
