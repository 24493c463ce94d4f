"""Output inertia off its nominal value: a payload, a changed pose of the arm."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def factor(m: Vector, p: Vector, s: Vector) -> float:
    """Give the inertia Ison over its nominal value."""
    return p[0]


TERM = PhysicsTerm(
    name="output_inertia_change",
    component="link",
    meaning="the joint moves more or less inertia than the model says",
    maintenance="declare the payload; check what is attached",
    place="output_inertia",
    law=factor,
    params=(
        Param(
            "ratio",
            "1",
            "output inertia over its nominal value",
            start=1.1,
            low=0.01,
            high=100.0,
            typical=0.1,
            neutral=1.0,
            linear=True,
            plausible=lambda s, ratio: (0.05, 20.0),
        ),
    ),
    source="the paper's eq. 5-1: Ison in A(4,3)",
    signature=("balance", "output"),
)
