"""What the data tell of two numbers together where they tell little of each alone.

Multiply torque constant, stiffness, both inertias and every torque by one number, and nothing changes that is measured:
each is known as the nominal model knows it, and over the torque constant far better. A loop that never levels off has a
slope, its torque over its width, though neither is known.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from gsfdi.fit import Knob
from gsfdi.modelfile.keys import KEYS, spelling
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.offering import SIMULATED
from gsfdi.reconcile.say import spelled
from gsfdi.reconcile.turning import is_torque, spread_of
from gsfdi.registry import shelf

PLANT = {key.field: key for key in KEYS["plant"]}
"""Keys of a model file's plant by the field that they set."""
KNOWN = 0.01
"""Standard deviation of a number, as a share of it, up to which it is known well enough by itself."""
NARROWER = 0.2
"""The same of a quotient or a product, over that of the better known of the two, from which it is worth telling."""


class Pair(NamedTuple):
    """Places of two numbers among the knobs, whether one is divided by the other, and how well that is known."""

    one: int
    other: int
    divided: bool
    spread: float


def together(hand: Round, given: int) -> list[dict[str, Any]]:
    """Quotients and products of two numbers that are known at least five times as well as either.

    Parameters
    ----------
    hand : Round
        The model with everything that was found.
    given : int
        Terms of the nominal model, whose numbers are not asked for.

    Returns
    -------
    list of mapping
        ``of``, the two names with ``/`` or ``·`` between them, ``value`` and ``ci95``. The best known comes first, and
        none follows from those before it.

    Notes
    -----
    Of relative errors x and y with the covariance c of the fit, x - y has the variance σx² + σy² - 2c, and x + y that
    with the other sign.
    """
    fitted = hand.fitted
    places = [i for i, knob in enumerate(fitted.knobs) if is_size(hand, knob, given) and fitted.values[i] != 0.0]
    found, linked = [], {place: place for place in places}
    for pair in sorted(pairs(hand, places), key=lambda pair: pair.spread):
        if linked[pair.one] == linked[pair.other]:
            continue
        joined, kept = linked[pair.other], linked[pair.one]
        linked = {place: kept if root == joined else root for place, root in linked.items()}
        one, other = fitted.values[pair.one], fitted.values[pair.other]
        value = float(one / other if pair.divided else one * other)
        width = 1.96 * float(np.hypot(pair.spread, SIMULATED)) * abs(value)
        names = [name_of(hand, fitted.knobs[place]) for place in (pair.one, pair.other)]
        of = (" / " if pair.divided else " · ").join(names)
        found.append({"of": of, "value": value, "ci95": [value - width, value + width]})
    return found


def pairs(hand: Round, places: list[int]) -> Iterator[Pair]:
    """Quotients and products that are known far better than the numbers in them."""
    if len(places) < 2:
        return
    values = hand.fitted.values[places]
    relative = spread_of(hand.fitted, hand.stand.blocks())[np.ix_(places, places)] / np.outer(values, values)
    alone = np.sqrt(np.diag(relative))
    for i, j in combinations(range(len(places)), 2):
        for way, divided in ((-2.0, True), (2.0, False)):
            spread = float(np.sqrt(max(relative[i, i] + relative[j, j] + way * relative[i, j], 0.0)))
            if min(alone[i], alone[j]) > max(KNOWN, spread / NARROWER):
                yield Pair(places[i], places[j], divided, spread)


def is_size(hand: Round, knob: Knob, given: int) -> bool:
    """Whether a knob sizes something: a number of the plant, or one of a found term that has a scale."""
    if knob.place == -1:
        return knob.name in PLANT
    if knob.place < given or knob.name == "onset":
        return False
    param = shelf("gsfdi.terms", PhysicsTerm)[hand.fitted.model.physics[knob.place].term].param(knob.name)
    return param.kind == "plain" and (param.low >= 0.0 or is_torque(knob, hand.fitted.model))


def name_of(hand: Round, knob: Knob) -> str:
    """Name a number as the updated model's file does: a key of its plant, or term, side and parameter."""
    axis = hand.stand.model.axis
    if knob.place == -1:
        return spelling(PLANT[knob.name], axis)
    use = hand.fitted.model.physics[knob.place]
    return ".".join(filter(None, (use.term, use.side, spelled(knob.name, axis))))
