"""Terms of physics compete for what the model in hand leaves unexplained.

Every offer's signature is the change of the white innovations when the term is switched on in a replay. A linear
regression on signature and plant together says how much of the log-likelihood the term could gain, from the start or
from an onset on. The best are then refitted by replay, all numbers at once, and the winner joins the model if its gain
beats what chance would give the luckiest of as many offers on this very motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.fit import Fitted, Knob, turned
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.calibrate import bar, inflations
from gsfdi.reconcile.contract import levels
from gsfdi.reconcile.doubted import moot_terms
from gsfdi.reconcile.hand import Round, around, from_below, is_sensor, likelier, settle, started, with_term
from gsfdi.reconcile.knobs import plant_knobs, plausible, start_knobs
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.offer import SHARE, Offer, offers
from gsfdi.reconcile.remainder import torque_between
from gsfdi.reconcile.screen import EARLIEST, LEAST, ONSETS, Entry, Screening, onset_cost, refined_onset, refit, screen
from gsfdi.reconcile.smallest import Smallest, smallest
from gsfdi.reconcile.surplus import lowered
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.reconcile.waves import worthy_orders
from gsfdi.reconcile.window import dating_window, typical_window
from gsfdi.types import Array

FINALISTS = 8
NEAR = 0.3
"""Share of the best finalist's merit from which another is settled under its own noise, too."""
SETTLED = 4
"""Finalists that are settled at most."""
PLAIN = 100.0
"""Merit from which a finalist below its bar is settled, to be held against the bar that it has then."""
MATERIAL = 2e-4
"""Share of the drive's torque below which an effect is not worth a name: it may be the simulator's own."""
TRIVIAL = 0.02
"""Share of the missing torque below which no further term is looked for."""
TRIED = 3.0
"""Times the torque that is missing at which a term is tried."""
FEWEST = 5.0
"""Times the least torque worth a name at which a term is tried at least."""
SLIP = 10.0
"""Times the noise of the position by which a joint may slip without that being seen."""
CHANCE = 0.005
"""Probability that chance alone makes one of all offers a winner."""
UNPROMISED = 2.0
"""How many times what the regression promised a faint finalist may gain."""
SHAPES = ("plain", "follower")
FACTORS = (0.1, 0.3, 3.0, 10.0, 30.0)
"""Times its value at which a number that shapes a term is tried once the term is settled."""
OF_THE_LAW = frozenset({"current_gain", "velocity_bias", "velocity_gain"})
"""Terms that say no more, where the law told the speed, than that the law is another."""
KNOB_COST = 4.0
"""Log-likelihood that each number of a term must earn: half the logarithm of the number of samples, nearly."""


@dataclass(frozen=True, slots=True)
class Contest:
    """One round as it went: who competed, best first, who won, how many offers there were, and what would have won."""

    entries: tuple[Entry, ...]
    winner: Entry | None
    trials: int
    smallest: tuple[Smallest, ...] = ()


def compete(
    first: Round, model: JointModel, shelf_terms: Mapping[str, PhysicsTerm], level: float = 0.0, most: int = 3
) -> tuple[Round, Round, list[Contest]]:
    """Let terms join the model until chance explains the best of what is left.

    Parameters
    ----------
    first : Round
        Where the competition starts: parameters only (see `opening`).
    model : JointModel
        The nominal model that was opened with, its contract with the recordings settled.
    shelf_terms : mapping of str to PhysicsTerm
        Terms that may compete.
    level : float
        Doubt about the constant loads that are the last terms of `model` [N m]; 0 where they are not there.
    most : int
        Terms that may join at most.

    Returns
    -------
    Round
        Parameters only.
    Round
        The model with every term that won.
    list of Contest
    """
    shelf_terms = possible(first.stand, shelf_terms, level)
    window = typical_window(first.stand, first.innovations)
    if window != first.stand.window:
        first = opening(replace(first.stand, window=window), model, level)
    first, hand, contests = rounds(first, shelf_terms, len(model.physics), most)
    window = dating_window(first.stand, hand.fitted.model.physics[len(model.physics) :])
    if window != first.stand.window:
        first = opening(replace(first.stand, window=window), model, level)
        return rounds(first, shelf_terms, len(model.physics), most)
    return first, hand, contests


