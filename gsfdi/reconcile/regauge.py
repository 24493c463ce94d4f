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
        if 0 <= knob.place < given and knob.prior and abs(value - knob.prior) > TOLERANCE * knob.doubt:
            model = _apart(model, given, knob, knob.prior, float(value) - knob.prior)
            kept.remove(knob)
    if len(kept) == len(hand.fitted.knobs):
        return hand
    for place in range(len(hand.fitted.model.physics), len(model.physics)):
        kept += term_knobs(hand.stand, model, place)
    fitted = fit_knobs(hand.misfit, model, kept, ROUNDS)
    return around(hand, fitted) if fitted.cost < hand.fitted.cost else hand


def _apart(model: JointModel, given: int, knob: Knob, nominal: float, more: float) -> JointModel:
    """Give a friction that the nominal model holds its number there again, and what is `more` a term of its own.

    One of the same name and side that was found to be there all along takes it on.
    """
    own = model.physics[knob.place]
    model = model.with_use(knob.place, replace(own, values={**own.values, knob.name: nominal}))
    for place, use in list(enumerate(model.physics))[given:]:
        if (use.term, use.side, use.onset) == (own.term, own.side, None):
            return model.with_use(place, replace(use, values={**use.values, knob.name: use.values[knob.name] + more}))
    return replace(model, physics=(*model.physics, replace(own, values={**own.values, knob.name: more})))


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
