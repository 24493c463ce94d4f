"""Transmission error: the output departs from the motor angle over the ratio, periodically."""

import math

from gsfdi.motion import GEAR, LEVER, MOTOR_TURN, VALUE, Param, PhysicsTerm, Vector
from gsfdi.wave import half_phase, shrunk, sine


def deflection(m: Vector, p: Vector, s: Vector) -> float:
    """Give the difference of angles less a sin(n φ + phase); the motor feels the spring through the slope of that."""
    slope = math.cos(p[1] * m[MOTOR_TURN] + p[2]) * shrunk(half_phase(m, p[1]))
    m[LEVER] += p[0] * p[1] * m[GEAR] * slope
    return m[VALUE] - sine(m, p[0], p[1], p[2])


TERM = PhysicsTerm(
    name="transmission_error",
    component="gearbox",
    meaning="the gear's output wavers once or more per motor turn",
    maintenance="check the gear's alignment and tooth wear",
    place="windup",
    law=deflection,
    params=(
        Param(
            "amplitude_rad",
            "rad",
            "amplitude, at the output",
            start=1e-4,
            low=0.0,
            high=0.1,
            typical=1e-4,
            neutral=0.0,
            linear=True,
        ),
        Param(
            "order",
            "1/rev",
            "periods per motor revolution",
            start=2.0,
            low=0.05,
            high=500.0,
            typical=2.0,
            # Teeth need not meet again after whole turns of the motor.
            plausible=lambda s, order: (max(0.7, order - 0.4), order + 0.4),
        ),
        Param(
            "phase_rad",
            "rad",
            "phase at motor angle zero",
            start=0.0,
            low=-math.pi,
            high=math.pi,
            typical=1.0,
            kind="angle",
        ),
    ),
    source="F. H. Ghorbel, P. S. Gandhi and F. Alpeter, J. Mech. Des. 123 (2001): one harmonic; lever by virtual work",
    signature=("windup",),
    structures=("flexible",),
    wave="order",
    sets_in="rarely",
    several=True,
)