def possible(stand: Bench, shelf_terms: Mapping[str, PhysicsTerm], level: float) -> dict[str, PhysicsTerm]:
    """Terms that say something on this bench; for `level` see `compete`."""
    moot = moot_terms(stand.model) | (OF_THE_LAW if stand.lever > 0 else frozenset())
    terms = {name: term for name, term in shelf_terms.items() if name not in moot}
    return beside_the_law(terms) if level > 0 else terms


def rounds(
    first: Round, shelf_terms: Mapping[str, PhysicsTerm], given: int, most: int
) -> tuple[Round, Round, list[Contest]]:
    """Hold contest after contest until chance explains the best of what is left; for the rest see `compete`.

    Parameters
    ----------
    first : Round
        Parameters only.
    shelf_terms : mapping of str to PhysicsTerm
    given : int
        Terms of the nominal model.
    most : int
        Terms that may join at most.
    """
    floor, hand = effort_floor(first.stand), first
    contests: list[Contest] = []
    while True:
        contest, settled = contend(hand, shelf_terms, floor, given)
        contests.append(contest)
        if settled is None:
            return first, hand, contests
        hand = simplified(settled, given)
        if len(contests) >= most or missing(hand, floor) < TRIVIAL * missing(first, floor):
            return first, hand, contests


def beside_the_law(shelf_terms: Mapping[str, PhysicsTerm]) -> dict[str, PhysicsTerm]:
    """Terms that are possible where the effort is the law's own: its sensor errs by a constant at most, and always."""
    return {
        name: replace(term, sets_in="never") if name == "current_bias" else term
        for name, term in shelf_terms.items()
        if name != "current_gain"
    }


def opening(stand: Bench, model: JointModel, level: float) -> Round:
    """Fit the parameters only; for the arguments see `compete`."""
    knobs = [*plant_knobs(model, stand.records[0].effort), *start_knobs(stand)]
    if level > 0:
        last = len(model.physics)
        places = range(last - len(levels(stand)), last)
        knobs += [Knob(place, "torque_nm", level, -20 * level, 20 * level, 0.0, level) for place in places]
    floor = effort_floor(stand)
    return from_below(settle(stand, started(model, len(stand.records)), knobs, floor), floor)


def missing(hand: Round, floor: Array) -> float:
    """Size of the process noise beyond what is known to be there [N m]: what the model in hand lacks."""
    return float(np.sqrt(np.sum(np.maximum(hand.torque**2 - floor**2, 0.0))))


def simplified(hand: Round, given: int) -> Round:
    """Take out, one after another, terms and onsets that the others have made needless.

    Parameters
    ----------
    hand : Round
        The model in hand and its fit.
    given : int
        Terms of the nominal model, which stay.
    """
    for place, use in list(enumerate(hand.fitted.model.physics))[given:]:
        if use.onset is not None and use.onset < EARLIEST * hand.stand.scales.seconds:  # it was there all along
            hand = around(hand, always(hand, place))
    while True:
        trials = [(without(hand, place), _price(hand, place)) for place in range(given, len(hand.fitted.model.physics))]
        trials += [
            (always(hand, place), 2 * KNOB_COST)
            for place in range(given, len(hand.fitted.model.physics))
            if _sets_in(hand, place)
        ]
        kept = [(fitted.cost - hand.fitted.cost - price, fitted) for fitted, price in trials]
        if len(hand.fitted.model.physics) - given < 2:
            kept = kept[1:]
        if not kept:
            return hand
        worth, fitted = min(kept, key=lambda pair: pair[0])
        if worth > 0:
            return hand
        hand = around(hand, fitted)


