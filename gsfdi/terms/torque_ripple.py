"""Torque ripple: the torque constant varies over a motor turn (commutation, winding harmonics)."""

import math

from gsfdi.motion import Param, PhysicsTerm, Vector
from gsfdi.wave import sine


def factor(m: Vector, p: Vector, s: Vector) -> float:
    """Give 1 + a sin(n φ + phase), with φ the motor angle."""
    return 1.0 + sine(m, p[0], p[1], p[2])


TERM = PhysicsTerm(
    name="torque_ripple",
    component="motor",
    meaning="the motor's torque per ampere varies over each turn",
    maintenance="check commutation and phase balance of the motor",
    place="torque_constant",
    law=factor,
    params=(
        Param(
            "amplitude_ratio",
            "1",
            "amplitude over the torque constant",
            start=0.05,
            low=0.0,
            high=1.0,
            typical=0.05,
            neutral=0.0,
            linear=True,
            plausible=lambda s, amplitude: (0.0, 0.6),
        ),
        Param("order", "1/rev", "periods per motor revolution", start=6.0, low=0.05, high=5000.0, typical=6.0),
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
    source="T. M. Jahns and W. L. Soong, IEEE Trans. Ind. Electron. 43 (1996) 321: one harmonic of Kt",
    signature=("balance", "proportional"),
    wave="order",
    sets_in="rarely",
    several=True,
)
