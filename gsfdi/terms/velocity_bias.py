"""Velocity bias: the speed sensor reads a constant too much."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give ω + bias."""
    return m[VALUE] + p[0]


TERM = PhysicsTerm(
    name="velocity_bias",
    component="sensor",
    meaning="the speed sensor has an offset",
    maintenance="calibrate the zero of the speed sensor",
    place="velocity_sensor",
    law=measured,
    params=(
        Param(
            "bias_rad_s",
            "rad/s",
            "what is added, at the sensor's own axis",
            start=0.05,
            low=-1e4,
            high=1e4,
            typical=0.05,
            neutral=0.0,
            linear=True,
            size=lambda s: 0.1 * (s.speed * s.turns),  # the sensor sits on the motor
        ),
    ),
    source="R. Isermann, Fault-Diagnosis Systems (2006): additive sensor fault y = x + f",
    signature=("redundancy",),
)