def _price(hand: Round, place: int) -> float:
    use = hand.fitted.model.physics[place]
    return KNOB_COST * (len(use.values) + (2 if use.onset is not None else 0)) + 3.0


def _sets_in(hand: Round, place: int) -> bool:
    return hand.fitted.model.physics[place].onset is not None


def without(hand: Round, place: int) -> Fitted:
    """Refit the model in hand without the term at `place`; the same term on the other side may set in for both."""
    fitted, gone = hand.fitted, hand.fitted.model.physics[place]
    model = replace(fitted.model, physics=(*fitted.model.physics[:place], *fitted.model.physics[place + 1 :]))
    keep = [i for i, k in enumerate(fitted.knobs) if k.place != place]
    knobs = [replace(fitted.knobs[i], place=fitted.knobs[i].place - (fitted.knobs[i].place > place)) for i in keep]
    known = fitted.jacobian[:, keep]
    alone = fit_knobs(hand.misfit, model, knobs, 3, known)
    for i, use in enumerate(model.physics):
        if use.term == gone.term and use.onset is not None and gone.onset is not None:
            alone = refined_onset(
                hand, fit_knobs(hand.misfit, alone.model, knobs, 6), i, abs(use.onset - gone.onset), known
            )
    return alone


def always(hand: Round, place: int) -> Fitted:
    """Refit the model in hand with the term at `place` there from the start."""
    fitted = hand.fitted
    use = replace(fitted.model.physics[place], onset=None)
    model = replace(fitted.model, physics=(*fitted.model.physics[:place], use, *fitted.model.physics[place + 1 :]))
    return fit_knobs(hand.misfit, model, fitted.knobs, 4)


def contend(
    hand: Round, shelf_terms: Mapping[str, PhysicsTerm], floor: Array, given: int
) -> tuple[Contest, Round | None]:
    """Hold one round: screen every offer, refit the finalists, settle the best, and test the winner against luck.

    While much is missing every term is judged under a large noise, where the true one is hardly better than its
    likes. So the best few are settled each under the noise that suits it, and the likeliest wins.
    """
    screening = screen(hand, all_offers(hand, shelf_terms, given))
    finalists = [refit(hand, entry) for entry in distinct(screening.entries, FINALISTS)]
    ranked = calibrated(hand, screening, sorted(finalists, key=merit, reverse=True))
    trials = len(screening.information)
    ranked = [fairly(hand, e, shelf_terms) if merit(e) > LEAST else e for e in ranked]
    ranked.sort(key=merit, reverse=True)
    near = [e for e in needed(ranked) if merit(e) > NEAR * merit(ranked[0]) and matters(hand, e)]
    best: tuple[float, Entry, Round] | None = None
    for entry in [e for e in near if merit(e) > min(e.bar, PLAIN)][:SETTLED]:
        assert entry.fitted is not None
        settled = settle(hand.stand, entry.fitted.model, entry.fitted.knobs, floor)
        if entry.onset is not None:
            settled = settled_onset(settled, floor)
        settled = reshaped(settled, shelf_terms[entry.offer.term], floor)
        gain = likelier(settled, hand) - _numbers(entry)
        if merit(entry) < entry.bar and gain < settled_bar(settled, entry, trials):
            continue
        if gain > (best[0] if best else 0.0):  # one that gains nothing only moves the mismatch about
            best = (gain, entry, settled)
    entries = (*ranked, *screening.entries)
    if best is None:
        return undecided(hand, screening, entries, shelf_terms), None
    return Contest(entries, best[1], trials), from_below(best[2], floor)


def undecided(
    hand: Round, screening: Screening, entries: Sequence[Entry], shelf_terms: Mapping[str, PhysicsTerm]
) -> Contest:
    """Lay out a round that nobody won, with the least of every term that would have."""
    least = smallest(hand, screening, shelf_terms, CHANCE, MATERIAL)
    return Contest(tuple(entries), None, len(screening.information), least)


