"""Temperature-dependent viscous friction: cold lubricant is stiff."""

from gsfdi.motion import REFERENCE_TEMPERATURE, SPEED, TEMPERATURE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give b max(0, 1 + k (T - 20 degC)) times speed."""
    return p[0] * max(0.0, 1.0 + p[1] * (m[TEMPERATURE] - REFERENCE_TEMPERATURE)) * m[SPEED]


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
            kind="arm",
            trials=lambda s: (-0.03, 0.01) if s.warms else (),
            step=lambda s: 0.02,
        ),
    ),
    source="A. C. Bittencourt and S. Gunnarsson, J. Dyn. Syst. Meas. Control 134 (2012) 051013, to first order in T",
    signature=("balance",),
    sides=("motor", "output"),
    dissipative=True,
    damping=lambda p: 4.0 * p[0],
    sets_in="never",
)
