"""Terms of physics compete for what the model in hand leaves unexplained.

Every offer's signature is the change of the white innovations when the term is switched on in a replay. A linear
regression on signature and plant together says how much of the log-likelihood the term could gain, from the start or
from an onset on. The best are then refitted by replay, all numbers at once, and the winner joins the model if its gain
beats what chance would give the luckiest of as many offers on this very motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.fit import Fitted, Knob
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.driving import levels
from gsfdi.reconcile.finalists import (
    CHANCE,
    FINALISTS,
    UNPROMISED,
    cost_of,
    credible,
    distinct,
    fairly,
    finalists_of,
    idle,
    is_at_bound,
    matters,
    merit,
    needed,
    never_slips,
    only_turns,
    settled_bar,
    settled_onset,
    stretched_knobs,
)
from gsfdi.reconcile.forms import relawed, reordered, reshaped, retuned, shared_anew, swung
from gsfdi.reconcile.hand import (
    Round,
    Turn,
    at_a_glance,
    coarse,
    exact,
    from_above,
    from_below,
    is_sensor,
    leaves_nothing,
    likelier,
    missing,
    plays,
    refined,
    settle,
    started,
    without_terms,
)
from gsfdi.reconcile.knobs import plant_knobs, start_knobs
from gsfdi.reconcile.lagging import beside_positions
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.offering import MATERIAL, all_offers, possible
from gsfdi.reconcile.pairs import paired_anew
from gsfdi.reconcile.screen import LEAST, Entry, Screening, refits, screen
from gsfdi.reconcile.simpler import simplified
from gsfdi.reconcile.smallest import Smallest, smallest
from gsfdi.reconcile.ticks import is_as_likely, is_of_one_signal, shifted, shifted_as
from gsfdi.reconcile.trifles import only_mends_flanks
from gsfdi.reconcile.verify import SILENCED, SILENCERS, STRAYS, strays
from gsfdi.reconcile.window import dating_window, typical_window
from gsfdi.registry import shelf
from gsfdi.types import Array

NEAR = 0.3
"""Share of the best finalist's merit from which another is settled under its own noise, too."""
WORTH = 60.0
"""Merit from which a finalist below its bar is settled, and what it must gain once it is.

Where something is missing, a lower merit will do, for the noise of that hides what a term is worth: a mode of merit 47
gained 1,416.
"""
CLEAR = 2.0
"""Times its bar that a settled finalist gains which goes before any that gains less."""
FAR = 0.5
"""Share of the gain of one that leaves a trifle below which a rival is not given other shapes."""
EARLY = 0.5
"""Share of the best one's gain below which a rival is left after its first turn: of 43 on 36 joints none came up."""
GLANCED = 0.15
"""The same before it: of 9 on 36 joints that gained less as they were, none came to a third once settled."""
IDLE = 0.5
"""Part of what a winner gains from which on that is none of its own doing."""
OWED = 0.5
"""Part of what another law of a finalist gains that does not count against the others while something is left.

A gravity and a Stribeck friction were missing; an asymmetry that turns smoothly came before the gravity by 3 of 10,240,
of which it owed 330 to its smoothness.
"""
SETTLED, LEVEL = 4, 0.99
"""Finalists that are settled at most, unless more come within this share of the best."""
TRIVIAL = 0.02
"""Share of the missing torque below which a further term is looked for only where regression promises it its bar.

A second effect may be felt plainly beside one that is a hundred times as large.
"""
PROMISED = 0.015
"""Share of what has been gained beside a play that regression must promise a further term (see `least_promise`)."""
MAIN = 3
"""Terms that must account for most of what is missing before a further one may join."""
DETAIL = 0.2
"""Share of the missing torque up to which what is left is a detail that one may refine."""
NOTHING = 0.9
"""Share of the missing torque, and of what is unforeseen, from which two terms explain nothing, nor would a third."""
DATED = 0.5
"""Share of what is missing without all that sets in up to which it matters when that does."""
PIECES = 3
"""Terms that set in which are pieces of something else: no further one is looked for."""


@dataclass(frozen=True, slots=True)
class Contest:
    """One round as it went: who competed, best first, who won, how many offers there were, and what would have won."""

    entries: tuple[Entry, ...]
    winner: Entry | None
    trials: int
    smallest: tuple[Smallest, ...] = ()
    beyond: frozenset[tuple[str, str | None]] = frozenset()
    """Terms and sides that came nowhere near the winner, though each was fitted under the noise that suits it."""
    far: frozenset[tuple[str, str | None]] = frozenset()
    """Terms and sides that were left after their first turn: they come nowhere near where nothing more has joined."""