def fairly(hand: Round, entry: Entry, shelf_terms: Mapping[str, PhysicsTerm]) -> Entry:
    """Take off a finalist what its term gains by being written into the model, were it nothing.

    A model with a spring or a delay that is no plain number is stepped otherwise than one without. Where the effort is
    known exactly that alone, with the numbers in hand fitted anew, may suit a recording better by tens. So may numbers
    gone far along a direction in which nothing is felt, through the moments at which a joint sticks and slips; the
    regression had promised none of it.
    """
    fitted = entry.fitted
    if fitted is None or merit(entry) > PLAIN:
        return entry
    entry = replace(entry, gain=min(entry.gain, UNPROMISED * entry.linear))
    use = _idle(fitted.model.physics[-1], shelf_terms)
    if use is None or merit(entry) < LEAST:
        return entry
    start = turned(hand.fitted.model, hand.fitted.knobs, fitted.values[: len(hand.fitted.knobs)])
    idle = fit_knobs(hand.misfit, with_term(start, use), hand.fitted.knobs, 3)
    return replace(entry, gain=entry.gain - max(hand.fitted.cost - idle.cost, 0.0))


def _idle(use: TermUse, shelf_terms: Mapping[str, PhysicsTerm]) -> TermUse | None:
    """Give a term with the number that sizes it at nothing."""
    size = shelf_terms[use.term].params[0]
    return None if size.neutral is None else replace(use, values={**use.values, size.name: size.neutral})


def needed(ranked: Sequence[Entry]) -> list[Entry]:
    """Finalists without those that set in to no purpose: the same term from the start has as much merit."""
    always = {(e.offer.term, e.offer.side): merit(e) for e in ranked if e.onset is None}
    return [e for e in ranked if e.onset is None or merit(e) > always.get((e.offer.term, e.offer.side), -np.inf)]


def calibrated(hand: Round, screening: Screening, ranked: Sequence[Entry]) -> list[Entry]:
    """Give each finalist the bar that it must pass, under what the best of them leaves."""
    if not ranked or ranked[0].fitted is None:
        return []
    times = inflations(screening.bare, screening.information, ranked[0].fitted.residual, hand.stand.blocks())
    found = []
    for entry in ranked:
        own = float(np.max(times[slice(*entry.rows)], initial=1.0))
        found.append(replace(entry, inflation=own, bar=_bar(entry, own, len(times))))
    return found


def settled_bar(settled: Round, entry: Entry, trials: int) -> float:
    """Bar that an entry must pass once it is settled.

    What acts in a few blocks of time only, as a stop does, leaves misfits there until its numbers are right, and these
    make chance seem able to do as much.
    """
    fitted = settled.fitted
    own = np.array([knob.place == len(fitted.model.physics) - 1 for knob in fitted.knobs])
    rest, columns = fitted.jacobian[:, ~own], fitted.jacobian[:, own]
    bare = columns - rest @ np.linalg.lstsq(rest, columns, rcond=1e-9)[0]
    times = inflations(bare.T, np.sum(bare**2, axis=0), fitted.residual, settled.stand.blocks())
    return _bar(entry, float(np.max(times, initial=1.0)), trials)


def _bar(entry: Entry, inflation: float, trials: int) -> float:
    return max(LEAST, bar(inflation, trials, CHANCE)) + onset_cost(entry)


def settled_onset(hand: Round, floor: Array) -> Round:
    """Move the onset of the last term under the noise that now suits it, a wrong one being noise itself."""
    width = hand.stand.scales.seconds / ONSETS / 4
    fitted = refined_onset(hand, hand.fitted, len(hand.fitted.model.physics) - 1, width)
    if fitted.cost > hand.fitted.cost - KNOB_COST:
        return hand
    return settle(hand.stand, fitted.model, fitted.knobs, floor)


