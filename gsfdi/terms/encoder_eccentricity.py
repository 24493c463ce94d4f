"""Encoder eccentricity: a disc off its centre reads too much and too little over a turn of the joint."""

import math

from gsfdi.motion import JOINT_ANGLE, VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give y + a sin(n θ + phase)."""
    return m[VALUE] + p[0] * math.sin(p[1] * m[JOINT_ANGLE] + p[2])


TERM = PhysicsTerm(
    name="encoder_eccentricity",
    component="sensor",
    meaning="the position sensor's disc is off its centre",
    maintenance="realign or replace the position sensor",
    place="position_sensor",
    law=measured,
    params=(
        Param(
            "amplitude_rad",
            "rad",
            "amplitude",
            start=1e-4,
            low=0.0,
            high=1.0,
            typical=1e-4,
            neutral=0.0,
            linear=True,
            # A tenth of what is plain: ten deviations of the noise, or a hundredth of the reach.
            size=lambda s: 0.1 * (10 * max(s.noise, 1e-3 * s.reach)),
        ),
        Param("order", "1/rev", "periods per revolution of the joint", start=1.0, low=0.05, high=5000.0, typical=1.0),
        Param(
            "phase_rad",
            "rad",
            "phase at joint angle zero",
            start=0.0,
            low=-math.pi,
            high=math.pi,
            typical=1.0,
            kind="angle",
        ),
    ),
    source="plane geometry: a disc of radius r, e off its axis, reads (e/r) sin(θ + φ) too much",
    signature=("redundancy",),
    sets_in="rarely",
    several=True,
)