def compete(
    first: Round, model: JointModel, shelf_terms: Mapping[str, PhysicsTerm], level: float = 0.0, most: int = 5
) -> tuple[Round, Round, list[Contest]]:
    """Let terms join the model until chance explains the best of what is left.

    All is held once more, another part kept for judging, where the model that was found shows that part to be unlike
    the rest, or something that accounts for most of what it would lack sets in there. Where much is missing still that
    mends nothing: of two joints that nothing explains it took 116 of 269 s and 88 of 231.

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
    given, window = len(model.physics), typical_window(first.stand, first.innovations)
    if window != first.stand.window:
        first = opening(first.stand.judged_in(window), model, level)
    first, hand, contests = rounds(first, shelf_terms, given, most)
    found, floor = hand.fitted.model.physics[given:], effort_floor(first.stand)
    explains = leaves_nothing(hand, floor) or missing(hand, floor) < DETAIL * missing(first, floor)
    if not explains or pieces_of(found) >= PIECES:
        return first, hand, contests  # what is kept for judging has no part in what is missing yet
    window = typical_window(first.stand, hand.innovations)  # an end stop that is met then only shows in a good fit
    if window == first.stand.window:
        window = dating_window(first.stand, found)
        if window == first.stand.window or not is_dated(hand, given, floor):
            return first, hand, contests
    first = opening(first.stand.judged_in(window), model, level)
    return rounds(first, shelf_terms, given, most)


def rounds(
    first: Round, shelf_terms: Mapping[str, PhysicsTerm], given: int, most: int
) -> tuple[Round, Round, list[Contest]]:
    """Hold contest after contest until chance explains the best of what is left; for the rest see `compete`.

    While much is missing, a lag looks like the shift of a log that was made in steps. So the shift is taken, and where
    the lag does better in the end, all is held again without it.

    Another law for a term that the nominal model holds comes before any new term that gains less, or that turns round
    as smoothly as that one may: where simulators write a friction in two ways, no physics was left out. So it is, too,
    where noise hides nearly all of that: a friction that turned round over 5e-4 rad/s was a bristle in a sound joint.

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
    opened = first
    first, hand, contests = _rounds(first, first, (), shelf_terms, given, most, stepped=True)
    if is_of_one_signal(hand, effort_floor(hand.stand)):
        return _rounds(opened, opened, (), shelf_terms, given, most, stepped=False)
    return first, hand, contests


def resumed(
    first: Round,
    hand: Round,
    contests: Sequence[Contest],
    shelf_terms: Mapping[str, PhysicsTerm],
    given: int,
    most: int = 5,
) -> tuple[Round, list[Contest]]:
    """Go on with the competition beside terms that others have taken the place of since.

    What came after a term that was taken for another was found in the noise of that. A drag was a friction of the load
    at first: a Coulomb friction had set in 0.8 s too soon beside it, and a cogging was off by a hundredth in its order.

    Parameters
    ----------
    first : Round
        Parameters only.
    hand : Round
        The model as its terms are named.
    contests : sequence of Contest
        Held so far.
    shelf_terms : mapping of str to PhysicsTerm
    given : int
        Terms of the nominal model.
    most : int
        Terms that may join at most.

    Returns
    -------
    Round
        The model in hand, the one that was given where it is no likelier.
    list of Contest
        All that were held.
    """
    floor = effort_floor(first.stand)
    anew = settle(hand.stand, hand.fitted.model, hand.fitted.knobs, floor)
    for place in range(given, len(anew.fitted.model.physics)):
        anew = settled_onset(anew, place, floor)
    if likelier(anew, hand) <= 0:
        return hand, list(contests)
    won = [contest for contest in contests if contest.winner is not None]
    return _rounds(first, anew, won, shelf_terms, given, most, stepped=False)[1:]


