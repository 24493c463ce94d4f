"""Current bias: the current sensor reads a constant too much."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give i + bias."""
    return m[VALUE] + p[0]


TERM = PhysicsTerm(
    name="current_bias",
    component="sensor",
    meaning="the current sensor has an offset",
    maintenance="calibrate the zero of the current sensor",
    place="current_sensor",
    law=measured,
    params=(
        Param("bias_a", "A", "what is added", start=0.05, low=-1e4, high=1e4, typical=0.05, neutral=0.0, linear=True),
    ),
    source="R. Isermann, Fault-Diagnosis Systems (2006): additive sensor fault y = x + f",
    signature=("redundancy",),
)
