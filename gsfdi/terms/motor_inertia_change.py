"""Motor inertia off its nominal value."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def factor(m: Vector, p: Vector, s: Vector) -> float:
    """Give the inertia Im over its nominal value."""
    return p[0]


TERM = PhysicsTerm(
    name="motor_inertia_change",
    component="motor",
    meaning="the motor side is heavier or lighter than the model says",
    maintenance="check the motor's data sheet value, brake and coupling",
    place="motor_inertia",
    law=factor,
    params=(
        Param(
            "ratio",
            "1",
            "motor inertia over its nominal value",
            start=1.1,
            low=0.01,
            high=100.0,
            typical=0.1,
            neutral=1.0,
            linear=True,
            plausible=lambda s, ratio: (0.5, 2.0),
        ),
    ),
    source="the paper's eq. 5-1: Im in A(2,3), A(4,3) and B",
    signature=("balance",),
    structures=("flexible",),
)