def _rounds(
    first: Round,
    hand: Round,
    held: Sequence[Contest],
    shelf_terms: Mapping[str, PhysicsTerm],
    given: int,
    most: int,
    stepped: bool,
) -> tuple[Round, Round, list[Contest]]:
    floor, contests = effort_floor(first.stand), list(held)
    left = share_missing(hand, first, floor) if contests else 1.0
    while True:
        hand = exact(hand)
        first = first if contests else hand
        contest, settled = contend(hand, shelf_terms, floor, given, least_promise(hand, first, left))
        restated = hand if settled is None and leaves_nothing(hand, floor) else rewritten(hand, given, floor)
        turns = settled is not None and "smooth_rad_s" in settled.fitted.model.physics[-1].values
        if restated is not hand and (settled is None or turns or likelier(restated, settled) > 0):
            hand = restated
            continue
        timed = shifted(hand, floor) if stepped else hand
        if timed is not hand and (settled is None or is_as_likely(timed, settled, hand, floor)):
            if contests:
                first = exact(shifted_as(timed, first, floor))
            hand = timed
            continue
        if settled is not None and contest.winner is None:
            hand = settled
            continue
        contests.append(contest)
        if settled is None:
            return first, hand, contests
        before, hand = hand, simplified(settled, given)
        if only_mends_flanks(hand, given, shelf_terms):
            return first, before, contests
        for place, use in list(enumerate(hand.fitted.model.physics))[given:-1]:  # beside what has come since
            hand = settled_onset(hand, place, floor)
            hand = relawed(hand, place, shelf_terms[use.term], floor)
            hand = retuned(hand, place, shelf_terms[use.term], floor)
        left = share_missing(hand, first, floor)
        unsaid = float(np.exp(-likelier(hand, first) / hand.stand.told))
        if is_over(len(contests), hand.fitted.model.physics[given:], left, unsaid, most):
            return first, exact(hand), contests


def share_missing(hand: Round, first: Round, floor: Array) -> float:
    """Share of the torque missing beside the parameters only that is missing yet."""
    return missing(hand, floor) / max(missing(first, floor), 1e-300)


def least_promise(hand: Round, first: Round, left: float) -> float:
    """Log-likelihood that regression must promise a further term.

    The linear observer of a gearbox that plays makes noise of its own, which is not white, and the fit stops in one of
    many places. Beside 20 plays what there was had been promised 1.66 % and more of what the model in hand had gained,
    and what there was not up to 1.3 % of plays that gained more than 15,000.

    Parameters
    ----------
    hand : Round
        The model in hand.
    first : Round
        Parameters only.
    left : float
        Share of the missing torque that is left.
    """
    least = LEAST if left < TRIVIAL else 0.0
    return max(least, PROMISED * likelier(hand, first)) if plays(hand.fitted.model) else least


def is_over(won: int, found: Sequence[TermUse], left: float, unsaid: float, most: int) -> bool:
    """Whether no further term is looked for: there are enough, or they are pieces of something else.

    Parameters
    ----------
    won : int
        Contests that a term has won.
    found : sequence of TermUse
        What came of them.
    left : float
        Share of the missing torque that is left beside these.
    unsaid : float
        Share of what is unforeseen of a value that is left. A cogging and a spring that stiffens took next to nothing
        off the missing torque beside a bristle of twice their size, and gained 34,000 together.
    most : int
        Terms that may join at most.
    """
    if won >= most or pieces_of(found) >= PIECES or (won >= MAIN and left > DETAIL):
        return True
    return won > 1 and min(left, unsaid) > NOTHING and not any(is_sensor(use.term) for use in found)


def is_dated(hand: Round, given: int, floor: Array) -> bool:
    """Whether what sets in accounts for most of what the model in hand would lack without it."""
    begun = [i for i, use in enumerate(hand.fitted.model.physics) if i >= given and use.onset is not None]
    model, knobs, _ = without_terms(hand.fitted, begun)
    return missing(hand, floor) < DATED * missing(settle(hand.stand, model, knobs, floor), floor)


def pieces_of(found: Sequence[TermUse]) -> int:
    """Count what sets in."""
    return sum(use.onset is not None for use in found)


def rewritten(hand: Round, given: int, floor: Array) -> Round:
    """Try the terms that the nominal model holds by another law of their name; they all are on the shelf."""
    terms = shelf("gsfdi.terms", PhysicsTerm)
    for place in range(given):
        hand = relawed(hand, place, terms[hand.fitted.model.physics[place].term], floor)
    return hand


def opening(stand: Bench, model: JointModel, level: float) -> Round:
    """Fit the parameters only; for the arguments see `compete`."""
    knobs = [*plant_knobs(model, stand.records[0].effort), *start_knobs(stand)]
    if level > 0:
        last = len(model.physics)
        places = range(last - len(levels(stand)), last)
        knobs += [Knob(place, "torque_nm", level, -20 * level, 20 * level, 0.0, level) for place in places]
    floor = effort_floor(stand)
    return exact(from_below(settle(stand, started(model, len(stand.records)), knobs, floor), floor))


