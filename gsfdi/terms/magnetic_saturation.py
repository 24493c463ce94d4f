"""Magnetic saturation: more current gives ever less torque."""

import math

from gsfdi.motion import CURRENT, Param, PhysicsTerm, Vector


def factor(m: Vector, p: Vector, s: Vector) -> float:
    """Give tanh(x) / x, 1 / sqrt(1 + x²) or 1 / (1 + x), with x the current over the saturation current."""
    x = abs(m[CURRENT]) / p[0]
    if p[1] > 1.5:
        return 1.0 / (1.0 + x)
    if p[1] > 0.5:
        return 1.0 / math.sqrt(1.0 + x * x)
    return 1.0 - x * x / 3.0 if x < 1e-4 else math.tanh(x) / x


TERM = PhysicsTerm(
    name="magnetic_saturation",
    component="motor",
    meaning="the motor's iron saturates, so that large currents give too little torque",
    maintenance="keep peak currents below saturation, or fit a larger motor",
    place="torque_constant",
    law=factor,
    params=(
        Param(
            "current_a",
            "A",
            "current at which the torque levels off",
            start=20.0,
            low=1e-6,
            high=1e6,
            typical=20.0,
            trials=lambda s: (s.effort, 3.0 * s.effort),
            plausible=lambda s, current: (0.2 * s.effort, 1e3 * s.effort),
        ),
        Param(
            "curve",
            "1",
            "how torque falls short of current, of which x saturate: 0 tanh(x) / x, 1 1 / sqrt(1 + x²), 2 1 / (1 + x)",
            start=0.0,
            low=0.0,
            high=2.0,
            typical=1.0,
            kind="choice",
        ),
    ),
    source="P. C. Krause et al., Analysis of Electric Machinery (2013), and O. Fröhlich, Elektrotech. Z. 2 (1881) 134: "
    "B = H / (a + b H); the other two curves are ours",
    signature=("balance", "proportional"),
    sets_in="rarely",
)
