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
from gsfdi.observer import LANES, THIN, Filter, padded, scores
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
    n, m, q = len(watched.u), len(directions), len(entry.exact)
    size = np.zeros((LANES, n))
    for row, one in zip(size, directions, strict=False):
        if one.shape is not None:
            row[:] = one.shape(watched.moving)
    e = np.where(np.isfinite(watched.e), watched.e, 0.0)
    lanes = np.concatenate([padded(entry.early.T, 4, LANES), padded(entry.late.T, 4, LANES),
                            padded(entry.sensed.T, 2, LANES)])  # fmt: skip
    # The observer starts from the first values measured, so that what is wrong with them is no news from then on.
    start = np.zeros((4, LANES))
    for i in range(len(run.C)):
        start[i, :m] = -entry.sensed[:, i] * size[:m, 0] / run.C[i, i]
    pairs = np.array([members for _, members in grouped(directions) if len(members) == 2], dtype=np.int64)
    g, h, shared, shown = scores(
        padded(run.Ad, 4, 4), padded(run.C, 2, 4), padded(run.gains, len(run.gains), 4, 2), padded(run.weight, 2, 2),
        padded(e, n, 2), watched.used, watched.live, watched.age, bins, count, padded(entry.exact, q, 4, 4),
        padded(entry.exact_u, q, 4), padded(watched.states, n, 4), watched.u, lanes.ravel(),
        start.ravel(), np.ascontiguousarray(size.T), pairs.reshape(-1, 2),
    )  # fmt: skip
    x = np.zeros((count, m))
    for column, pair in zip(shared.T, pairs, strict=True):
        x[:, pair] = column[:, None]
    seen = [np.ascontiguousarray(shown[:, i, :m]) for i in range(len(run.C))]
    H = THIN * sum(run.weight[i, j] * (a.T @ b) for i, a in enumerate(seen) for j, b in enumerate(seen))
    energy = np.zeros((count, 2))
    on = watched.live * watched.used
    energy[:, 0] = np.bincount(bins, on * np.einsum("ki,ki->k", e @ run.weight, e), minlength=count)
    energy[:, 1] = np.bincount(bins, on, minlength=count)
    return Scored(g[:, :m], h[:, :m], x, H, energy)
