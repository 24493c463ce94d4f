"""What competes in a round: every form of every term that could act in this joint and show beside its effort."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.doubted import moot_terms
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.modes import worthy_frequencies
from gsfdi.reconcile.offer import SHARE, Offer, offers
from gsfdi.reconcile.surplus import lowered
from gsfdi.reconcile.ticks import moot_by_shift
from gsfdi.reconcile.waves import worthy_orders

OF_THE_LAW = frozenset({"current_gain", "velocity_bias", "velocity_gain", "velocity_lag"})
"""Terms that say no more, where the law told the speed, than that the law is another."""
TRIED = 3.0
"""Times the torque that is missing at which a term is tried."""
FEWEST = 5.0
"""Times the least torque worth a name at which a term is tried at least."""
MATERIAL = 2e-4
"""Share of the drive's torque below which an effect is not worth a name: it may be the simulator's own."""
SIMULATED = 1.5e-3
"""Standard deviation that sampling, holding and the simulator's own steps leave in a number, as a share of it."""


def possible(stand: Bench, shelf_terms: Mapping[str, PhysicsTerm], level: float) -> dict[str, PhysicsTerm]:
    """Terms that say something on this bench; for `level` see `gsfdi.reconcile.compete.compete`."""
    moot = moot_terms(stand.model) | (OF_THE_LAW if stand.lever > 0 else frozenset())
    shows = {name for name, term in shelf_terms.items() if stand.scales.returns or not term.sided}
    terms = {name: term for name, term in shelf_terms.items() if name in shows - moot}
    return beside_the_law(terms) if level > 0 else terms


def beside_the_law(shelf_terms: Mapping[str, PhysicsTerm]) -> dict[str, PhysicsTerm]:
    """Terms that are possible where the effort is the law's own: its sensor errs by a constant at most, and always."""
    return {
        name: replace(term, sets_in="never") if name == "current_bias" else term
        for name, term in shelf_terms.items()
        if name != "current_gain"
    }


def share_to_try(hand: Round) -> float:
    """Share of what is usual at which terms are tried: no farther above what is missing than the plant may hide.

    Where a joint sticks, a friction far larger than the true one moves every stop, and its signature is that.
    """
    missing_share = float(np.linalg.norm(hand.torque)) / hand.stand.scales.torque
    return float(np.clip(TRIED * missing_share, FEWEST * MATERIAL, SHARE))


def all_offers(hand: Round, shelf_terms: Mapping[str, PhysicsTerm], given: int, alone: bool = False) -> list[Offer]:
    """Every offer of every term that could act in this joint, show beside its recorded effort, and is not there yet.

    Those that `alone` are asked for are of terms that otherwise come beside another which is not there.
    """
    stand = hand.stand
    names, moot = {use.term for use in hand.fitted.model.physics}, moot_by_shift(hand.fitted)
    able = [
        term
        for term in shelf_terms.values()
        if term.name not in moot
        if stand.model.structure in term.structures and stand.model.axis in term.axes
        if names.issuperset(term.beside) is not alone
    ]
    searched = any(term.order or term.frequency for term in able)  # which takes a second
    worthy = {**worthy_orders(hand), **worthy_frequencies(hand)} if searched else {}
    found = [offer for term in able for offer in offers(term, stand.scales, worthy, share_to_try(hand))]
    if stand.model.structure == "rigid":
        found = [replace(o, side=None) for o in found if o.side != "motor"]
    held = hand.fitted.model.physics[:given]
    found = [lowered(offer, stand.model, shelf_terms[offer.term], held) for offer in found]
    there = {(u.term, u.side) for u in hand.fitted.model.physics[given:] if not shelf_terms[u.term].several}
    return [o for o in found if (o.term, o.side) not in there]
