"""Shear-thinning friction: a lubricant's drag builds up with speed and levels off where its film begins to yield."""

import math

from gsfdi.motion import SPEED, Param, PhysicsTerm, Vector


def level(m: Vector, p: Vector, s: Vector) -> float:
    """Give T (1 - exp(-|v| / vs))."""
    return p[0] * (1.0 - math.exp(-min(abs(m[SPEED]) / p[1], 700.0)))


TERM = PhysicsTerm(
    name="shear_thinning_friction",
    component="friction",
    meaning="lubricant drag that levels off with speed",
    maintenance="check the grade and the age of the grease",
    place="dry",
    law=level,
    params=(
        Param(
            "torque_nm",
            "N m",
            "drag at speeds where the film yields",
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
            "speed at which all but 1/e of the drag has built up",
            start=0.005,
            low=1e-7,
            high=1e3,
            typical=0.005,
            trials=lambda s: [share * s.speed for share in (0.03, 0.08, 0.2)],
            # Below all speeds it would be Coulomb friction by another name, beyond them viscous friction.
            plausible=lambda s, speed: (0.025 * s.speed, 0.6 * s.speed),
        ),
    ),
    source="S. Bair and W. O. Winer, J. Lubr. Technol. 101 (1979) 258: τ = τ_L (1 - exp(-η γ̇ / τ_L)) in steady shear",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    sets_in="rarely",
    beside=("viscous_friction",),
)
