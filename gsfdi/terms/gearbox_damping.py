"""Gearbox damping: the spring loses energy as it winds."""

from gsfdi.motion import WINDUP_RATE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give d times the rate of the wind-up."""
    return p[0] * m[WINDUP_RATE]


TERM = PhysicsTerm(
    name="gearbox_damping",
    component="gearbox",
    meaning="the gearbox damps its own oscillation",
    maintenance="none by itself; a rise points to wear or lubricant",
    place="spring",
    law=torque,
    params=(
        Param(
            "coefficient_nms_rad",
            "N m s/rad",
            "torque per rate of wind-up",
            start=100.0,
            low=0.0,
            high=1e6,
            typical=100.0,
            neutral=0.0,
            linear=True,
            plausible=lambda s, coefficient: (0.0, s.critical),
        ),
    ),
    source="M. W. Spong, J. Dyn. Syst. Meas. Control 109 (1987) 310: elastic joint, with a damper beside the spring",
    signature=("windup",),
    structures=("flexible",),
    dissipative=True,
    damping=lambda p: p[0],
    sets_in="rarely",
)
