"""Cogging: magnets pull towards the teeth of the stator, whatever the current."""

import math

from gsfdi.motion import Param, PhysicsTerm, Vector
from gsfdi.wave import sine


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give a sin(n φ + phase), with φ the motor angle."""
    return sine(m, p[0], p[1], p[2])


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
