"""Fits that mind what no recording can tell: the gauge of torque, and a parameter written twice.

Scaling torque constant, inertias, stiffness and every friction by one number leaves input and output as they were, so
a fit by differences of replays wanders along that valley at random; its floor, where the priors are best kept, is
found in closed form. A change of a parameter that is a term of its own leaves nothing for the parameter's knob to say.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gsfdi.fit import Fitted, Knob, Misfit, covariance, levenberg, turned
from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.registry import shelf
from gsfdi.types import Array

Ints = npt.NDArray[np.int64]

DOUBT = 0.03
"""Standard deviation of a nominal parameter about the truth, as a share, unless the model tells: 2 to 5 % is usual."""
REACH = 0.08 / DOUBT
"""Farthest that a nominal parameter may be off before that is a change with a name of its own, in those deviations."""

CATCHES_UP = 0.5
"""What a fit is behind, as a share of what it was some rounds before, below which it may yet catch up."""


def believed(value: float, doubt: float) -> tuple[float, float]:
    """Ends between which a number of the model believed to within `doubt` is still that number."""
    reach = REACH * doubt
    ends = (value - np.sign(value) * min(reach, 0.9 * abs(value)), value + np.sign(value) * reach)
    return min(ends), max(ends)


def fit_knobs(
    misfit: Misfit,
    model: JointModel,
    knobs: Sequence[Knob],
    rounds: int,
    known: Array | None = None,
    tolerance: float = 0.05,
) -> Fitted:
    """Fit `knobs`, those of changed parameters held at their nominal values, and settle the gauge."""
    knobs = [_held(knob, model) for knob in knobs]
    return balanced(misfit, levenberg(misfit, model, knobs, rounds, tolerance, known))


def known_before(fitted: Fitted, place: int) -> Array:
    """Slopes of the knobs before those of the term at `place`, good enough for a fit in which only that one changes."""
    first = next((i for i, knob in enumerate(fitted.knobs) if knob.place == place), len(fitted.knobs))
    return np.asarray(fitted.jacobian[:, :first])


def nearing(misfit: Misfit, fitted: Fitted, best: float, enough: float) -> Fitted:
    """Go on fitting while that makes up half of what `fitted` costs more than `best`, until it is `enough`.

    Along a valley a few rounds lead nowhere near its end. A constant load in the place of a cable, beside a weight that
    had to go with it, was 3,100 behind after four rounds and better by 220 in the end.
    """
    behind = np.inf
    while enough < fitted.cost - best < CATCHES_UP * behind:
        behind = fitted.cost - best
        fitted = fit_knobs(misfit, fitted.model, fitted.knobs, 4)
    return fitted


def _held(knob: Knob, model: JointModel) -> Knob:
    """Give a plant's knob its bounds: none to move where a term of the model changes its parameter."""
    if knob.place != -1 or knob.prior is None:
        return knob
    changed = any(use.term == f"{knob.name}_change" and use.onset is None for use in model.physics)
    low, high = (knob.prior, knob.prior) if changed else believed(knob.prior, knob.doubt)
    return replace(knob, low=low, high=high)


def balanced(misfit: Misfit, fitted: Fitted) -> Fitted:
    """Scale everything that is a torque so that the priors are kept best; the innovations do not notice."""
    scales = np.array([is_torque(knob, fitted.model) for knob in fitted.knobs], dtype=np.bool_)
    names = {knob.name for knob in fitted.knobs if knob.place == -1}
    if "torque_constant" not in names or not scales.any():
        return fitted
    rows = [i for i, k in enumerate(fitted.knobs) if scales[i] and k.prior is not None and k.high > k.low]
    if not rows:
        return fitted
    v = fitted.values[rows]
    p = np.array([fitted.knobs[i].prior for i in rows], dtype=np.float64)
    d = np.array([fitted.knobs[i].doubt for i in rows])
    factor = float(np.sum(v * p / d**2) / np.sum(v**2 / d**2))
    low, high = (np.array([getattr(k, end) for k in fitted.knobs]) for end in ("low", "high"))
    values = np.where(scales & (high > low), fitted.values * factor, fitted.values)
    if abs(factor - 1) < 1e-5 or np.any(values < low) or np.any(values > high):
        return fitted
    residual = misfit([turned(fitted.model, fitted.knobs, values)])[0]
    penalty = [(x - k.prior) / k.doubt for x, k in zip(values, fitted.knobs, strict=True) if k.prior is not None]
    cost = 0.5 * float(residual @ residual) + 0.5 * float(np.sum(np.square(penalty)))
    if not cost < fitted.cost:
        return fitted
    return replace(
        fitted, model=turned(fitted.model, fitted.knobs, values), values=values, cost=cost, residual=residual
    )


def spread_of(fitted: Fitted, blocks: Ints) -> Array:
    """Covariance ``(k, k)`` of the fitted knobs, the scale of torque being known from their priors only.

    Slopes by differences are never so exact that the knobs' parts in that scale cancel. What is left of it would seem
    to tell the scale to a fraction of a percent; it is taken off the steepest slopes, which err by most.
    """
    J = fitted.jacobian
    along = np.array(
        [v / k.scale if is_torque(k, fitted.model) else 0.0 for k, v in zip(fitted.knobs, fitted.values, strict=True)]
    )
    steep = np.sum(J**2, axis=0) * along
    if "torque_constant" in {k.name for k in fitted.knobs if k.place == -1} and along @ steep > 0:
        J = J - np.outer(J @ along, steep / (along @ steep))
    return covariance(replace(fitted, jacobian=J), blocks)


def is_torque(knob: Knob, model: JointModel) -> bool:
    """Whether a knob scales with the unit of torque."""
    if knob.place < 0:
        return knob.place == -1
    use = model.physics[knob.place]
    if use.term.endswith("_change"):
        return use.onset is None and knob.name == "ratio"
    if knob.name == "onset":
        return False
    unit = shelf("gsfdi.terms", PhysicsTerm)[use.term].param(knob.name).unit
    return "N m" in unit or unit == "kg m²"
