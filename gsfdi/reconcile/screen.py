"""Every offer against what is left: by linear regression for all of them, by replay for the best."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.fit import Fitted, Knob
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import Round, orthonormal, term_knobs, with_term
from gsfdi.reconcile.offer import Offer
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.registry import shelf
from gsfdi.types import Array

ONSETS = 10
ONSET_COST = 5.0
"""Log-likelihood that an onset must gain beyond the same term from the start."""


@dataclass(frozen=True, slots=True)
class Entry:
    """How one offer did in one round.

    `gain` is what it adds to the log-likelihood: `linear` by regression, then by replay if it came to that.
    """

    offer: Offer
    onset: float | None
    coefficients: Array
    linear: float
    gain: float = float("nan")
    fitted: Fitted | None = None


@dataclass(frozen=True, slots=True)
class Screening:
    """One round's entries, best first, and the signatures they were read from."""

    entries: tuple[Entry, ...]
    bare: Array
    """(columns, rows) signatures less what the knobs in hand could take over."""
    information: Array


def screen(hand: Round, candidates: Sequence[Offer]) -> Screening:
    """Regress what is left on every offer's signature, for every onset."""
    stand, model = hand.stand, hand.fitted.model
    tried = [with_term(model, offer.use(values)) for offer in candidates for values in offer.columns]
    moved = stand.innovations(tried)
    signatures = stand.white([m - e for m, e in zip(moved, hand.innovations, strict=True)], hand.tools)
    signatures[~(np.abs(signatures).max(axis=1) < 1e6)] = 0.0
    J = orthonormal(hand)
    r = hand.fitted.residual
    left, times = J.T @ r, stand_times(stand)
    onsets = list(np.linspace(0, stand.scales.seconds, ONSETS + 2)[1:-1]) if stand.count == 1 else []
    best: dict[int, Entry] = {}
    first = np.cumsum([0, *(len(offer.columns) for offer in candidates)])
    for onset in (None, *onsets):
        part = slice(None) if onset is None else times >= onset
        seen = signatures[:, part]
        cross = seen @ J[part]
        score = seen @ r[part] - cross @ left
        for i, offer in enumerate(candidates):
            if not (may_set_in(offer) if onset is not None else may_always_be(offer)):
                continue
            rows = slice(first[i], first[i + 1])
            own = seen[rows] @ seen[rows].T
            entry = _entry(offer, onset, own - cross[rows] @ cross[rows].T, -score[rows], own)
            if entry is not None and (
                i not in best or entry.linear > best[i].linear + (ONSET_COST if best[i].onset is None else 0)
            ):
                best[i] = entry
    bare = signatures - (signatures @ J) @ J.T
    ranked = tuple(sorted(best.values(), key=lambda entry: -entry.linear))
    return Screening(ranked, bare, np.sum(bare**2, axis=1))


def may_set_in(offer: Offer) -> bool:
    """Whether the term may begin during a recording: not if it says itself when it does."""
    return "onset_s" not in offer.columns[0]


def may_always_be(offer: Offer) -> bool:
    """Whether the term can be seen if it was there all along: a constant offset of the position cannot."""
    return offer.term != "position_bias"


def _entry(offer: Offer, onset: float | None, info: Array, score: Array, own: Array) -> Entry | None:
    if np.any(np.diag(info) < 1e-6 * np.diag(own) + 1e-12):
        return None
    c = np.asarray(np.linalg.solve(info + 1e-9 * np.diag(np.diag(info)), score), dtype=np.float64)
    if offer.mix(c) is None:
        return None
    return Entry(offer, onset, c, float(0.5 * score @ c))


def stand_times(stand: Bench) -> Array:
    """Time of every white innovation."""
    return np.concatenate([np.repeat(r.t, len(stand.system.rows)) for r in stand.records])


def refit(hand: Round, entry: Entry, rounds: int = 3) -> Entry:
    """Fit an entry's term by replay together with everything in hand."""
    values = entry.offer.mix(entry.coefficients)
    if values is None:
        return entry
    values = within(entry.offer.term, values)
    model = with_term(hand.fitted.model, entry.offer.use(values, entry.onset))
    place = len(model.physics) - 1
    knobs = [*hand.fitted.knobs, *term_knobs(hand.stand, model, place)]
    known = hand.fitted.jacobian
    fitted = fit_knobs(hand.misfit, model, knobs, rounds, known)
    if entry.onset is not None:
        fitted = refined_onset(hand, fitted, place, hand.stand.scales.seconds / (ONSETS + 1))
    return replace(entry, onset=fitted.model.physics[place].onset, fitted=fitted, gain=hand.fitted.cost - fitted.cost)


def refined_onset(hand: Round, fitted: Fitted, place: int, width: float) -> Fitted:
    """Move the onset of the term at `place` to where it fits best; slopes cannot, for it moves by whole samples."""
    knob = Knob(place, "onset", 1.0, 0.0, 0.99 * hand.stand.scales.seconds)
    for _ in range(3):
        start = knob.read(fitted.model)
        models = [knob.turn(fitted.model, start + step * width) for step in np.linspace(-1, 1, 9)]
        costs = 0.5 * np.sum(hand.misfit(models) ** 2, axis=1)
        model = models[int(np.nanargmin(costs))]
        width /= 4.0
        fitted = fit_knobs(hand.misfit, model, fitted.knobs, 1, hand.fitted.jacobian)
    return fit_knobs(hand.misfit, fitted.model, fitted.knobs, 2, hand.fitted.jacobian)


def within(term: str, values: Mapping[str, float]) -> dict[str, float]:
    """`values` brought within the shelf's bounds."""
    shape = shelf("gsfdi.terms", PhysicsTerm)[term]
    return {
        name: float(np.clip(value, shape.param(name).low, shape.param(name).high)) for name, value in values.items()
    }
