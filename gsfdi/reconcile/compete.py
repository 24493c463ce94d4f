"""Terms of physics compete for what the model in hand leaves unexplained, contest after contest (`contest.contend`)."""

from collections.abc import Mapping, Sequence

import numpy as np

from gsfdi.fit import Knob
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.contest import TRIVIAL, Contest, contend
from gsfdi.reconcile.driving import levels
from gsfdi.reconcile.finalists import settled_onset
from gsfdi.reconcile.forms import plainer, relawed, retuned
from gsfdi.reconcile.hand import (
    Round,
    exact,
    from_below,
    is_sensor,
    leaves_nothing,
    likelier,
    missing,
    plays,
    settle,
    started,
    without_terms,
)
from gsfdi.reconcile.knobs import plant_knobs, start_knobs
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.offering import possible
from gsfdi.reconcile.screen import LEAST
from gsfdi.reconcile.simpler import simplified
from gsfdi.reconcile.ticks import is_as_likely, is_of_one_signal, shifted, shifted_as
from gsfdi.reconcile.trifles import only_mends_flanks
from gsfdi.reconcile.window import dating_window, typical_window
from gsfdi.registry import shelf
from gsfdi.types import Array

PROMISED = 0.015
"""Share of what has been gained beside a play that regression must promise a further term (see `least_promise`)."""
MOST = 5
"""Terms that may join at most."""
MAIN = 3
"""Terms that must account for most of what is missing before a further one may join."""
DETAIL = 0.2
"""Share of the missing torque up to which what is left is a detail that one may refine."""
STALLED = 0.1
"""Share of the missing torque from which terms that take nothing off it are pieces of something else."""
NOTHING = 0.9
"""Share of the missing torque, and of what is unforeseen, from which two terms explain nothing, nor would a third."""
DATED = 0.5
"""Share of what is missing without all that sets in up to which it matters when that does."""
PIECES = 3
"""Terms that set in which are pieces of something else: no further one is looked for."""


def compete(
    first: Round, model: JointModel, shelf_terms: Mapping[str, PhysicsTerm], level: float = 0.0
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
    first, hand, contests = rounds(first, shelf_terms, given)
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
    return rounds(first, shelf_terms, given)


def rounds(first: Round, shelf_terms: Mapping[str, PhysicsTerm], given: int) -> tuple[Round, Round, list[Contest]]:
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
    """
    opened = first
    first, hand, contests = _rounds(first, first, (), shelf_terms, given, stepped=True)
    if is_of_one_signal(hand, effort_floor(hand.stand)):
        return _rounds(opened, opened, (), shelf_terms, given, stepped=False)
    return first, hand, contests


def resumed(
    first: Round,
    hand: Round,
    contests: Sequence[Contest],
    shelf_terms: Mapping[str, PhysicsTerm],
    given: int,
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
    return _rounds(first, anew, won, shelf_terms, given, stepped=False)[1:]


def _rounds(
    first: Round,
    hand: Round,
    held: Sequence[Contest],
    shelf_terms: Mapping[str, PhysicsTerm],
    given: int,
    stepped: bool,
) -> tuple[Round, Round, list[Contest]]:
    floor, contests = effort_floor(first.stand), list(held)
    left = [share_missing(hand, first, floor) if contests else 1.0]
    while True:
        hand = exact(hand)
        first = first if contests else hand
        contest, settled = contend(hand, shelf_terms, floor, given, least_promise(hand, first, left[-1]))
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
        hand = plainer(hand, floor)
        if is_as_before(hand, before):
            return first, before, contests
        for place, use in list(enumerate(hand.fitted.model.physics))[given:-1]:  # beside what has come since
            hand = settled_onset(hand, place, floor)
            hand = relawed(hand, place, shelf_terms[use.term], floor)
            hand = retuned(hand, place, shelf_terms[use.term], floor)
        left.append(share_missing(hand, first, floor))
        unsaid = float(np.exp(-likelier(hand, first) / hand.stand.told))
        if is_over(len(contests), hand.fitted.model.physics[given:], left, unsaid):
            return first, exact(hand), contests


def is_as_before(hand: Round, before: Round) -> bool:
    """Whether nothing has come of a contest, so that every other would end as it did: what won was dropped again."""
    kinds = [[(use.term, use.side) for use in one.fitted.model.physics] for one in (hand, before)]
    return kinds[0] == kinds[1] and likelier(hand, before) < LEAST


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


def is_over(won: int, found: Sequence[TermUse], left: Sequence[float], unsaid: float) -> bool:
    """Whether no further term is looked for: there are enough, or they are pieces of something else.

    Parameters
    ----------
    won : int
        Contests that a term has won.
    found : sequence of TermUse
        What came of them.
    left : sequence of float
        Share of the missing torque that is left, by term that came; what is left beside all of them is the last.
    unsaid : float
        Share of what is unforeseen of a value that is left. A cogging and a spring that stiffens took next to nothing
        off the missing torque beside a bristle of twice their size, and gained 34,000 together.
    """
    if won >= MOST or pieces_of(found) >= PIECES or (won >= MAIN and (left[-1] > DETAIL or stalls(left))):
        return True
    return won > 1 and min(left[-1], unsaid) > NOTHING and not any(is_sensor(use.term) for use in found)


def stalls(left: Sequence[float]) -> bool:
    """Whether the last two terms took nothing off the share of the missing torque that is `left`, and it is no detail.

    Beside a weight, in the place of a friction that differs by direction, a bristle, a load and a cable gained 250 to
    380 each, for three minutes, and 0.18 of it was left from the first to the last.
    """
    return len(left) > 2 and STALLED < left[-3] <= left[-1]


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
