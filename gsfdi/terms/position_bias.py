"""Position bias: the joint's sensor reads a constant too much."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give y + bias."""
    return m[VALUE] + p[0]


TERM = PhysicsTerm(
    name="position_bias",
    component="sensor",
    meaning="the position sensor has an offset",
    maintenance="calibrate the zero of the position sensor",
    place="position_sensor",
    law=measured,
    params=(
        Param(
            "bias_rad",
            "rad",
            "what is added",
            start=1e-3,
            low=-10.0,
            high=10.0,
            typical=1e-3,
            neutral=0.0,
            linear=True,
            size=lambda s: 10 * max(s.noise, 1e-4 * s.reach),
        ),
    ),
    source="R. Isermann, Fault-Diagnosis Systems (2006): y = x + f, on the first row of the paper's eq. 5-2",
    signature=("redundancy",),
)
