"""Parameters only: whether numbers of the linear model that are off account for everything, and which."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from gsfdi.fit import Fitted, Knob, levenberg
from gsfdi.model import JointModel
from gsfdi.reconcile.hand import Round, coarse
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.turning import DOUBT, balanced, spread_of

TERM_OF = {
    "torque_constant": "torque_constant_change",
    "motor_inertia": "motor_inertia_change",
    "stiffness": "stiffness_change",
    "output_inertia": "output_inertia_change",
}
TOLERANCE = 0.055 / DOUBT
"""How far a nominal parameter may be off without that being news, in standard deviations of the belief in it."""
PINNED = 1e-3
"""Doubt in a number that is held, as a share of the usual."""
SOLE = 12.0
"""Log-likelihood that moving one parameter alone may fall short of moving all; beyond it each is looked for from afar.

Where little noise is expected the valley is narrow: beside a motor's inertia of 0.9 fits stopped 1300 to 6200 short,
and a stiffness of 1.09 accounted for all.
"""
SNUG = 0.01 / DOUBT
"""The same where the others may give way a little: a joint and its simulation also differ in how friction turns."""


class Other(NamedTuple):
    """What might account for everything in the place of one number: the log-likelihood that costs beside it."""

    term: str
    cost: float
    probability: float
    is_alike: bool


@dataclass(frozen=True, slots=True)
class Shift:
    """A parameter of the plant as the data have it, over its nominal value, with a 95 % interval.

    `tolerance` is the share by which it may be off without that being news; `probability` that of its being news or,
    where one alone accounts for everything, of its being this one and none of the `others`; `gain` the log-likelihood
    that parameters gain.
    """

    term: str
    ratio: float
    low: float
    high: float
    tolerance: float
    probability: float = 1.0
    others: tuple[Other, ...] = ()
    gain: float = 0.0

    @property
    def alike(self) -> tuple[str, ...]:
        """Terms that would do as well."""
        return tuple(other.term for other in self.others if other.is_alike)

    @property
    def is_news(self) -> bool:
        """Whether the data have it off by more than may be, as the value found."""
        return abs(self.ratio - 1) > self.tolerance

    @property
    def is_sure(self) -> bool:
        """Whether neither end of what may be lies within the interval."""
        return not any(self.low < 1 + way * self.tolerance < self.high for way in (-1, 1))


def ended(fitted: Fitted) -> list[str]:
    """Changes of those numbers of the plant that ended as far off as they are believed to be."""
    return [
        TERM_OF[knob.name]
        for knob, value in zip(fitted.knobs, fitted.values, strict=True)
        if knob.place == -1 and knob.name in TERM_OF and knob.low < knob.high and knob.is_at_end(value)
    ]


def shifts(hand: Round) -> list[Shift]:
    """Every plant parameter over its nominal value."""
    fitted = hand.fitted
    spread = np.sqrt(np.diag(spread_of(fitted, hand.stand.blocks()))) if fitted.knobs else np.zeros(0)
    found = []
    for knob, value, sd in zip(fitted.knobs, fitted.values, spread, strict=True):
        if knob.place == -1 and knob.prior and knob.name in TERM_OF:
            ratio, width = value / knob.prior, 1.96 * sd / abs(knob.prior)
            tolerance = TOLERANCE * knob.doubt / abs(knob.prior)
            news = float(ndtr(1.96 * (abs(ratio - 1) - tolerance) / max(width, 1e-12)))
            bounds = float(ratio - width), float(ratio + width)
            found.append(Shift(TERM_OF[knob.name], float(ratio), *bounds, tolerance, news))
    return found


@dataclass(frozen=True, slots=True)
class Lone:
    """One plant parameter moved, the others held: its shift, the fit, and what that costs beyond moving all."""

    shift: Shift
    fitted: Fitted
    cost: float


def all_kept(hand: Round, nominal: Mapping[str, float]) -> float:
    """Log-likelihood that it costs to keep every plant parameter nominal.

    Parameters
    ----------
    hand : Round
        Parameters only.
    nominal : mapping of str to float
        Nominal values by field of the plant.
    """
    knobs = [_held(k, nominal, PINNED) for k in hand.fitted.knobs]
    return _cost_beside(hand, levenberg(hand.misfit, _with(hand, nominal), knobs, 6))


def lone_changes(hand: Round, nominal: Mapping[str, float], leeway: float) -> list[Lone]:
    """Move each plant parameter alone, the others held; that which costs least beyond moving all comes first.

    Parameters
    ----------
    hand : Round
        Parameters only.
    nominal : mapping of str to float
        Nominal values by field of the plant.
    leeway : float
        Doubt in the others, as a share of the usual.
    """
    found = [_alone(hand, name, nominal, leeway) for name in nominal]
    if min(lone.cost for lone in found) > SOLE:
        afar = [_alone(hand, name, nominal, leeway, afar=True) for name in nominal]
        found = [min(pair, key=attrgetter("cost")) for pair in zip(found, afar, strict=True)]
    return sorted(found, key=attrgetter("cost"))


def _alone(hand: Round, name: str, nominal: Mapping[str, float], leeway: float, afar: bool = False) -> Lone:
    """Move one plant parameter alone, under the noise that its nominal value leaves first where that is far off."""
    value, base = nominal[name], _with(hand, nominal)
    rest = [_held(k, nominal, leeway) for k in hand.fitted.knobs if not (k.place == -1 and k.name == name)]
    knobs = [Knob(-1, name, 0.03 * value, 0.2 * value, 5.0 * value, prior=value), *rest]
    if afar:
        base = coarse(hand.stand, base, knobs, effort_floor(hand.stand)).fitted.model
    fitted = balanced(hand.misfit, levenberg(hand.misfit, base, knobs, 12))
    sd = float(np.sqrt(spread_of(fitted, hand.stand.blocks())[0, 0])) / value
    ratio = float(fitted.values[0] / value)
    shift = Shift(TERM_OF[name], ratio, ratio - 1.96 * sd, ratio + 1.96 * sd, TOLERANCE * DOUBT)
    return Lone(shift, fitted, _cost_beside(hand, fitted) - fitted.belief)


def _with(hand: Round, nominal: Mapping[str, float]) -> JointModel:
    """Give the model in hand with the plant's nominal numbers."""
    model = hand.fitted.model
    return replace(model, plant=replace(model.plant, **nominal))


def _cost_beside(hand: Round, fitted: Fitted) -> float:
    """Log-likelihood that a fit loses beside the one in hand."""
    return 0.5 * float(fitted.residual @ fitted.residual - hand.fitted.residual @ hand.fitted.residual)


def _held(knob: Knob, nominal: Mapping[str, float], leeway: float) -> Knob:
    """Give the knob held at its nominal value but for the leeway, if it has one to keep."""
    if knob.place != -1 or knob.name not in nominal:
        return knob
    return replace(knob, doubt=leeway * knob.doubt)
