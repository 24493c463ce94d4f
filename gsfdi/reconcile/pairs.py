"""Two loads that depend on the place, and look like a third while only one is there: which two of them they are.

Over half a turn a weight and a harness that pulls together are a larger weight, beside which the harness is a wave of
order 2. Each by itself is where it fits best; only both at once lead to the other two. In a joint under control the
place hardly changes, so that regression tells what each two would leave.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from gsfdi.model import TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.forms import in_place
from gsfdi.reconcile.hand import Round, exact, likelier, project, with_term, without_terms
from gsfdi.reconcile.offer import Offer, offers
from gsfdi.reconcile.offering import share_to_try
from gsfdi.types import Array

BY_PLACE = ("cable_harness", "cogging", "constant_load", "gravity_unbalance")
"""Loads that depend on nothing but the place."""
ONE = {"cable_harness", "constant_load"}
"""Two of them that are one: a harness that rests elsewhere."""
BESIDE = (-1.0, 0.0, 1.0)
"""Orders tried, from that of a wave which one of the two is."""
SETTLED = 2
"""Pairs that are settled."""


def paired_anew(hand: Round, given: int, shelf_terms: Mapping[str, PhysicsTerm], floor: Array) -> Round:
    """Put two other loads in the place of the last term and of one found before it, where that is likelier.

    Parameters
    ----------
    hand : Round
        The model in hand, its last term just settled.
    given : int
        Terms of the nominal model.
    shelf_terms : mapping of str to PhysicsTerm
    floor : (n,) array
        Noise of the effort, see :func:`gsfdi.reconcile.noise.effort_floor`.
    """
    physics = hand.fitted.model.physics
    end, best = len(physics) - 1, hand
    places = [place for place in range(given, end) if physics[place].term in BY_PLACE]
    if not places or physics[end].term not in BY_PLACE:
        return hand
    hand = exact(hand)
    for place in places:
        for one, other in likeliest_pairs(hand, (place, end), shelf_terms):
            settled = in_place(hand, {place: one, end: other}, floor)
            best = settled if likelier(settled, best) > 0 else best
    return best


def likeliest_pairs(
    hand: Round, places: tuple[int, int], shelf_terms: Mapping[str, PhysicsTerm]
) -> Iterator[tuple[TermUse, TermUse]]:
    """Give the pairs that leave least in the places of two terms, none of these two themselves."""
    had = [hand.fitted.model.physics[place] for place in places]
    tried = list(loads(hand, had, shelf_terms))
    left, signatures = signatures_of(hand, places, tried)
    edges = np.cumsum([0, *(len(offer.columns) for offer in tried)])
    rows = [np.arange(*ends) for ends in pairwise(edges)]
    found: list[tuple[float, tuple[TermUse, TermUse]]] = []
    for i, j in combinations(range(len(tried)), 2):
        one, other = tried[i], tried[j]
        if one.term == other.term or {one.term, other.term} in (ONE, {use.term for use in had}):
            continue
        both = signatures[[*rows[i], *rows[j]]]
        c: Array = np.asarray(np.linalg.lstsq(both.T, -left, rcond=None)[0], dtype=np.float64)
        first, second = one.mix(c[: len(rows[i])]), other.mix(c[len(rows[i]) :])
        if first is not None and second is not None:
            gain = -0.5 * float(c @ both @ (2 * left + c @ both))
            found.append((gain, (one.use(first), other.use(second))))
    yield from (pair for _, pair in sorted(found, key=lambda one: -one[0])[:SETTLED])


def signatures_of(hand: Round, places: tuple[int, int], tried: Sequence[Offer]) -> tuple[Array, Array]:
    """Innovations without the terms at two places, and what each column of the offers adds, less what knobs take over.

    Loads of the model stay as they are: they would take over where a harness rests.
    """
    fitted = hand.fitted
    model, knobs, keep = without_terms(fitted, places)
    free = [i for i, k in enumerate(knobs) if k.place < 0 or model.physics[k.place].term not in BY_PLACE]
    uses = [offer.use(values) for offer in tried for values in offer.columns]
    left, *moved = hand.misfit([model, *(with_term(model, use) for use in uses)])
    kept = [keep[i] for i in free]
    rest = replace(fitted, model=model, knobs=tuple(knobs[i] for i in free), values=fitted.values[kept], residual=left)
    bare = replace(hand, fitted=replace(rest, jacobian=fitted.jacobian[:, kept]))
    return left, project(bare, np.array(moved) - left)[0]


def loads(hand: Round, had: Sequence[TermUse], shelf_terms: Mapping[str, PhysicsTerm]) -> Iterator[Offer]:
    """Offer every load by the place, as waves those near the ones that were had; one of a turn would be a weight."""
    model, shares = hand.stand.model, share_to_try(hand)
    near = {round(use.values["order"]) + step for use in had if "order" in use.values for step in BESIDE}
    orders = sorted(order for order in near if order * model.plant.gear_ratio > 1.0)
    for term in (shelf_terms[name] for name in BY_PLACE if name in shelf_terms):
        if model.axis in term.axes:
            for offer in offers(term, hand.stand.scales, {term.name: orders}, shares):
                yield replace(offer, side=None) if model.structure == "rigid" else offer
