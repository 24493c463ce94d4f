"""Presliding friction: below sliding, bristles bend like a spring with hysteresis (Dahl)."""

import math

from gsfdi.motion import ANGLE, ANGLE_JUMPED, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give F z with dz/dx = (σ/F) (1 - z sgn dx), solved exactly over each move."""
    angle = m[ANGLE] - m[ANGLE_JUMPED]
    if math.isnan(s[0]):
        s[0], s[1] = 0.0, angle
    move = (angle - s[1]) * p[1] / max(p[0], 1e-12)
    s[1] = angle
    toward = 1.0 if move > 0.0 else -1.0
    s[0] = toward + (s[0] - toward) * math.exp(-min(abs(move), 700.0))
    return p[0] * s[0]


TERM = PhysicsTerm(
    name="presliding_friction",
    component="friction",
    meaning="friction that yields elastically before it slides",
    maintenance="inspect bearing preload and seals",
    place="torque",
    law=torque,
    params=(
        Param(
            "torque_nm",
            "N m",
            "friction torque in sliding",
            start=2.0,
            low=0.0,
            high=1e5,
            typical=2.0,
            neutral=0.0,
            plausible=lambda s, torque: (0.0, 3.0 * s.torque),
        ),
        Param(
            "stiffness_nm_rad",
            "N m/rad",
            "stiffness of the bristles at reversal",
            start=1e4,
            low=1e-3,
            high=1e9,
            typical=1e4,
            kind="follower",  # a bristle keeps the stretch at which it slides
            trials=lambda s: [s.torque / (stretch * s.reach) for stretch in (2e-3, 1e-2, 5e-2)],
            # Stiffer, it would be Coulomb friction by another name.
            plausible=lambda s, stiffness: (0.05 * s.torque / s.reach, 3e3 * s.torque / s.reach),
        ),
    ),
    source="P. R. Dahl, Aerospace Corp. TOR-0158(3107-18)-1 (1968): dF/dx = σ (1 - F/Fc sgn v)^i with i = 1",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    memory=True,
    stiffness=lambda p: p[1],
    sets_in="rarely",
)
