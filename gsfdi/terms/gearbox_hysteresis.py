"""Gearbox hysteresis: the wind-up curve opens into a loop on load reversal."""

from gsfdi.bristle import MEMORY, bristle
from gsfdi.motion import WINDUP, WINDUP_JUMPED, Param, PhysicsTerm

TERM = PhysicsTerm(
    name="gearbox_hysteresis",
    component="gearbox",
    meaning="wind-up depends on the direction of loading",
    maintenance="inspect the gearbox for wear of its flexspline or teeth",
    place="spring",
    law=bristle(WINDUP, WINDUP_JUMPED, "width"),
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
            "wind-up over which it rises from rest to 1 - 1/e of the height",
            start=1e-4,
            low=1e-8,
            high=1.0,
            typical=1e-4,
            trials=lambda s: [share * s.windup for share in (0.1, 0.3, 1.0)],
            plausible=lambda s, width: (0.02 * s.windup, 3.0 * s.windup),
        ),
        MEMORY,
    ),
    source="R. Dhaouadi, F. H. Ghorbel and P. S. Gandhi, IEEE Trans. Ind. Electron. 50 (2003), with Dahl's loop",
    signature=("windup",),
    structures=("flexible",),
    dissipative=True,
    memory=True,
    stiffness=lambda p: p[0] / p[1],
    sets_in="rarely",
)
