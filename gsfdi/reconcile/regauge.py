"""Frictions of the nominal model that changed, where the gauge of torque had spread that over the whole plant.

Scaling every torque by one number changes nothing that is recorded. Where the frictions that a model holds have grown,
a fit whose priors share out what is off has all else shrink by one and the same share: of a joint whose Coulomb and
viscous friction were up by a fifth, torque constant, inertias and stiffness were all said to be 7.9 % low. Numbers that
are off independently do not agree so. Where they do, they are as the model says, and the frictions are not.
"""

from dataclasses import replace

import numpy as np

from gsfdi.fit import Knob, turned
from gsfdi.model import JointModel
from gsfdi.reconcile.hand import Round, around
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.reconcile.parameters import TERM_OF, TOLERANCE
from gsfdi.reconcile.turning import fit_knobs, is_torque

FEWEST = 3
"""Numbers of the plant that must agree: of those off by 3 % each, one pair in 12 does by chance, one three in 250."""
OFF, AGREE = 0.01, 0.15
"""Share by which they must be off, and the part of it by which they may differ in that."""
ROUNDS = 8
"""Rounds of the fit that follows: it begins near its end."""


def regauged(hand: Round, given: int) -> Round:
    """Give back to the nominal frictions what the gauge took from them, as terms of their own where it is news.

    Where such a term is there already, it takes all: of a Coulomb friction up by 0.60 N m it had been left 0.44.

    Parameters
    ----------
    hand : Round
        The model in hand and its fit.
    given : int
        Terms that the nominal model holds.
    """
    factor = common_factor(hand)
    if factor is None:
        return hand
    free = np.array([is_torque(knob, hand.fitted.model) for knob in hand.fitted.knobs])
    scaled = np.where(free, hand.fitted.values / factor, hand.fitted.values)
    model, kept = turned(hand.fitted.model, hand.fitted.knobs, scaled), list(hand.fitted.knobs)
    for knob, value in zip(hand.fitted.knobs, scaled, strict=True):
        if not 0 <= knob.place < given or not knob.prior:
            continue
        beside = _beside(model, given, knob.place)
        if beside is not None or abs(value - knob.prior) > TOLERANCE * knob.doubt:
            model = _apart(model, knob, knob.prior, float(value) - knob.prior, beside)
            kept.remove(knob)
    if len(kept) == len(hand.fitted.knobs):
        return hand
    for place in range(len(hand.fitted.model.physics), len(model.physics)):
        kept += term_knobs(hand.stand, model, place)
    fitted = fit_knobs(hand.misfit, model, kept, ROUNDS)
    return around(hand, fitted) if fitted.cost < hand.fitted.cost else hand


def _apart(model: JointModel, knob: Knob, nominal: float, more: float, place: int | None) -> JointModel:
    """Give a friction that the nominal model holds its number there again, and what is `more` a term of its own.

    What stands at `place`, of the same name and side and found to be there all along, takes it on.
    """
    own = model.physics[knob.place]
    model = model.with_use(knob.place, replace(own, values={**own.values, knob.name: nominal}))
    if place is None:
        return replace(model, physics=(*model.physics, replace(own, values={**own.values, knob.name: more})))
    use = model.physics[place]
    return model.with_use(place, replace(use, values={**use.values, knob.name: use.values[knob.name] + more}))


def _beside(model: JointModel, given: int, place: int) -> int | None:
    """Place of what was found to be there all along under the name of a nominal friction, on its side."""
    own = model.physics[place]
    found = enumerate(model.physics[given:], start=given)
    return next((i for i, use in found if (use.term, use.side, use.onset) == (own.term, own.side, None)), None)


def common_factor(hand: Round) -> float | None:
    """Share of their nominal values at which all numbers of the plant are; None where they differ or are hardly off."""
    pairs = zip(hand.fitted.knobs, hand.fitted.values, strict=True)
    ratios = np.array([value / knob.prior for knob, value in pairs if _tells(knob) and knob.prior])
    if len(ratios) < FEWEST:
        return None
    off = float(np.median(ratios)) - 1.0
    agree = np.all(np.abs(ratios - 1.0 - off) < AGREE * abs(off))
    return 1.0 + off if agree and abs(off) > OFF else None


def _tells(knob: Knob) -> bool:
    """Whether a knob is a number of the plant that scales with torque and may move."""
    return knob.place == -1 and knob.name in TERM_OF and knob.prior is not None and knob.low < knob.high
