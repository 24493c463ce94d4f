"""Stribeck friction: more dry friction near standstill, which fades as the lubricant film builds up."""

import math

from gsfdi.motion import SPEED, Param, PhysicsTerm, Vector
from gsfdi.sliding import SMOOTH, sliding


def level(m: Vector, p: Vector, s: Vector) -> float:
    """Give the excess that is left at speed: it fades as exp(-x²), as 1 / (1 + x²), or as exp(-|x|), x being v / vs."""
    x, excess = abs(m[SPEED] / p[1]), p[0] * sliding(m, p[3])
    if p[2] > 1.5:
        return excess * math.exp(-min(x, 700.0))
    if p[2] > 0.5:
        return excess / (1.0 + x * x)
    return excess * math.exp(-min(x * x, 700.0))


TERM = PhysicsTerm(
    name="stribeck_friction",
    component="friction",
    meaning="friction that is greater at low speed: stick-slip",
    maintenance="relubricate; inspect for boundary wear",
    place="dry",
    law=level,
    params=(
        Param(
            "excess_nm",
            "N m",
            "friction at rest beyond that at speed",
            start=2.0,
            low=0.0,
            high=1e5,
            typical=2.0,
            neutral=0.0,
            linear=True,
        ),
        Param(
            "velocity_rad_s",
            "rad/s",
            "speed at which the excess has faded to 1/e, or to a half where its curve is 1 / (1 + (v / vs)²)",
            start=0.005,
            low=1e-7,
            high=1e3,
            typical=0.005,
            trials=lambda s: [share * s.speed for share in (0.02, 0.06, 0.15, 0.35)],
            # Beyond all speeds, it would be Coulomb friction by another name.
            plausible=lambda s, speed: (0.004 * s.speed, 0.7 * s.speed),
        ),
        Param(
            "curve",
            "1",
            "how it fades: 0 exp(-(v / vs)²), 1 1 / (1 + (v / vs)²), 2 exp(-|v| / vs)",
            start=0.0,
            low=0.0,
            high=2.0,
            typical=1.0,
            kind="choice",
        ),
        SMOOTH,
    ),
    source="B. Armstrong-Hélouvry et al., Automatica 30 (1994) 1083: (Fs - Fc) exp(-(v / vs)^δ) with δ = 2 or 1, and "
    "with 1 / (1 + (v / vs)²) D. P. Hess and A. Soom, J. Tribology 112 (1990) 147",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    sets_in="rarely",
)
