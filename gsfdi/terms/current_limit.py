"""Current limit: the drive gives no more than so much current, and the controller does not know."""

from gsfdi.motion import VALUE, Param, PhysicsTerm
from gsfdi.types import Array


def current(m: Array, p: Array, s: Array) -> float:
    """Give the commanded current, clipped to plus and minus the limit."""
    return min(max(m[VALUE], -p[0]), p[0])


TERM = PhysicsTerm(
    name="current_limit",
    component="motor",
    meaning="the drive clips its current",
    maintenance="check the drive's limit setting, its supply and its temperature derating",
    place="current",
    law=current,
    params=(Param("limit_a", "A", "greatest current", start=10.0, low=0.0, high=1e6, typical=10.0),),
    source="saturation of an actuator, K. J. Åström and R. M. Murray, Feedback Systems (2008), eq. 10.1",
    signature=("timing",),
)
