"""What a drive does at every angle of a motion that a loop holds, and what asks for it.

A loop that holds its speed makes a motion that a drive which moves nothing predicts best, so that innovations tell
nothing: what a model lacks reaches the position only through the loop's own answer to it. But that answer is recorded.
At a crawl the inertia takes next to none of the effort, and the rest is what resists the motion, angle by angle. So it
is regressed on the few laws that a crawl can show, waves of every whole order among them.

Laws join greedily, the one that explains most of what is left first. Whether each is needed is decided once all are
there: what then remains is made white by an autoregression, under which each must gain its bar in log-likelihood, or
go. To whiten any earlier fails, for an autoregression takes over whatever wave has not been found yet. So does a speed
as it was moment by moment in the place of that of a whole turn: it wavers with the waves, and stands in for them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from gsfdi.reconcile.crawl import MEMORY, Crawl, Rows
from gsfdi.reconcile.offering import SIMULATED
from gsfdi.reconcile.resistance import Law
from gsfdi.reconcile.screen import LEAST
from gsfdi.types import Array, Mask

MOST = 12
"""Laws that may act at once."""
AS_MUCH = 0.95
"""Share of what the best law explains from which a likelier one comes first."""
GONE = 0.1
"""Share of itself below which too little is left of a law beside others: over less than a turn waves are hardly two."""
ONE = 0.98
"""Cosine of the angle between two laws from which nothing but slow noise could part them."""


@dataclass(frozen=True, slots=True)
class Part:
    """A law that was found: its coefficients ``(k,)``, their covariance, what it gains, and terms that do as well."""

    law: Law
    coefficients: Array
    spread: Array
    gain: float
    alike: tuple[str, ...] = ()

    def torque(self, crawl: Crawl) -> Array:
        """Torque with which it resists a motion [N m]."""
        return np.asarray(self.law.columns(crawl) @ self.coefficients)

    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals of its numbers, by name; none for the order of a wave, which was taken to be whole."""
        x, small, values = self.coefficients, 1e-4, self.law.values(self.coefficients)
        spread = self.spread + (SIMULATED * np.linalg.norm(x)) ** 2 * np.eye(len(x))
        sd = np.sqrt(np.diag(spread))
        here = np.array(list(values.values()))
        moved = [list(self.law.values(x + small * step).values()) for step in np.diag(sd)]
        slopes = (np.array(moved) - here) / small
        widths = 1.96 * np.sqrt(np.einsum("ki,kl,li->i", slopes, spread / np.outer(sd, sd), slopes))
        rows = zip(values, here, widths, strict=True)
        return {name: (float(at - width), float(at + width)) for name, at, width in rows if width > 0}


@dataclass(frozen=True, slots=True)
class Balance:
    """What came of the `rows` of motions under some `laws`: those that act, the one that gains most first.

    `lost` are those that gain too little.
    """

    rows: Rows
    laws: Sequence[Law]
    parts: tuple[Part, ...] = ()
    lost: tuple[tuple[Law, float], ...] = ()

    @property
    def left(self) -> float:
        """Torque that is left where something may be told [N m, root mean square]."""
        torque = self.rows.of(lambda crawl: crawl.torque - sum(part.torque(crawl) for part in self.parts))
        return float(np.sqrt(np.mean(torque[self.rows.told] ** 2)))

    @property
    def surest(self) -> float:
        """The most log-likelihood that any gains."""
        return max([0.0, *(part.gain for part in self.parts), *(gain for _, gain in self.lost)])


def balanced(rows: Rows, laws: Sequence[Law], least: float) -> Balance:
    """Find the laws that act, with a torque of no less than `least` [N m, root mean square]."""
    torque, columns = rows.of(lambda crawl: crawl.torque), [rows.of(law.columns) for law in laws]
    told, settled = rows.told, rows.settled
    chosen, lost = greedily(torque[told], [c[told] for c in columns], laws), list[tuple[Law, float]]()
    while chosen:
        fit = fitted(torque, [columns[k] for k in chosen], settled)
        gains = [fit.gain(i, laws[k]) for i, k in enumerate(chosen)]
        sizes = [float(np.sqrt(np.mean((columns[k][told] @ fit.told(i)[0]) ** 2))) for i, k in enumerate(chosen)]
        worth = [gain if size > least else min(gain, 0.0) for gain, size in zip(gains, sizes, strict=True)]
        worst = int(np.argmin(worth))
        if worth[worst] >= LEAST:
            return Balance(rows, laws, parts_of(fit, chosen, laws, columns), tuple(lost))
        lost.insert(0, (laws[chosen.pop(worst)], gains[worst]))
    return Balance(rows, laws, lost=tuple(lost))


def least_seen(rows: Rows, laws: Sequence[Law]) -> dict[str, tuple[str, float]]:
    """Tell how much of every term would just have been found: its first number, by term."""
    torque, settled, found = rows.of(lambda crawl: crawl.torque), rows.settled, dict[str, tuple[str, float]]()
    for law in laws:
        _, spread = fitted(torque, [rows.of(law.columns)], settled).told(0)
        size = np.sqrt(2 * LEAST * np.linalg.eigvalsh(spread)[-1]) * np.eye(len(spread))[0]
        (name, value), *_ = law.values(size).items()
        if law.possible(size):
            found[law.term] = min(found.get(law.term, (name, np.inf)), (name, value), key=lambda pair: pair[1])
    return found


