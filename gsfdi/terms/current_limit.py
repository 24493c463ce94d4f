"""Current limit: the drive gives no more than so much current, and the controller does not know."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def current(m: Vector, p: Vector, s: Vector) -> float:
    """Give the commanded current, clipped to plus and minus the limit."""
    return min(max(m[VALUE], -p[0]), p[0])


TERM = PhysicsTerm(
    name="current_limit",
    component="motor",
    meaning="the drive clips its current",
    maintenance="check the drive's limit setting, its supply and its temperature derating",
    place="current",
    law=current,
    params=(
        Param(
            "limit_a",
            "A",
            "greatest current",
            start=10.0,
            low=0.0,
            high=1e6,
            typical=10.0,
            trials=lambda s: (),  # it shows in the controller's law, not in the mechanics
        ),
    ),
    source="K. J. Åström and R. M. Murray, Feedback Systems (2008): saturation of an actuator, u = sat(v)",
    signature=("timing",),
)
