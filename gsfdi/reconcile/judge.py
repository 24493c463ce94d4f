"""From a contest to names: rivals under the final noise model, probabilities, shares, intervals, and the remainder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.fit import Fitted
from gsfdi.model import TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.contest import Contest
from gsfdi.reconcile.contract import LATE
from gsfdi.reconcile.dating import dated
from gsfdi.reconcile.doubted import freed
from gsfdi.reconcile.forms import unrefined
from gsfdi.reconcile.hand import Round, around, is_sensor, missing
from gsfdi.reconcile.knobs import plausible
from gsfdi.reconcile.offering import SIMULATED
from gsfdi.reconcile.regauge import regauged
from gsfdi.reconcile.rivals import DRY, rivals
from gsfdi.reconcile.screen import LEAST
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.reconcile.simpler import fewer, there_all_along, without
from gsfdi.reconcile.ticks import CLOCKS, READ, unshifted
from gsfdi.reconcile.trifles import TRIVIAL, pruned
from gsfdi.reconcile.turning import fit_knobs, nearing, spread_of
from gsfdi.registry import shelf
from gsfdi.types import Array

ELSE = 0.023
"""Probability that it is none of those that were weighed, of which no likelihood knows.

Of 741 names that were left no rival in three sealed sets 17 were no true ones.
"""
UNLIKELY = {"sensor": 0.3}
"""Prior odds by component, against the rest: a sensor fails more rarely than it is blamed."""
SUDDENLY = {"output_inertia_change": 0.5, "motor_inertia_change": 0.05}
"""Prior odds of setting in within a recording: a load is taken up between motions, as a rule; a rotor stays."""
PER_NUMBER = 0.6
"""Prior odds of each number that a term has: where the data cannot decide, the simpler name comes first."""
ALIKE = 3e-5
"""Share of a term's gain by which two may differ through how sensors and steps are written rather than in fact."""
TWINS = {"position_gain", "velocity_gain"}
"""What parts them is how sensors are written: too long an angle and too slow a speed differ by a scale of all."""
UNFELT = 0.1
"""Travel of a usual sample, as a share, in which a bristle that is not felt has bent."""
WITHIN = 4.0
"""Log-likelihood that a number within its interval costs at most; of two that stand for one another, one is needed."""
NEAR = 1000.0
"""Log-likelihood within which a model without a term may catch up when it is fitted further."""
RUINED = 2.0
"""Times the cost of the model in hand from which a rival is worse in fact, whatever the term gains: without it a model
may run away, which costs any amount."""
CLOSE = 0.01
"""Probability, as a share of the best, from which a rival counts as not told apart.

The truth is to be among these in 99 of 100. A drag that hangs on the temperature lay at 0.02 of a plain one.
"""


@dataclass(frozen=True, slots=True)
class Rival:
    """Another term in the place of one that won: what it says of itself, and its merit beside the winner's."""

    use: TermUse
    merit: float
    probability: float


@dataclass(frozen=True, slots=True)
class Name:
    """A term that the model needs.

    `probability` is that of the term on whichever side; `share` the part of the parameters-only mismatch that goes when
    it comes; `ci` by parameter name.
    """

    use: TermUse
    probability: float
    share: float
    ci: Mapping[str, tuple[float, float]]
    rivals: tuple[Rival, ...]

    @property
    def close(self) -> tuple[str, ...]:
        """Other terms that the data cannot tell from this one."""
        near = [r.use.term for r in self.rivals if r.probability > CLOSE * self.probability]
        return tuple(dict.fromkeys(term for term in near if term != self.use.term))

    @property
    def certainty(self) -> float:
        """Probability of the term, or of one that the data cannot tell from it."""
        close = self.close
        return self.probability + sum(r.probability for r in self.rivals if r.use.term in close)

    @property
    def is_on_either_side(self) -> bool:
        """Whether the same term on the other side would do as well."""
        return any(r.use.term == self.use.term and r.probability > CLOSE * self.probability for r in self.rivals)