def parts_of(fit: "Fit", chosen: Sequence[int], laws: Sequence[Law], columns: Sequence[Array]) -> tuple[Part, ...]:
    """Lay out the laws of a fit."""
    parts = [
        Part(laws[k], *fit.told(i), fit.gain(i, laws[k]), alike(fit, i, k, laws, columns)) for i, k in enumerate(chosen)
    ]
    return tuple(sorted(parts, key=lambda part: -part.gain))


def greedily(torque: Array, columns: Sequence[Array], laws: Sequence[Law]) -> list[int]:
    """Take up to `MOST` laws, each time the one that explains most of what is left of `torque`."""
    left, bare, chosen = torque, list(columns), list[int]()
    for _ in range(MOST):
        gains = [_explained(left, c, whole, law) for c, whole, law in zip(bare, columns, laws, strict=True)]
        if not max(gains) > 0.0:
            break
        best = next(k for k, gain in enumerate(gains) if gain >= AS_MUCH * max(gains))
        chosen.append(best)
        basis = np.linalg.qr(bare[best])[0]
        left = left - basis @ (basis.T @ left)
        bare = [c - basis @ (basis.T @ c) for c in bare]
    return chosen


def _explained(left: Array, bare: Array, whole: Array, law: Law) -> float:
    """Sum of squares of what is left that a law's columns explain, less those that have been taken.

    Rows that are fewer than a law's columns tell nothing.
    """
    if len(bare) < bare.shape[1] or float(np.sum(bare**2)) < GONE * float(np.sum(whole**2)):
        return 0.0
    basis, triangle = np.linalg.qr(bare)
    told = basis.T @ left
    return float(told @ told) if law.possible(np.linalg.solve(triangle, told)) else 0.0


def alike(fit: "Fit", place: int, own: int, laws: Sequence[Law], columns: Sequence[Array]) -> tuple[str, ...]:
    """Name terms that do as well in the place of one: a wave of its order, or another law that is none."""

    def does_as_well(k: int) -> bool:
        loss = fit.loss(place, columns[k], laws[k])
        return loss < LEAST or (loss < np.inf and are_one(columns[own], columns[k]))

    like = [k for k, law in enumerate(laws) if k != own and law.order == laws[own].order]
    return tuple(laws[k].term for k in like if does_as_well(k))


def are_one(columns: Array, others: Array) -> bool:
    """Whether columns of two laws span nearly the same."""
    if columns.shape != others.shape:
        return False
    cosines = np.linalg.svd(np.linalg.qr(columns)[0].T @ np.linalg.qr(others)[0], compute_uv=False)
    return bool(cosines.min() > ONE)


@dataclass(frozen=True, slots=True)
class Fit:
    """A regression under noise that hangs together.

    `taps` make that noise white, `rows` are those that count, `white` the columns of each law and `target` the torque
    as they are then; `coefficients` ``(m,)`` and `spread` ``(m, m)`` are of all laws, one after another.
    """

    taps: Array
    rows: Mask
    white: list[Array]
    target: Array
    coefficients: Array
    spread: Array
    power: float

    def told(self, place: int) -> tuple[Array, Array]:
        """Coefficients of one law and their covariance."""
        first = sum(c.shape[1] for c in self.white[:place])
        own = slice(first, first + self.white[place].shape[1])
        return self.coefficients[own], self.spread[own, own]

    def gain(self, place: int, law: Law) -> float:
        """Log-likelihood that goes with one law."""
        own, spread = self.told(place)
        return float(0.5 * own @ np.linalg.solve(spread, own)) if law.possible(own) else 0.0

    def loss(self, place: int, columns: Array, law: Law) -> float:
        """Log-likelihood that is lost with the columns of another law in the place of one."""
        white = [*self.white[:place], whitened(columns, self.taps)[self.rows], *self.white[place + 1 :]]
        design = np.hstack(white)
        found = np.linalg.lstsq(design, self.target, rcond=None)[0].astype(np.float64)
        first = sum(c.shape[1] for c in white[:place])
        if not law.possible(found[first : first + columns.shape[1]]):
            return np.inf
        return 0.5 * (float(np.sum((self.target - design @ found) ** 2)) / self.power - len(self.target))


def fitted(torque: Array, columns: Sequence[Array], rows: Mask) -> Fit:
    """Regress `torque` on `columns` of several laws, over the `rows` that count."""
    design = np.hstack(columns)
    left = torque - design @ np.linalg.lstsq(design[rows], torque[rows], rcond=None)[0]
    now = np.flatnonzero(rows)
    lags = np.column_stack([left[now - k] for k in range(1, MEMORY + 1)])
    taps = np.concatenate([[1.0], -np.linalg.lstsq(lags, left[now], rcond=None)[0]])
    white = [whitened(c, taps)[rows] for c in columns]
    X, y = np.hstack(white), whitened(torque, taps)[rows]
    found = np.linalg.lstsq(X, y, rcond=None)[0].astype(np.float64)
    power = float(np.mean((y - X @ found) ** 2))
    return Fit(taps, rows, white, y, found, np.asarray(power * np.linalg.pinv(X.T @ X)), power)


def whitened(values: Array, taps: Array) -> Array:
    """Values less what those just before say of them."""
    return np.asarray(lfilter(taps, [1.0], values, axis=0))
