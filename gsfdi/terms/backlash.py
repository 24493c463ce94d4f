"""Backlash: within the play of the teeth no torque passes."""

from gsfdi.motion import VALUE, WINDUP_RATE, Param, PhysicsTerm, Vector


def deflection(m: Vector, p: Vector, s: Vector) -> float:
    """Give the difference of angles less the play, δ: zero within it, δ (1 + λ d|δ|/dt) where flanks lose energy."""
    bend = m[VALUE] - min(max(m[VALUE], -p[0]), p[0])
    closing = m[WINDUP_RATE] if bend > 0.0 else -m[WINDUP_RATE]
    return bend * max(1.0 + p[1] * closing, 0.0)  # flanks push, and never pull


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
        Param(
            "loss_s_rad",
            "s/rad",
            "energy that the flanks lose, as damping in proportion to their deflection",
            start=0.0,
            low=0.0,
            high=1e7,
            typical=100.0,
            kind="detail",
            trials=lambda s: [share * s.critical / s.torque for share in (0.03, 0.1, 0.3, 1.0)],
        ),
    ),
    source="M. Nordin and P.-O. Gutman, Automatica 38 (2002) 1633: dead zone T = c D(ε); "
    "K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440: T = k δ (1 + λ dδ/dt)",
    signature=("windup",),
    structures=("flexible",),
)
