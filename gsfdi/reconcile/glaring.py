"""Effects as large as the drive's torque: finalists looked for by size, beside the nominal numbers.

Slopes lead nowhere near such an effect. What the model lacks has pushed its numbers to their ends, and the observer of
a joint without a friction that brakes it within two samples is another than that of the joint with it: under white
innovations a viscous friction of the drive's torque gained 57 by regression, and cost more at every size on the way to
where it gained 13,000. The power of the speed's innovations as they are falls all the way. It takes seconds, so it is
left for where the finalists of the regression leave something.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.fit import turned
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.hand import Round, is_sensor, with_term
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.reconcile.screen import Entry, Screening, within
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.registry import shelf

GLARING = 0.2
"""Share of the drive's torque from which what is missing may be too large for slopes."""
SIZES = tuple(sign * 2.0**power for sign in (1, -1) for power in range(2, 6))
"""Sizes tried, in those that regression tries."""
FINER = (2.0**0.5, 2.0**0.25, 2.0**0.125)
"""Factors by which the best of them are then tried to be larger or smaller."""
SHAPES = 3
"""Shapes of a term that are tried, for regression is no better at these."""
CLOSEST, ROUNDS = 6, 9
"""Terms that are looked at more closely and fitted, those of the least power, and in how many rounds."""


@dataclass(frozen=True, slots=True)
class Trial:
    """An offer's term as it was tried, and logarithms of the power that it leaves of either innovation, added up."""

    left: float
    use: TermUse
    entry: Entry


def glares(hand: Round) -> bool:
    """Whether so much is missing that slopes may not reach what it is."""
    return float(np.linalg.norm(hand.torque)) > GLARING * hand.stand.scales.torque


def glaring(hand: Round, screening: Screening) -> list[Entry]:
    """Finalists of a mismatch that is too large for slopes (see `glares`), fitted from the nominal numbers on.

    Parameters
    ----------
    hand : Round
        The model in hand.
    screening : Screening
        Of every offer, by regression: of those that differ in shape the one that promised most is tried.
    """
    fitted = hand.fitted
    believed = [v if k.prior is None else k.prior for k, v in zip(fitted.knobs, fitted.values, strict=True)]
    nominal = turned(fitted.model, fitted.knobs, np.array(believed))
    tried = list[Trial]()
    for entry in shapes(screening):
        columns = np.eye(len(entry.offer.columns))
        values = [entry.offer.mix(size * column) for column in columns for size in SIZES]
        if possible := [one for one in values if one is not None]:
            tried.append(best_of(hand, nominal, entry, possible))
    found = dict[tuple[str, str | None], Trial]()
    for trial in sorted(tried, key=lambda trial: trial.left):
        found.setdefault((trial.use.term, trial.use.side), trial)
    return [fitted_from(hand, nominal, closer(hand, nominal, trial)) for trial in list(found.values())[:CLOSEST]]


def shapes(screening: Screening) -> list[Entry]:
    """What may act on the joint from the start: of each term and side the shapes that promised most."""
    found = defaultdict[tuple[str, str | None], list[Entry]](list)
    for entry in sorted(screening.entries, key=lambda e: -e.linear):
        if entry.onset is None and not is_sensor(entry.offer.term):
            found[entry.offer.term, entry.offer.side].append(entry)
    return [entry for entries in found.values() for entry in entries[:SHAPES]]


def best_of(hand: Round, nominal: JointModel, entry: Entry, values: Sequence[Mapping[str, float]]) -> Trial:
    """Of some values of a term the likeliest beside the nominal numbers, innovations being white and of any power."""
    uses = [entry.offer.use(within(entry.offer.term, one)) for one in values]
    parts = hand.stand.innovations([with_term(nominal, use) for use in uses])
    shown = np.concatenate(parts, axis=1)[..., list(hand.stand.system.rows)]
    left = np.sum(np.log(np.nanmean(shown**2, axis=1)), axis=1)
    best = int(np.argmin(left))
    return Trial(float(left[best]), uses[best], entry)


def closer(hand: Round, nominal: JointModel, trial: Trial) -> Trial:
    """Make each number of a trial that is no place and no phase larger or smaller, less and less, while that helps."""
    term = shelf("gsfdi.terms", PhysicsTerm)[trial.use.term]
    names = [p.name for p in term.numbers if p.low >= 0.0 and p is not term.order and p.name in trial.use.values]
    for factor in FINER:
        for name in names:
            here = trial.use.values[name]
            values = [{**trial.use.values, name: here * by} for by in (factor, 1.0 / factor)]
            trial = min(trial, best_of(hand, nominal, trial.entry, values), key=lambda one: one.left)
    return trial


def fitted_from(hand: Round, nominal: JointModel, trial: Trial) -> Entry:
    """Fit a trial beside the nominal numbers."""
    model = with_term(nominal, trial.use)
    knobs = [*hand.fitted.knobs, *term_knobs(hand.stand, model, len(model.physics) - 1)]
    fitted = fit_knobs(hand.misfit, model, knobs, ROUNDS)
    return replace(trial.entry, fitted=fitted, gain=hand.fitted.cost - fitted.cost)
