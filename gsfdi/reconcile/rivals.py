"""What else a term in hand might be: every finalist of the contest that it won, refitted in its place."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gsfdi.fit import Fitted, Knob
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.contest import Contest
from gsfdi.reconcile.finalists import KNOB_COST, has_ended, is_at_bound, is_chance, never_slips
from gsfdi.reconcile.hand import Round, settle, sticks, with_term, without_terms
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.say import CONFUSED
from gsfdi.reconcile.screen import ONSETS, Entry, allowed, refined_onset
from gsfdi.reconcile.ticks import moot_by_shift
from gsfdi.reconcile.turning import fit_knobs, nearing
from gsfdi.sliding import SMOOTH
from gsfdi.types import Array, JointRecord

DRY = {"coulomb_friction", "presliding_friction"}
"""A bristle that slides is a dry friction."""
HOPELESS = 300.0
"""Log-likelihood behind which a rival is not worth a thorough fit."""
HARDLY = 1e-3
"""The same as a share of what the term in hand gains: so little of a large one is soon made up."""

FEW = 12
"""Times at which a rival that sets in is tried where the term in hand was there from the start, or drifts."""


def rivals(
    hand: Round,
    place: int,
    given: int,
    contest: Contest,
    shelf_terms: Mapping[str, PhysicsTerm],
    gain: float,
    former: Mapping[tuple[str, str | None], TermUse],
    thorough: bool = True,
) -> list[tuple[float, Fitted]]:
    """Refit the model in hand with each finalist of a contest in the place of a term; merits beside it.

    Parameters
    ----------
    hand : Round
        The model in hand and its fit.
    place : int
        Of the term.
    given : int
        Terms that the nominal model holds already.
    contest : Contest
        That the term won.
    shelf_terms : mapping of str to PhysicsTerm
        The library.
    gain : float
        Log-likelihood that the term gains.
    former : mapping of tuple to TermUse
        Terms that have been in hand and lost their place, by name and side, with the numbers they had.
    thorough : bool
        Whether to look for the moment at which a rival sets in, and for the noise that suits it: where much is missing
        beside any of them, that tells nothing, and took a third of the time.
    """
    own, hopeless = hand.fitted.model.physics[place], max(HOPELESS, HARDLY * gain)
    if any(own.term in shelf_terms[use.term].beside for use in hand.fitted.model.physics[given:]):
        return []  # another is there to shape this one
    bare, rest, keep = without_terms(hand.fitted, [place])
    known, found, ended = hand.fitted.jacobian[:, keep], [], has_ended(hand.fitted, shelf_terms, place)
    for use, beyond in stand_ins(hand, own, bare.physics, given, contest, shelf_terms, former):
        model = with_term(bare, use)
        knobs = [*rest, *term_knobs(hand.stand, model, len(model.physics) - 1)]
        fitted = fit_knobs(hand.misfit, model, knobs, 1 if beyond else 4, known)
        fitted = fitted if beyond else nearing(hand.misfit, fitted, hand.fitted.cost, hopeless)
        if thorough and use.onset is not None and fitted.cost - hand.fitted.cost < 10 * hopeless:
            if own.onset is None:
                fitted = elsewhere(hand, fitted, known)
            fitted = refined_onset(hand, fitted, len(model.physics) - 1, hand.stand.scales.seconds / ONSETS, known)
        alike = thorough and (ended or is_confused(own, use))
        if fitted.cost - hand.fitted.cost > hopeless and alike and not beyond and may_stick(model, own, shelf_terms):
            # under the noise of a model that lacks nothing, a joint that sticks keeps a fit from going far
            fitted = settle(hand.stand, model, knobs, effort_floor(hand.stand)).fitted
            fitted = fit_knobs(hand.misfit, fitted.model, knobs, 4)
        if fitted.cost - hand.fitted.cost < hopeless:
            fitted = fit_knobs(hand.misfit, fitted.model, knobs, 8)
        if not (is_at_bound(fitted, shelf_terms) or never_slips(fitted.model.physics[-1], hand.stand.scales)):
            found.append((hand.fitted.cost - fitted.cost - price(use) + price(own), fitted))
    return found


def stand_ins(
    hand: Round,
    own: TermUse,
    others: Sequence[TermUse],
    given: int,
    contest: Contest,
    shelf_terms: Mapping[str, PhysicsTerm],
    former: Mapping[tuple[str, str | None], TermUse],
) -> Iterator[tuple[TermUse, bool]]:
    """Give what may stand in the place of `own` beside the others, and whether its contest left it far behind.

    Each has the numbers that it begins with. For the parameters see :func:`rivals`.
    """
    moot, lost = moot_by_shift(hand.fitted), contest.beyond | contest.far if len(others) == given else contest.beyond
    finalists = [entry for entry in contest.entries if entry.fitted is not None]
    for entry in (*finalists, *unfitted_likes(own, contest)):
        offer = entry.offer
        if offer.term in moot or not may_replace(entry, own, others, given, shelf_terms):
            continue
        use = entry.fitted.model.physics[-1] if entry.fitted is not None else first_guess(entry)
        use = former.get((offer.term, offer.side), use)
        if use is None:
            continue
        use = turning_like(own, use, hand.stand.records)
        once = use.onset is not None or entry.fitted is None
        if own.onset is not None and (once or (is_confused(own, use) and shelf_terms[use.term].sets_in != "never")):
            use = replace(use, onset=own.onset)  # what happened then is the question, not when
        yield use, (offer.term, offer.side) in lost


def is_confused(own: TermUse, other: TermUse) -> bool:
    """Whether either term is easily taken for the other."""
    return frozenset({own.term, other.term}) in CONFUSED


def elsewhere(hand: Round, fitted: Fitted, known: Array) -> Fitted:
    """Let the last term of a rival set in at quite another time where that fits better.

    Regression saw it set in beside other numbers of the plant. A stiffness that fell by a tenth at 55 s seemed to do so
    at 98, where a drift of the torque constant did better.
    """
    knob, J = Knob(len(fitted.model.physics) - 1, "onset", 1.0), np.linalg.qr(fitted.jacobian)[0]
    times = np.linspace(0, 1, FEW + 2)[1:-1] * hand.stand.scales.seconds
    left = hand.misfit([knob.turn(fitted.model, time) for time in times])
    costs = 0.5 * np.sum((left - (left @ J) @ J.T) ** 2, axis=1)
    best = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
    if not costs[best] < fitted.cost:
        return fitted
    other = fit_knobs(hand.misfit, knob.turn(fitted.model, float(times[best])), fitted.knobs, 4)
    other = refined_onset(hand, other, knob.place, times[0] / 2, known)
    return min(fitted, other, key=lambda one: one.cost)


def may_stick(model: JointModel, own: TermUse, shelf_terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether a joint may stick with the last term of `model` in the place of `own`: not where a wave replaces one."""
    waves = (shelf_terms[use.term].order is not None for use in (own, model.physics[-1]))
    return sticks(model) or not all(waves)