def reshaped(hand: Round, term: PhysicsTerm, floor: Array) -> Round:
    """Try the last term's shape at other scales under the noise that now suits it, which slopes do not reach."""
    model, place = hand.fitted.model, len(hand.fitted.model.physics) - 1
    use, best = model.physics[place], (hand.fitted.cost - KNOB_COST, model)
    for param in term.params:
        if param.trials is None or param.kind not in SHAPES or param.low < 0 or param in (term.order, term.params[0]):
            continue
        value = use.values[param.name]
        low, high = plausible(hand.stand, term, param, value)
        trials = [float(np.clip(value * factor, max(low, param.low), min(high, param.high))) for factor in FACTORS]
        models = [turned(model, [Knob(place, param.name, 1.0)], np.array([trial])) for trial in trials]
        costs = 0.5 * np.sum(hand.misfit(models) ** 2, axis=1)
        best = min(best, (float(np.nanmin(costs)), models[int(np.nanargmin(costs))]), key=lambda pair: pair[0])
    return hand if best[1] is model else settle(hand.stand, best[1], hand.fitted.knobs, floor)


def matters(hand: Round, entry: Entry) -> bool:
    """Whether a fitted term is large enough for a name: a torque must be, an error of what is seen need only be sure.

    An error of the current is as good as a torque; a step of the position that noise hides, as good as a slip.
    """
    if entry.fitted is None:
        return False
    if entry.offer.term == "position_bias":
        return abs(entry.fitted.model.physics[-1].values["bias_rad"]) > SLIP * hand.stand.scales.noise
    if is_sensor(entry.offer.term) and not entry.offer.term.startswith("current_"):
        return True
    model = entry.fitted.model  # the term by itself: beside it, numbers of the plant may have moved by much more
    return bool(torque_between(hand.stand, replace(model, physics=model.physics[:-1]), model)[0] > MATERIAL)


def size_of(hand: Round, fitted: Fitted) -> float:
    """Torque that a fitted model has and the one in hand lacks, root mean square, as a share of the drive's."""
    return float(torque_between(hand.stand, hand.fitted.model, fitted.model)[0])


def merit(entry: Entry) -> float:
    """Gain in log-likelihood less what its numbers cost."""
    return entry.gain - _numbers(entry) if np.isfinite(entry.gain) else -np.inf


def _numbers(entry: Entry) -> float:
    return KNOB_COST * (len(entry.offer.columns[0]) + (2 if entry.onset is not None else 0))


def distinct(entries: Sequence[Entry], most: int) -> list[Entry]:
    """The best entry of each term and side, from the start and from an onset on."""
    seen: dict[tuple[str, str | None, bool], Entry] = {}
    for entry in entries:
        seen.setdefault((entry.offer.term, entry.offer.side, entry.onset is None), entry)
    return list(seen.values())[:most]


def share_to_try(hand: Round) -> float:
    """Share of what is usual at which terms are tried: no farther above what is missing than the plant may hide.

    Where a joint sticks, a friction far larger than the true one moves every stop, and its signature is that.
    """
    missing_share = float(np.linalg.norm(hand.torque)) / hand.stand.scales.torque
    return float(np.clip(TRIED * missing_share, FEWEST * MATERIAL, SHARE))


def all_offers(hand: Round, shelf_terms: Mapping[str, PhysicsTerm], given: int) -> list[Offer]:
    """Every offer of every term that could act in this joint, show beside its recorded effort, and is not there yet."""
    stand = hand.stand
    orders = worthy_orders(hand)
    found = [
        offer
        for term in shelf_terms.values()
        if stand.model.structure in term.structures and stand.model.axis in term.axes
        for offer in offers(term, stand.scales, orders, share_to_try(hand))
    ]
    if stand.model.structure == "rigid":
        found = [replace(o, side=None) for o in found if o.side != "motor"]
    found = [lowered(offer, stand.model, shelf_terms[offer.term]) for offer in found]
    there = {(u.term, u.side) for u in hand.fitted.model.physics[given:] if not shelf_terms[u.term].several}
    return [o for o in found if (o.term, o.side) not in there]