def contend(
    hand: Round, shelf_terms: Mapping[str, PhysicsTerm], floor: Array, given: int, promised: float = 0.0
) -> tuple[Contest, Round | None]:
    """Hold one round: screen every offer, refit the finalists, settle the best, and test the winner against luck.

    While much is missing every term is judged under a large noise, where the true one is hardly better than its
    likes. So the best few are settled each under the noise that suits it, and the likeliest wins. Only what regression
    promises at least `promised` may compete. Beside no winner there may be the model in hand, fitted better.
    """
    screening = screen(hand, all_offers(hand, shelf_terms, given))
    able = [entry for entry in screening.entries if entry.linear >= promised]
    finalists = [*finalists_of(able), *beside_positions(screening.entries, hand.stand)]
    ranked = credible(hand, screening, refits(hand, finalists))
    trials = len(screening.information)
    fair = [fairly(hand, e, shelf_terms) if merit(e) > LEAST else e for e in ranked]
    hope = np.inf if leaves_nothing(hand, floor) else LEAST
    hopeful = {id(one) for one, whole in zip(fair, ranked, strict=True) if merit(whole) > hope}
    ranked = sorted(fair, key=merit, reverse=True)
    near = [e for e in needed(ranked) if merit(e) > NEAR * merit(ranked[0]) and matters(hand, e)]
    worthy = [e for e in near if merit(e) > min(e.bar, WORTH) or id(e) in hopeful]
    best: tuple[tuple[bool, float], Entry, Round] | None = None
    beyond, behind = set[tuple[str, str | None]](), set[tuple[str, str | None]]()
    for entry in to_settle(worthy, shelf_terms):
        assert entry.fitted is not None
        rival = pursued(hand, entry.fitted, best[2] if best else None, floor)
        if best and is_beyond(best[2], rival, hand, floor):
            beyond.add((entry.offer.term, entry.offer.side))
            continue
        if isinstance(rival, Turn):
            behind.add((entry.offer.term, entry.offer.side))
            continue
        settled, owed = shaped(rival, hand, entry, shelf_terms[entry.offer.term], floor)
        settled = settled and unstretched(settled, hand, floor)
        settled = settled and shared_anew(settled, given, shelf_terms, floor)
        settled = settled and paired_anew(settled, given, shelf_terms, floor)
        if settled is None or is_another(settled, shelf_terms):
            continue
        gain, least = likelier(settled, hand) - cost_of(entry) - owed, settled_bar(settled, entry, trials)
        if merit(entry) < entry.bar and gain < max(least, WORTH):
            continue
        rank = (gain > CLEAR * least, gain)
        if rank > (best[0] if best else (False, 0.0)):  # one that gains nothing only moves the mismatch about
            best = (rank, entry, settled)
    entries = (*ranked, *screening.entries)
    if best is None:
        return undecided(hand, screening, entries, shelf_terms), None
    _, winner, settled = best
    left = loosened(hand, winner, settled, shelf_terms, floor)
    if left is not settled:
        return undecided(hand, screening, entries, shelf_terms), None if left is hand else left
    contest = Contest(entries, winner, trials, beyond=frozenset(beyond), far=frozenset(behind))
    return contest, exact(from_above(from_below(settled, floor), floor))


def pursued(hand: Round, fitted: Fitted, best: Round | None, floor: Array) -> Round | Turn:
    """Settle what was fitted, unless it stays far behind the best so far at a glance or in its first turn.

    Where there is none yet, it is settled whatever its first turn gains: a Stribeck friction came from -1039 to 1897.
    """
    if best is None:
        return settle(hand.stand, fitted.model, fitted.knobs, floor)
    most, glance = likelier(best, hand), at_a_glance(hand, fitted, floor)
    if likelier(glance, hand) < GLANCED * most:
        return glance
    turn = coarse(hand.stand, fitted.model, fitted.knobs, floor)
    return turn if likelier(turn, hand) < EARLY * most else refined(turn, floor)


def loosened(hand: Round, winner: Entry, settled: Round, shelf_terms: Mapping[str, PhysicsTerm], floor: Array) -> Round:
    """Take out a winner that regression had not promised, and that gains as much where it does nothing.

    A fit that is stuck is loosened by any further term: a position gain of 0.91 gained 1400 beside a payload that was
    a third off. And a joint that sticks is stepped otherwise beside some terms, and slips a sample sooner or later: a
    wave of 8e-9 rad gained 290, a gearbox damping of nothing 190.

    Returns
    -------
    Round
        `settled` where the winner is no such one; the model in hand with what came beside the winner where that gains
        without it; `hand` where it gains with it only, which is of no use.
    """
    use = idle(settled.fitted.model.physics[-1], shelf_terms)
    if use is None or winner.gain < UNPROMISED * winner.linear:
        return settled
    place, model = len(hand.fitted.model.physics), settled.fitted.model
    bare, knobs, _ = without_terms(settled.fitted, [place])
    enough = IDLE * likelier(settled, hand)
    without = settle(hand.stand, bare, knobs, floor)
    if likelier(without, hand) > enough:
        return without
    return hand if likelier(settle(hand.stand, model.with_use(place, use), knobs, floor), hand) > enough else settled