def inflation(hand: Round) -> float:
    """How much less the data say than white innovations would, at the median of the knobs, at least 1."""
    return float(max(1.0, np.median(inflations_of(hand)))) if hand.fitted.knobs else 1.0


def inflations_of(hand: Round) -> Array:
    """Robust over plain variance of every knob."""
    fitted = hand.fitted
    J, scale = fitted.jacobian, np.array([knob.scale for knob in fitted.knobs])
    belief = np.array([0.0 if k.prior is None else (k.scale / k.doubt) ** 2 for k in fitted.knobs])
    plain = np.diag(np.linalg.pinv(J.T @ J + np.diag(belief), hermitian=True)) * scale**2
    robust = np.diag(spread_of(fitted, hand.stand.blocks()))
    return np.asarray(robust / np.maximum(plain, 1e-300))


def alike(hand: Round, one: TermUse, other: TermUse) -> bool:
    """Whether only how they are written, and what is believed of the plant, parts two terms.

    So it is with the twins, and with a bristle too stiff to be felt.
    """
    both = {one.term: one, other.term: other}
    if set(both) == TWINS:
        return True
    if set(both) != DRY:
        return False
    name, scales = "stiffness_nm_rad", hand.stand.scales
    bristle, values = shelf("gsfdi.terms", PhysicsTerm)["presliding_friction"], both["presliding_friction"].values
    stiffest = plausible(hand.stand, bristle, bristle.param(name), values[name])[1]
    return values[name] > 0.98 * stiffest or values["torque_nm"] / values[name] < UNFELT * scales.speed * scales.period


def names(
    hand: Round,
    given: int,
    contests: Sequence[Contest],
    shelf_terms: Mapping[str, PhysicsTerm],
    shown: Sequence[LawFinding] = (),
    thorough: bool = True,
) -> tuple[Round, list[Name]]:
    """Name the terms of the model in hand, swapping any that a rival does better under the final noise.

    Parameters
    ----------
    hand : Round
        The model in hand and its fit.
    given : int
        Terms that the nominal model holds already.
    contests : sequence of Contest
        How each term was chosen, with its rivals.
    shelf_terms : mapping of str to PhysicsTerm
        The library.
    shown : sequence of LawFinding
        What the law or the values have shown to be wrong already, beside which any term must be needed.
    thorough : bool
        See `rivals`.
    """
    hand = regauged(dated(unshifted(unrefined(pruned(hand, given, shelf_terms))), given), given)
    found: list[Name] = []
    likes: list[list[Fitted]] = []
    place = given
    swaps, former = 0, dict[tuple[str, str | None], TermUse]()
    while place < len(hand.fitted.model.physics):
        use = hand.fitted.model.physics[place]
        contest = contest_of(use, contests)
        bare = without(hand, place)
        gain = max(bare.cost - hand.fitted.cost, 0.0)
        if swaps and gain < max(LEAST, WITHIN * inflation(hand)):  # what it gained is owed to one that lost its place
            return names(around(hand, bare), given, contests, shelf_terms, shown, thorough)
        rows = []
        if contest is not None:
            rows = rivals(hand, place, given, contest, shelf_terms, gain, former, thorough)
        odds = [_odds(hand, use, f, merit, gain) + _prior(f.model.physics[-1], shelf_terms, hand) for merit, f in rows]
        own = _prior(use, shelf_terms, hand)
        if odds and max(odds) > own + 0.1 and swaps < 3:
            better = rows[int(np.argmax(odds))][1]
            former[use.term, use.side] = use
            hand, swaps = there_all_along(around(hand, better), given), swaps + 1
            if not alike(hand, use, better.model.physics[-1]):  # the others were held beside another model
                place, found, likes = given, [], []
            continue
        name, close = weighed(use, own, rows, odds)
        found.append(name)
        likes.append(close)
        place += 1
    less = fewer(hand, given, likes)
    if less is not None:
        return names(around(hand, less), given, contests, shelf_terms, shown, thorough)
    hand = freed(hand)
    bares = [bared(hand, given + i, given) for i in range(len(found))]
    found, beside = _with_intervals(hand, given, found, bares), bool(shown) or len(found) > 1
    # beside stamps that were late, a small error of a sensor only mends how its values were moved
    moved = TRIVIAL * sum(f.gain for f in shown if f.term == LATE)
    for i, (name, bare) in enumerate(zip(found, bares, strict=True)):
        least = needless(hand, given + i, name, shelf_terms[name.use.term], beside)
        if bare.cost - hand.fitted.cost < max(least, moved if is_sensor(name.use.term) else 0.0):
            return names(around(hand, bare), given, contests, shelf_terms, shown, thorough)
    return hand, found


