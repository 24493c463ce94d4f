"""Temperature-dependent viscous friction: cold lubricant is stiff."""

import math

from gsfdi.motion import REFERENCE_TEMPERATURE, SPEED, TEMPERATURE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give b max(0, 1 + x) or b exp(x) times speed, with x = k (T - 20 degC)."""
    x = p[1] * (m[TEMPERATURE] - REFERENCE_TEMPERATURE)
    share = math.exp(min(x, 700.0)) if p[2] > 0.5 else max(0.0, 1.0 + x)
    return p[0] * share * m[SPEED]


TERM = PhysicsTerm(
    name="temperature_dependent_friction",
    component="friction",
    meaning="viscous friction changes with temperature",
    maintenance="warm up before precise motion; choose a lubricant for the temperature range",
    place="torque",
    law=torque,
    params=(
        Param(
            "coefficient_nms_rad",
            "N m s/rad",
            "viscous coefficient at 20 degC",
            start=20.0,
            low=0.0,
            high=1e6,
            typical=20.0,
            neutral=0.0,
            linear=True,
        ),
        Param(
            "per_degc",
            "1/K",
            "relative change of the coefficient per degree",
            start=-0.02,
            low=-0.2,
            high=0.2,
            typical=0.02,
            neutral=0.0,
            kind="arm",
            trials=lambda s: (-0.03, 0.01) if s.warms else (),
            step=lambda s: 0.02,
        ),
        Param(
            "exponential",
            "1",
            "0: in proportion to the temperature; 1: as its exponential",
            start=0.0,
            low=0.0,
            high=1.0,
            typical=1.0,
            kind="choice",
        ),
    ),
    source="A. C. Bittencourt and S. Gunnarsson, J. Dyn. Syst. Meas. Control 134 (2012) 051013, whose exponential "
    "is as good as a straight line over a few degrees",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    damping=lambda p: 4.0 * p[0],
    sets_in="never",
)