def to_settle(ranked: Sequence[Entry], shelf_terms: Mapping[str, PhysicsTerm]) -> list[Entry]:
    """The best entries of so many terms, and the best that is there from the start if all of these set in.

    What a joint meets but once, as a stop at the end of its way, looks like much that sets in. Those that have gone as
    far as is plausible come last: where three frictions are missing, a drive that moves hardly anything leads them all.
    Under a large noise likes are level: a weight was the fifth, by 0.3 %, and won once it was settled.
    """
    ranked = sorted(ranked, key=lambda e: e.fitted is not None and is_at_bound(e.fitted, shelf_terms))
    least = LEVEL * max(map(merit, ranked), default=0.0)
    level = distinct([entry for entry in ranked if merit(entry) > least], FINALISTS, onsets=False)
    found = max(distinct(ranked, SETTLED, onsets=False), level, key=len)
    if all(entry.onset is not None for entry in found):
        found += [entry for entry in ranked if entry.onset is None][:1]
    return found


def shaped(settled: Round, hand: Round, entry: Entry, term: PhysicsTerm, floor: Array) -> tuple[Round | None, float]:
    """Give a settled finalist its onset and its shapes; none if it gains nothing, or leads the simulation astray.

    Of what another law or a detail of it gains it owes a part while something else is missing, which that may suit.
    """
    last = len(hand.fitted.model.physics)
    settled = settled_onset(settled, last, floor)
    if likelier(settled, hand) <= 0:
        return None, 0.0
    plain = reordered(retuned(swung(settled, last, term, floor), last, term, floor), last, term, floor)
    other = relawed(plain, last, term, floor)
    found = reshaped(other, term, floor)
    most = SILENCED if term.place in SILENCERS else STRAYS
    if strays(hand.stand, hand.fitted.model, found.fitted.model, most=most):
        return None, 0.0
    return found, 0.0 if leaves_nothing(other, floor) else OWED * likelier(other, plain)


def unstretched(settled: Round, hand: Round, floor: Array) -> Round:
    """Fit what was settled once more, details of earlier terms that it stretches as far as may be held as they were.

    A drag was a friction at a place as yet; beside a cogging it turned round as smoothly as a friction may.
    """
    stretched = {(k.place, k.name) for k in stretched_knobs(settled.fitted) if k.place < len(hand.fitted.model.physics)}
    if not stretched:
        return settled
    knobs = [knob for knob in settled.fitted.knobs if (knob.place, knob.name) not in stretched]
    model = settled.fitted.model
    for place, name in stretched:
        use = model.physics[place]
        before = hand.fitted.model.physics[place].values[name]
        model = model.with_use(place, replace(use, values={**use.values, name: before}))
    return settle(settled.stand, model, knobs, floor)


def is_another(settled: Round, shelf_terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether the last term of a model is not what its name says, but stands for another or mends one."""
    scales = settled.stand.scales
    at_once = scales.torque / scales.inertia * scales.period
    model = settled.fitted.model
    return (
        is_at_bound(settled.fitted, shelf_terms) or only_turns(model, at_once) or never_slips(model.physics[-1], scales)
    )


def is_beyond(best: Round, rival: Round | Turn, hand: Round, floor: Array) -> bool:
    """Whether no other onset or shape of the rival brings it up to the best, which explains all, or nearly all.

    A rival that has taken its first turn only must be the farther behind.
    """
    gained, most = likelier(rival, hand), likelier(best, hand) * (EARLY if isinstance(rival, Turn) else 1.0)
    if leaves_nothing(best, floor):
        return gained < most
    return gained < FAR * most and missing(best, floor) < TRIVIAL * missing(hand, floor)


def undecided(
    hand: Round, screening: Screening, entries: Sequence[Entry], shelf_terms: Mapping[str, PhysicsTerm]
) -> Contest:
    """Lay out a round that nobody won, with the least of every term that would have."""
    least = smallest(hand, screening, shelf_terms, CHANCE, MATERIAL)
    return Contest(tuple(entries), None, len(screening.information), least)