def weighed(
    use: TermUse, own: float, rows: Sequence[tuple[float, Fitted]], odds: Sequence[float]
) -> tuple[Name, list[Fitted]]:
    """Name a term in hand as likely as its rivals leave it; with it, those that are not told apart from it.

    Parameters
    ----------
    use : TermUse
        The term.
    own : float
        Its log-odds.
    rows : sequence of tuple
        Its rivals' merits and fits.
    odds : sequence of float
        Their log-odds.
    """
    weights = np.exp(np.array([own, *odds]) - max([own, *odds]))
    weights *= (1.0 - ELSE) / weights.sum()
    held = [(fitted, merit, float(weight)) for (merit, fitted), weight in zip(rows, weights[1:], strict=True)]
    others = [Rival(fitted.model.physics[-1], merit, weight) for fitted, merit, weight in held]
    same = sum(other.probability for other in others if other.use.term == use.term)
    ranked = tuple(sorted(others, key=lambda rival: -rival.probability))
    close = [fitted for fitted, _, weight in held if weight > CLOSE * weights[0]]
    return Name(use, float(weights[0]) + same, 0.0, {}, ranked), close


def bared(hand: Round, place: int, given: int) -> Fitted:
    """Refit the model in hand without the term at `place`, to the end where that may yet be as good.

    Two terms that cancel each other both seem to be needed after a few rounds. And what sets in about when another does
    may only mend when that did.
    """
    bare = without(hand, place)
    set_in = [use for use in hand.fitted.model.physics[given:] if use.onset is not None]
    if len(set_in) > 1 and hand.fitted.model.physics[place] in set_in:
        bare = dated(around(hand, bare), given).fitted
    return nearing(hand.misfit, bare, hand.fitted.cost, WITHIN) if bare.cost - hand.fitted.cost < NEAR else bare


def needless(hand: Round, place: int, name: Name, term: PhysicsTerm, beside: bool) -> float:
    """Log-likelihood below which a named term is not needed, `beside` others or alone.

    What is left is seldom white. A term that suits a few moments of it gains by them what its size, judged over the
    whole recording, does not bear out.
    """
    if is_steady(hand, place, term):
        return np.inf
    least = WITHIN * inflation(hand) if is_nothing(name, term) else 0.0
    sizes = [
        times
        for knob, times in zip(hand.fitted.knobs, inflations_of(hand), strict=True)
        if knob.place == place and knob.name == term.params[0].name
    ]
    return max(least, *(WITHIN * times for times in sizes)) if beside and sizes else least


def is_steady(hand: Round, place: int, term: PhysicsTerm) -> bool:
    """Whether a term does as well without what it hangs on: a drag that is the same at any temperature is viscous."""
    fitted, arm = hand.fitted, next((p for p in term.params if p.kind == "arm" and p.neutral is not None), None)
    if arm is None or arm.neutral is None:
        return False
    use = fitted.model.physics[place]
    steady = fitted.model.with_use(place, replace(use, values={**use.values, arm.name: arm.neutral}))
    knobs = [knob for knob in fitted.knobs if (knob.place, knob.name) != (place, arm.name)]
    return fit_knobs(hand.misfit, steady, knobs, 3).cost - fitted.cost < WITHIN


def is_nothing(name: Name, term: PhysicsTerm) -> bool:
    """Whether a term gains nothing, or its only number may as well be what it is where the term is not there.

    What simulated steps leave in a number is in its interval; in an error of what is seen they have no part.
    """
    if name.share <= 0.0:
        return True
    size = term.params[0]
    if len(term.numbers) > 1 or size.neutral is None or size.name not in name.ci or is_sensor(term.name):
        return False
    low, high = name.ci[size.name]
    return low <= size.neutral <= high


