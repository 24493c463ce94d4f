"""Current gain: the current sensor reads in proportion too much."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give ratio i."""
    return p[0] * m[VALUE]


TERM = PhysicsTerm(
    name="current_gain",
    component="sensor",
    meaning="the current sensor's scale is wrong",
    maintenance="calibrate the scale of the current sensor",
    place="current_sensor",
    law=measured,
    params=(
        Param(
            "ratio",
            "1",
            "reading over current",
            start=1.02,
            low=-100.0,  # a sensor may be wired the wrong way round
            high=100.0,
            typical=0.02,
            neutral=1.0,
            linear=True,
            plausible=lambda s, ratio: (0.3, 3.0),
        ),
    ),
    source="R. Isermann, Fault-Diagnosis Systems (2006): multiplicative sensor fault y = (1 + f) x",
    signature=("redundancy", "proportional"),
)
