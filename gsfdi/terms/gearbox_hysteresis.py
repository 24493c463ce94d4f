"""Gearbox hysteresis: the wind-up curve opens into a loop on load reversal."""

import math

from gsfdi.motion import WINDUP, WINDUP_JUMPED, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give T z with dz/dε = (1 - z sgn dε) / width, solved exactly over each move."""
    windup = m[WINDUP] - m[WINDUP_JUMPED]
    if math.isnan(s[0]):
        s[0], s[1] = 0.0, windup
    move = (windup - s[1]) / p[1]
    s[1] = windup
    toward = 1.0 if move > 0.0 else -1.0
    s[0] = toward + (s[0] - toward) * math.exp(-min(abs(move), 700.0))
    return p[0] * s[0]


TERM = PhysicsTerm(
    name="gearbox_hysteresis",
    component="gearbox",
    meaning="wind-up depends on the direction of loading",
    maintenance="inspect the gearbox for wear of its flexspline or teeth",
    place="spring",
    law=torque,
    params=(
        Param(
            "torque_nm",
            "N m",
            "half height of the loop",
            start=5.0,
            low=0.0,
            high=1e5,
            typical=5.0,
            neutral=0.0,
            plausible=lambda s, torque: (0.0, 3.0 * s.torque),
        ),
        Param(
            "width_rad",
            "rad",
            "wind-up over which the loop closes to 1/e",
            start=1e-4,
            low=1e-8,
            high=1.0,
            typical=1e-4,
            trials=lambda s: [share * s.windup for share in (0.1, 0.3, 1.0)],
            plausible=lambda s, width: (0.02 * s.windup, 3.0 * s.windup),
        ),
    ),
    source="R. Dhaouadi, F. H. Ghorbel and P. S. Gandhi, IEEE Trans. Ind. Electron. 50 (2003); the loop is Dahl's",
    signature=("windup",),
    structures=("flexible",),
    dissipative=True,
    memory=True,
    stiffness=lambda p: p[0] / p[1],
    sets_in="rarely",
)