def _odds(hand: Round, use: TermUse, rival: Fitted, merit: float, gain: float) -> float:
    """Logarithm of the odds that the data give a rival of `merit` against a term that gains so much."""
    if rival.cost > RUINED * hand.fitted.cost:
        return merit / inflation(hand)
    if alike(hand, use, rival.model.physics[-1]):
        return rival.belief - hand.fitted.belief
    return merit / (inflation(hand) + ALIKE * gain)


def _prior(use: TermUse, shelf_terms: Mapping[str, PhysicsTerm], hand: Round) -> float:
    term = shelf_terms[use.term]
    odds = UNLIKELY.get(term.component, 1.0)
    if term.place == "torque_constant" and hand.stand.records[0].effort == "drive_torque":
        odds *= 0.2  # a drive that reports torque has its constant behind it
    if use.onset is not None:
        odds *= SUDDENLY.get(use.term, 1.0)
    odds *= PER_NUMBER ** len(use.values)
    return float(np.log(odds))


def contest_of(use: TermUse, contests: Sequence[Contest]) -> Contest | None:
    """Contest in which a term was a finalist; of one that took the place of a like, where it was offered."""
    offered = [
        (entry.fitted is not None, contest)
        for contest in contests
        for entry in contest.entries
        if (entry.offer.term, entry.offer.side) == (use.term, use.side)
    ]
    return max(offered, key=lambda one: one[0], default=(False, None))[1]


def _with_intervals(hand: Round, given: int, found: Sequence[Name], bares: Sequence[Fitted]) -> list[Name]:
    """Add to each name the 95 % intervals of its numbers, and its share of the mismatch: what goes without it."""
    spread = np.sqrt(np.diag(spread_of(hand.fitted, hand.stand.blocks()))) if hand.fitted.knobs else np.zeros(0)
    gains = [bare.cost - hand.fitted.cost for bare in bares]
    whole = sum(max(g, 0.0) for g in gains) or 1.0
    done = []
    for i, name in enumerate(found):
        use = hand.fitted.model.physics[given + i]
        params = shelf("gsfdi.terms", PhysicsTerm)[use.term].params
        ci = {p.name: (use.values[p.name],) * 2 for p in params if p.kind == "choice" and p.name in use.values}
        for knob, value, sd in zip(hand.fitted.knobs, hand.fitted.values, spread, strict=True):
            if knob.place == given + i:
                stepped = READ * hand.stand.scales.period if use.term in CLOCKS else SIMULATED * abs(value)
                width = 1.96 * float(np.hypot(sd, stepped))
                ci[knob.name] = (float(max(value - width, knob.low)), float(min(value + width, knob.high)))
        done.append(replace(name, use=use, ci=ci, share=max(gains[i], 0.0) / whole))
    return done


def torque_left(first: Round, last: Round, floor: Array) -> float:
    """Missing torque that remains, as a share of what was missing with parameters alone (root mean square, 0 to 1).

    Parameters
    ----------
    first, last : Round
        Parameters only, and the model with everything that was found.
    floor : (k,) array
        Torque noise that is known to be there [N m].
    """
    return _share(missing(first, floor), missing(last, floor))


def white_left(first: Round, last: Round, floor: Array) -> float:
    """White innovations beyond noise that remain, as a share: what tells where a sensor errs and no torque is missing.

    Parameters are those of `torque_left`.
    """
    return _share(_beyond_noise(first, floor), _beyond_noise(last, floor))


def _share(before: float, after: float) -> float:
    return min(after / before, 1.0) if before > 0 else 0.0


def _beyond_noise(hand: Round, floor: Array) -> float:
    """Root mean square of the white innovations beyond the noise that is known to be there, in units of that noise."""
    white = hand.stand.white([e[None] for e in hand.innovations], hand.stand.whiteners(floor))[0]
    return float(np.sqrt(max(white @ white / max(hand.stand.told, 1.0) - 1.0, 0.0)))
