"""Velocity gain: the speed sensor reads in proportion too much."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give ratio ω."""
    return p[0] * m[VALUE]


TERM = PhysicsTerm(
    name="velocity_gain",
    component="sensor",
    meaning="the speed sensor's scale is wrong",
    maintenance="calibrate the scale of the speed sensor",
    place="velocity_sensor",
    law=measured,
    params=(
        Param(
            "ratio",
            "1",
            "reading over speed",
            start=1.02,
            low=0.01,
            high=100.0,
            typical=0.02,
            neutral=1.0,
            linear=True,
            plausible=lambda s, ratio: (0.3, 3.0),
        ),
    ),
    source="R. Isermann, Fault-Diagnosis Systems (2006): y = (1 + f) x, on the second row of the paper's eq. 5-2",
    signature=("redundancy",),
)
