"""Cogging: magnets pull towards the teeth of the stator, whatever the current."""

import math

from gsfdi.motion import GEAR, MOTOR_TURN, SPEED, STEP, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give a sin(n φ + phase), with φ the motor angle."""
    half = 0.5 * p[1] * m[GEAR] * m[SPEED] * m[STEP]
    mean = math.sin(half) / half if abs(half) > 1e-6 else 1.0  # of the wave over a step
    return p[0] * mean * math.sin(p[1] * m[MOTOR_TURN] + p[2])


TERM = PhysicsTerm(
    name="cogging",
    component="motor",
    meaning="the motor's magnets pull it towards fixed angles",
    maintenance="compensate the cogging in the drive, or replace the motor if it has grown",
    place="torque",
    law=torque,
    params=(
        Param(
            "amplitude_nm",
            "N m",
            "amplitude at the output axis",
            start=2.0,
            low=0.0,
            high=1e4,
            typical=2.0,
            neutral=0.0,
            linear=True,
        ),
        Param("order", "1/rev", "periods per motor revolution", start=12.0, low=0.05, high=5000.0, typical=12.0),
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
    source="Z. Q. Zhu and D. Howe, IEEE Trans. Energy Convers. 15 (2000) 407: one order of the Fourier series",
    signature=("balance",),
    wave="order",
    sets_in="rarely",
    several=True,
)
