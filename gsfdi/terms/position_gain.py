"""Position gain: the joint's sensor reads in proportion too much."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give ratio y."""
    return p[0] * m[VALUE]


TERM = PhysicsTerm(
    name="position_gain",
    component="sensor",
    meaning="the position sensor's scale is wrong",
    maintenance="calibrate the scale of the position sensor",
    place="position_sensor",
    law=measured,
    params=(
        Param(
            "ratio",
            "1",
            "reading over joint angle",
            start=1.01,
            low=0.01,
            high=100.0,
            typical=0.01,
            neutral=1.0,
            linear=True,
            plausible=lambda s, ratio: (0.3, 3.0),
        ),
    ),
    source="R. Isermann, Fault-Diagnosis Systems (2006): y = (1 + f) x, on the first row of the paper's eq. 5-2",
    signature=("redundancy", "output"),
)
