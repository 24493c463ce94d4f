"""Terms of physics compete for what the model in hand leaves unexplained.

Every offer's signature is the change of the white innovations when the term is switched on in a replay. A linear
regression on signature and plant together says how much of the log-likelihood the term could gain, from the start or
from an onset on. The best are then refitted by replay, all numbers at once, and the winner joins the model if its gain
beats what chance would give the luckiest of all offers on this very motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.fit import Fitted, Knob
from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench, effort_floor
from gsfdi.reconcile.calibrate import luckiest
from gsfdi.reconcile.hand import Round, lay_out, plant_knobs, settle, start_knobs, started
from gsfdi.reconcile.offer import Offer, offers
from gsfdi.reconcile.remainder import missing_torque
from gsfdi.reconcile.screen import ONSET_COST, Entry, refit, screen
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.reconcile.waves import worthy_orders
from gsfdi.types import Array

FINALISTS = 6
MATERIAL = 2e-3
"""Share of the drive's torque below which an effect is not worth a name: it may be the simulator's own."""
TRIVIAL = 0.02
"""Share of the missing torque below which no further term is looked for."""
SURE = 0.995
"""Share of null draws whose luckiest offer a winner must beat."""
KNOB_COST = 4.0
"""Log-likelihood that each number of a term must earn: half the logarithm of the number of samples, nearly."""
ELSEWHERE = ("quantisation", "current_limit", "timestamp_latency")
"""Terms that show in the controller's law or in the values themselves, not in the mechanics."""


@dataclass(frozen=True, slots=True)
class Contest:
    """One round as it went: who competed, who won, and what chance would have given the luckiest."""

    entries: tuple[Entry, ...]
    winner: Entry | None
    luck: Array


def compete(
    stand: Bench, model: JointModel, shelf_terms: Mapping[str, PhysicsTerm], level: float = 0.0, most: int = 3
) -> tuple[Round, Round, list[Contest]]:
    """Let terms join the model until chance explains the best of what is left.

    Parameters
    ----------
    stand : Bench
        The recordings, set up for replays.
    model : JointModel
        Where the competition starts: the nominal model, its contract with the recordings settled.
    shelf_terms : mapping of str to PhysicsTerm
        Terms that may compete.
    level : float
        Doubt about the constant load that is the last term of `model` [N m]; 0 where it is not there.
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
    floor = effort_floor(stand)
    knobs = [*plant_knobs(model, stand.records[0].effort), *start_knobs(stand)]
    if level > 0:
        knobs.append(Knob(len(model.physics) - 1, "torque_nm", level, -20 * level, 20 * level, 0.0, level))
    first = hand = settle(stand, started(model, len(stand.records)), knobs, floor)
    contests: list[Contest] = []
    while True:
        contest = contend(hand, shelf_terms)
        contests.append(contest)
        if contest.winner is None:
            return first, hand, contests
        fitted = contest.winner.fitted
        assert fitted is not None
        better = simplified(settle(stand, fitted.model, fitted.knobs, floor), len(model.physics))
        if missing(better, floor) > 1.2 * missing(hand, floor):  # it only moved the mismatch about
            contests[-1] = replace(contest, winner=None)
            return first, hand, contests
        hand = better
        if len(contests) >= most or missing(hand, floor) < TRIVIAL * missing(first, floor):
            return first, hand, contests


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
        hand = replace(lay_out(hand.stand, hand.tools, fitted), torque=hand.torque)


def _price(hand: Round, place: int) -> float:
    use = hand.fitted.model.physics[place]
    return KNOB_COST * (len(use.values) + (2 if use.onset is not None else 0)) + 3.0


def _sets_in(hand: Round, place: int) -> bool:
    return hand.fitted.model.physics[place].onset is not None


def without(hand: Round, place: int) -> Fitted:
    """Refit the model in hand without the term at `place`."""
    fitted = hand.fitted
    model = replace(fitted.model, physics=(*fitted.model.physics[:place], *fitted.model.physics[place + 1 :]))
    keep = [i for i, k in enumerate(fitted.knobs) if k.place != place]
    knobs = [replace(fitted.knobs[i], place=fitted.knobs[i].place - (fitted.knobs[i].place > place)) for i in keep]
    return fit_knobs(hand.misfit, model, knobs, 3, fitted.jacobian[:, keep])


def always(hand: Round, place: int) -> Fitted:
    """Refit the model in hand with the term at `place` there from the start."""
    fitted = hand.fitted
    use = replace(fitted.model.physics[place], onset=None)
    model = replace(fitted.model, physics=(*fitted.model.physics[:place], use, *fitted.model.physics[place + 1 :]))
    return fit_knobs(hand.misfit, model, fitted.knobs, 4)


def contend(hand: Round, shelf_terms: Mapping[str, PhysicsTerm]) -> Contest:
    """Hold one round: screen every offer, refit the finalists, and test the winner against luck."""
    candidates = all_offers(hand, shelf_terms)
    screening = screen(hand, candidates)
    finalists = [refit(hand, entry) for entry in distinct(screening.entries, FINALISTS)]
    ranked = sorted(finalists, key=merit, reverse=True)
    if not ranked or ranked[0].fitted is None:
        return Contest(tuple(screening.entries), None, np.zeros(1))
    luck = luckiest(screening.bare, screening.information, ranked[0].fitted.residual, hand.stand.blocks())
    bar = float(np.quantile(luck, SURE)) + (ONSET_COST if ranked[0].onset is not None else 0.0)
    won = merit(ranked[0]) > bar and size_of(hand, ranked[0].fitted) > MATERIAL
    return Contest((*ranked, *screening.entries), ranked[0] if won else None, luck)


def size_of(hand: Round, fitted: Fitted) -> float:
    """Torque that a fitted model has and the one in hand lacks, root mean square, as a share of the drive's."""
    new = hand.stand.innovations([fitted.model])
    moved = [old - e[0] for old, e in zip(hand.innovations, new, strict=True)]
    torque = np.concatenate(missing_torque(hand.stand, moved))
    return float(np.sqrt(np.mean(torque**2))) / hand.stand.scales.torque


def merit(entry: Entry) -> float:
    """Gain in log-likelihood less what its numbers cost."""
    count = len(entry.offer.columns[0]) + (2 if entry.onset is not None else 0)
    return entry.gain - KNOB_COST * count if np.isfinite(entry.gain) else -np.inf


def distinct(entries: Sequence[Entry], most: int) -> list[Entry]:
    """The best entry of each term and side."""
    seen: dict[tuple[str, str | None], Entry] = {}
    for entry in entries:
        seen.setdefault((entry.offer.term, entry.offer.side), entry)
    return list(seen.values())[:most]


def all_offers(hand: Round, shelf_terms: Mapping[str, PhysicsTerm]) -> list[Offer]:
    """Every offer of every term that could act in this joint and show beside its recorded effort."""
    stand = hand.stand
    orders = worthy_orders(hand)
    found = [
        offer
        for term in shelf_terms.values()
        if stand.model.structure in term.structures and term.name not in ELSEWHERE
        for offer in offers(term, stand.scales, orders)
    ]
    rigid = stand.model.structure == "rigid"
    return [replace(o, side=None) if rigid else o for o in found if not rigid or o.side != "motor"]
