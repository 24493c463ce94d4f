"""How much the innovations look like each direction of the fault library."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gsfdi.directions import Direction, grouped
from gsfdi.joint import hold_direction, matrices, relative_directions
from gsfdi.nominal.description import Nominal
from gsfdi.nominal.observing import TORQUES
from gsfdi.nominal.watching import Watched
from gsfdi.observer import Filter, scores
from gsfdi.types import Array


class Entries(NamedTuple):
    """How each direction enters the discrete model; exact ones come first."""

    exact: Array
    exact_u: Array
    early: Array
    late: Array
    sensed: Array


def entries(nominal: Nominal, run: Filter, directions: Sequence[Direction]) -> Entries:
    """Columns by which the directions act on the observer's model."""
    joint, nx, p = matrices(nominal.plant), len(run.Ad), len(run.C)
    early, late, sensed = (np.zeros((len(directions), size)) for size in (nx, nx, p))
    changes = relative_directions(nominal.plant)
    exact = []
    for j, one in enumerate(directions):
        if one.enters == "exact":
            dA, dB = changes[one.key]
            exact.append(hold_direction(joint.A, joint.effort[:, None], dA, dB[:, None], nominal.step))
        elif one.enters in TORQUES:
            column = TORQUES[one.enters]
            early[j], late[j] = run.Bt0[:, column], run.Bt1[:, column]
        else:
            sensed[j, 0 if one.enters == "position" else p - 1] = 1.0
    L = np.array([a for a, _ in exact]).reshape(-1, nx, nx)
    Lu = np.array([b[:, 0] for _, b in exact]).reshape(-1, nx)
    return Entries(L, Lu, early, late, sensed)


class Scored(NamedTuple):
    """Scores ``g``, information ``h`` and ``x`` with the mate by bin; joint information ``H``; energy by bin."""

    g: Array
    h: Array
    x: Array
    H: Array
    energy: Array


def score(
    run: Filter,
    entry: Entries,
    watched: Watched,
    directions: Sequence[Direction],
    bins: npt.NDArray[np.int64],
    count: int,
) -> Scored:
    """Score every direction on a watched stretch, in bins of time."""
    size = np.zeros((len(watched.u), len(directions)))
    for j, one in enumerate(directions):
        if one.shape is not None:
            size[:, j] = one.shape(watched.moving)
    e = np.where(np.isfinite(watched.e), watched.e, 0.0)
    mate = np.full(len(directions), -1, dtype=np.int64)
    for _, members in grouped(directions):
        if len(members) == 2:
            mate[members] = members[::-1]
    return Scored(
        *scores(run.Ad, run.C, run.gains, run.weight, e, watched.used, watched.live, bins, count, *entry[:2],
                watched.states, watched.u, *entry[2:], size, mate)
    )  # fmt: skip
