"""Backlash: within the play of the teeth no torque passes."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def deflection(m: Vector, p: Vector, s: Vector) -> float:
    """Give the difference of angles less the play: zero within it."""
    return m[VALUE] - min(max(m[VALUE], -p[0]), p[0])


TERM = PhysicsTerm(
    name="backlash",
    component="gearbox",
    meaning="play in the gearbox",
    maintenance="plan the adjustment or replacement of the gearbox",
    place="windup",
    law=deflection,
    params=(
        Param(
            "half_width_rad",
            "rad",
            "half of the play, at the output",
            start=1e-3,
            low=0.0,
            high=1.0,
            typical=1e-3,
            neutral=0.0,
            trials=lambda s: [share * s.windup for share in (0.02, 0.1, 0.4, 1.0, 5.0)],
            plausible=lambda s, width: (0.0, min(100 * s.windup, s.reach)),
        ),
    ),
    source="M. Nordin and P.-O. Gutman, Automatica 38 (2002) 1633: dead zone T = c D(ε)",
    signature=("windup",),
    structures=("flexible",),
)
