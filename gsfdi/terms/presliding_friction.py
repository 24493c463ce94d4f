"""Presliding friction: below sliding, bristles bend like a spring with hysteresis."""

from gsfdi.bristle import MEMORY, bristle
from gsfdi.motion import ANGLE, ANGLE_JUMPED, Param, PhysicsTerm

TERM = PhysicsTerm(
    name="presliding_friction",
    component="friction",
    meaning="friction that yields elastically before it slides",
    maintenance="inspect bearing preload and seals",
    place="torque",
    law=bristle(ANGLE, ANGLE_JUMPED, "stiffness"),
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
            "stiffness of the bristles from rest",
            start=1e4,
            low=1e-3,
            high=1e9,
            typical=1e4,
            kind="follower",  # a bristle keeps the stretch at which it slides
            trials=lambda s: [s.torque / (stretch * s.reach) for stretch in (2e-3, 1e-2, 5e-2)],
            # Stiffer, it would be Coulomb friction by another name.
            plausible=lambda s, stiffness: (0.05 * s.torque / s.reach, 3e3 * s.torque / s.reach),
        ),
        MEMORY,
    ),
    source="P. R. Dahl, Aerospace Corp. TOR-0158(3107-18)-1 (1968): dF/dx = σ (1 - F/Fc sgn v)^i with i = 1",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    memory=True,
    stiffness=lambda p: p[1],
    sets_in="rarely",
)