def turning_like(own: TermUse, other: TermUse, records: Sequence[JointRecord]) -> TermUse:
    """Give a dry friction that stands for another the torque of that; for drag, it turns round over the same speeds.

    On a real arm a Coulomb friction that began with a fifth more than the bristle it stood for got stuck there. So did
    a constant load that began a fifth below the mean of the weight it stood for, and, beside an end stop, a drag that
    began elsewhere than the one it stood for, which did not hang on the temperature after all.
    """
    if (own.term, other.term) == ("gravity_unbalance", "constant_load"):
        angles = np.concatenate([record["position"] for record in records]) - own.values["angle_rad"]
        return replace(other, values={"torque_nm": own.values["torque_nm"] * float(np.nanmean(np.sin(angles)))})
    if (own.term, other.term, own.side) == ("temperature_dependent_friction", "viscous_friction", other.side):
        return replace(other, values={"coefficient_nms_rad": own.values["coefficient_nms_rad"]}, onset=own.onset)
    if {own.term, other.term} == DRY:
        return replace(other, values={**other.values, "torque_nm": own.values["torque_nm"]})
    if (own.term, other.term) != ("shear_thinning_friction", "coulomb_friction"):
        return other
    values = {"torque_nm": own.values["torque_nm"], SMOOTH.name: own.values["velocity_rad_s"]}
    return replace(other, values=values)


def may_replace(
    entry: Entry, own: TermUse, others: Sequence[TermUse], given: int, shelf_terms: Mapping[str, PhysicsTerm]
) -> bool:
    """Whether an entry may stand in the place of a term beside the others, of which the first are the model's own."""
    term = entry.offer.term
    if (term, entry.offer.side) == (own.term, own.side):
        return False
    if is_chance(entry):
        return False
    if not shelf_terms[term].several and any(use.term == term for use in others[given:]):
        return False
    return not any({use.term, term} == DRY for use in others)  # one dry friction in two


def price(use: TermUse) -> float:
    """Log-likelihood that a term's numbers must earn."""
    return KNOB_COST * (len(use.values) + (2 if use.onset is not None else 0))


def unfitted_likes(own: TermUse, contest: Contest) -> list[Entry]:
    """Offers of terms that are easily taken for `own` and yet were no finalists."""
    likes = {name for pair in CONFUSED if own.term in pair for name in pair} - {own.term}
    likes -= {entry.offer.term for entry in contest.entries if entry.fitted is not None}
    best: dict[str, Entry] = {}
    for entry in contest.entries:
        if entry.offer.term in likes and entry.onset is None:
            best.setdefault(entry.offer.term, entry)
    return list(best.values())


def first_guess(entry: Entry) -> TermUse | None:
    """Term of an offer with the numbers that regression gave it."""
    values = entry.offer.mix(entry.coefficients)
    return None if values is None else entry.offer.use(allowed(entry.offer, values), entry.onset)
