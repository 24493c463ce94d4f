"""Bristles: what yields like a spring before it slides, and remembers on its way where it turned.

Two laws are in use, which rise alike from rest, to 1 - e^-x, and part at the first reversal. Dahl's forgets: what
follows depends on how far it is stretched and which way it moves. Maxwell's elements in parallel, each a spring that
slips at its own stretch, remember every reversal until a larger loop wipes it out (Masing's rules): they leave a
reversal half as steeply, and a small loop within a large one closes.

References
----------
.. [1] P. R. Dahl, Aerospace Corp. TOR-0158(3107-18)-1 (1968): dF/dx = σ (1 - F/Fc sgn v)^i, here with i = 1.
.. [2] F. Al-Bender, V. Lampaert and J. Swevers, IEEE Trans. Autom. Control 50 (2005): nonlocal memory of presliding.
"""

import math
from typing import Literal

from gsfdi.motion import BEGUN, STATES, Law, Param, Vector

STRETCH, PLACE, ORIGIN, WAY, DEPTH, TURNS = 0, 1, 2, 3, 4, 5
"""States: stretch as a share of the full, and where it is; what remembers also keeps where it was at rest, which way it
went, how many reversals it remembers, and of each where that was and how far it was stretched there."""
FULLEST = 0.999
"""Share of the full stretch at which a bristle that remembers begins at most: it never is stretched in full."""
MOST = (STATES - TURNS) // 2
"""Reversals that it remembers at most: beyond them the smallest loop within all others is forgotten."""

MEMORY = Param(
    "nonlocal_memory",
    "1",
    "0: forgets where it turned (Dahl); 1: remembers every reversal (Maxwell's slip elements)",
    start=0.0,
    low=0.0,
    high=1.0,
    typical=1.0,
    kind="choice",
)


def bristle(place: int, jumped: int, shaped_by: Literal["stiffness", "width"]) -> Law:
    """Make the law of a bristle: parameters are its full torque, what shapes its rise from rest, and `MEMORY`.

    Parameters
    ----------
    place, jumped : int
        Places in the motion vector of what stretches it, and of what an observer has added to that.
    shaped_by : {'stiffness', 'width'}
        Whether the second parameter is the slope at rest, or the stretch at which 1 - 1/e of the torque is reached.
    """
    by_slope, most = shaped_by == "stiffness", MOST  # what a law encloses, numba's cache tells from what it once was
    fullest = FULLEST

    def torque(m: Vector, p: Vector, s: Vector) -> float:
        """Give the torque, exact over any one-way move."""
        here, remembers = m[place] - m[jumped], p[2] > 0.5
        width = max(p[0], 1e-12) / p[1] if by_slope else p[1]
        if math.isnan(s[STRETCH]):
            s[STRETCH], s[PLACE] = m[BEGUN], here
            if remembers:  # as if it had come there one way from rest
                gone = -width * math.log1p(-min(abs(m[BEGUN]), fullest))
                s[ORIGIN], s[WAY], s[DEPTH] = here - math.copysign(gone, m[BEGUN]), 0.0, 0.0
        move = here - s[PLACE]
        way = math.copysign(1.0, move)
        if move == 0.0:
            return p[0] * s[STRETCH]
        if not remembers:
            s[STRETCH], s[PLACE] = way + (s[STRETCH] - way) * math.exp(-min(abs(move) / width, 700.0)), here
            return p[0] * s[STRETCH]
        depth = int(s[DEPTH])
        if way * s[WAY] < 0.0:
            depth -= 2 if depth == most else 0
            s[TURNS + 2 * depth], s[TURNS + 2 * depth + 1] = s[PLACE], s[STRETCH]
            depth += 1
        while depth > 1 and way * (here - s[TURNS + 2 * depth - 4]) >= 0.0:
            depth -= 2  # a loop has closed, and what is within it is forgotten
        if depth == 1 and abs(here - s[ORIGIN]) >= abs(s[TURNS] - s[ORIGIN]):
            depth = 0  # farther from rest than ever
        if depth == 0:
            s[STRETCH] = -way * math.expm1(-abs(here - s[ORIGIN]) / width)
        else:
            turn = TURNS + 2 * depth - 2
            s[STRETCH] = s[turn + 1] - 2.0 * way * math.expm1(-0.5 * abs(here - s[turn]) / width)
        s[PLACE], s[WAY], s[DEPTH] = here, way, depth
        return p[0] * s[STRETCH]

    return torque
