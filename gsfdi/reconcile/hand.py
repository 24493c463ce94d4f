"""A model in hand: fitted to the recordings, with its noise model, ready to be compared with what could join it."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from gsfdi.fit import Fitted, Knob, Misfit, Started, slopes
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.noise import by_side, process_noise, surprise
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.registry import shelf
from gsfdi.types import Array
from gsfdi.whiten import Whitener

NEARLY = 3.0
"""Process noise over what is known to be there up to which nothing is missing."""
ROUGHLY = 1.0
"""Log-likelihood to which a fit is good enough while the noise is still being looked for."""
TURNS, AT_PLAY = 4, 2
"""Turns of fit and noise at most, and beside a play. Nine times of ten the second finds the noise as the first left it.
A linear observer of a gearbox that plays makes noise of its own: finer turns would only have other terms mend it."""
SMALL = 0.1
"""Process noise, as a share of the drive's torque, above which it is no noise of the observer's own making."""


def started(model: JointModel, stretches: int) -> Started:
    """`model` with a wind-up to begin each stretch."""
    if isinstance(model, Started):
        return model
    values = {field.name: getattr(model, field.name) for field in fields(JointModel)}
    return Started(**values).begun((0.0,) * stretches)


@dataclass(frozen=True, slots=True)
class Round:
    """What one round of the competition works on: the model in hand, its white innovations and their slopes."""

    stand: Bench
    tools: list[Whitener]
    fitted: Fitted
    innovations: list[Array]
    torque: Array
    exact: bool = False
    """Whether the slopes were taken where the fit ended, and not on the way there."""

    def misfit(self, models: Sequence[JointModel]) -> Array:
        """White innovations of models."""
        return misfit_under(self.stand, self.tools)(models)


def orthonormal(hand: Round) -> Array:
    """Slopes of all knobs in hand, scaled so that ``J Jᵀ`` takes over what the knobs would, priors included."""
    fitted = hand.fitted
    free = [
        i for i, k in enumerate(fitted.knobs) if k.low + 1e-9 * k.scale < fitted.values[i] < k.high - 1e-9 * k.scale
    ]
    J = fitted.jacobian[:, free]
    if not free:
        return J
    belief = np.diag(
        [0.0 if fitted.knobs[i].prior is None else (fitted.knobs[i].scale / fitted.knobs[i].doubt) ** 2 for i in free]
    )
    values, vectors = np.linalg.eigh(J.T @ J + belief)
    keep = values > 1e-12 * values.max()
    return np.asarray(J @ (vectors[:, keep] / np.sqrt(values[keep])))


def project(hand: Round, signatures: Array) -> tuple[Array, Array]:
    """Signatures less what the knobs in hand could take over, and the innovations left."""
    J = orthonormal(hand)
    return signatures - (signatures @ J) @ J.T, hand.fitted.residual


def regressed(hand: Round, signatures: Array) -> tuple[Array, Array]:
    """Score of each signature against what is left, below zero where it would lessen it, and its information."""
    bare, residual = project(hand, signatures)
    return bare @ residual, np.maximum(np.sum(bare**2, axis=1), 1e-300)


def is_sensor(term: str) -> bool:
    """Whether a term acts on what is measured rather than on the joint."""
    return str(shelf("gsfdi.terms", PhysicsTerm)[term].place).endswith("sensor")


def with_term(model: JointModel, use: TermUse) -> JointModel:
    """`model` with one term more."""
    return replace(model, physics=(*model.physics, use))


def without_terms(fitted: Fitted, gone: Collection[int]) -> tuple[JointModel, list[Knob], list[int]]:
    """Model without the terms at some places, the knobs that it keeps, and which of those in hand they were."""
    physics = fitted.model.physics
    kept = [place for place in range(len(physics)) if place not in gone]
    moved = {place: i for i, place in enumerate(kept)}
    keep = [i for i, knob in enumerate(fitted.knobs) if knob.place not in gone]
    knobs = [replace(k, place=moved.get(k.place, k.place)) for k in (fitted.knobs[i] for i in keep)]
    return replace(fitted.model, physics=tuple(physics[place] for place in kept)), knobs, keep


def misfit_under(stand: Bench, tools: list[Whitener]) -> Misfit:
    """White innovations of models under the noise that `tools` stand for."""

    def misfit(models: Sequence[JointModel]) -> Array:
        return stand.white(stand.innovations(models), tools)

    return misfit


def around(hand: Round, fitted: Fitted) -> Round:
    """Lay out the round in hand around another fit, its noise as it was, with fresh slopes."""
    jacobian = slopes(hand.misfit, fitted.model, fitted.knobs, fitted.values, fitted.residual)
    innovations = [e[0] for e in hand.stand.innovations([fitted.model])]
    return replace(hand, fitted=replace(fitted, jacobian=jacobian), innovations=innovations, exact=True)


def exact(hand: Round) -> Round:
    """Give a round that goes on its slopes where its fit ended: most of those that are settled lose, and need none."""
    return hand if hand.exact else around(hand, hand.fitted)


def settle(stand: Bench, model: JointModel, knobs: Sequence[Knob], floor: Array) -> Round:
    """Fit the knobs and estimate the process noise in turns, from coarse to fine."""
    return refined(coarse(stand, model, knobs, floor), floor)


@dataclass(frozen=True, slots=True)
class Turn:
    """A model fitted under one noise, what it leaves, and the noise that suits that [N m]."""

    stand: Bench
    fitted: Fitted
    innovations: list[Array]
    torque: Array


def coarse(stand: Bench, model: JointModel, knobs: Sequence[Knob], floor: Array) -> Turn:
    """Take the first turn: fit the knobs under the noise that `model` leaves, both sides alike."""
    near = process_noise(stand, [e[0] for e in stand.innovations([model])], floor)
    return _turn(stand, model, knobs, floor, near, None)


def at_a_glance(hand: Round, fitted: Fitted, floor: Array) -> Turn:
    """Give what was fitted under the noise of the model in hand the noise that suits it, looked for from there on."""
    innovations = [e[0] for e in hand.stand.innovations([fitted.model])]
    return Turn(hand.stand, fitted, innovations, by_side(hand.stand, innovations, floor, hand.torque))


def refined(first: Turn, floor: Array) -> Round:
    """Take the finer turns."""
    return _in_turns(first.stand, first.fitted.model, first.fitted.knobs, floor, first.torque)


def _turn(
    stand: Bench, model: JointModel, knobs: Sequence[Knob], floor: Array, near: Array, about: Array | None
) -> Turn:
    """Fit under noise `near` and estimate it anew, from `about` on or from anywhere."""
    stand = stand.rebased(near, model)
    fitted = fit_knobs(misfit_under(stand, stand.whiteners(near)), model, knobs, 5, tolerance=ROUGHLY)
    innovations = [e[0] for e in stand.innovations([fitted.model])]
    about = process_noise(stand, innovations, floor) if about is None else about
    return Turn(stand, fitted, innovations, by_side(stand, innovations, floor, about))


def leaves_nothing(hand: Round, floor: Array) -> bool:
    """Whether no more process noise is left than what is known to be there."""
    return bool(np.all(hand.torque < NEARLY * floor))


def missing(hand: Round, floor: Array) -> float:
    """Size of the process noise beyond what is known to be there [N m]: what the model in hand lacks."""
    return float(np.sqrt(np.sum(np.maximum(hand.torque**2 - floor**2, 0.0))))


def from_below(hand: Round, floor: Array) -> Round:
    """Settle a second time, from a tenth of the process noise that was found, and keep what is likelier.

    Where a joint sticks, too large a noise makes itself true: the observer that expects it shakes the friction loose.
    """
    return anew(hand, floor, 0.1) if sticks(hand.fitted.model) else hand


def from_above(hand: Round, floor: Array) -> Round:
    """Settle a second time from ten times that noise where the gearbox plays: contacts leave fits many places to stop.

    A play of 1 mrad that stopped 0.07 % off its width lay 2,000 behind one that did not.
    """
    return anew(hand, floor, 10.0) if plays(hand.fitted.model) else hand


def anew(hand: Round, floor: Array, factor: float) -> Round:
    """Settle a second time from `factor` times the noise that was found, if that is small; keep what is likelier."""
    small = np.all(hand.torque < SMALL * hand.stand.scales.torque)
    if not small or leaves_nothing(hand, floor):
        return hand
    near = np.maximum(floor, factor * hand.torque)
    other = _in_turns(hand.stand, hand.fitted.model, hand.fitted.knobs, floor, near)
    return other if likelier(other, hand) > 0 else hand


def _in_turns(stand: Bench, model: JointModel, knobs: Sequence[Knob], floor: Array, near: Array) -> Round:
    """Fit under a noise near `near` and estimate it anew until it holds, or nearly so."""
    for _ in range(AT_PLAY if plays(model) else TURNS):
        turn = _turn(stand, model, knobs, floor, near, near)
        holds = np.array_equal(near, turn.torque)
        model, near = turn.fitted.model, turn.torque
        if holds:
            break
    known = turn.fitted.jacobian if holds else None
    stand = stand.rebased(near, model)
    tools = stand.whiteners(near)
    fitted = fit_knobs(misfit_under(stand, tools), model, knobs, 8, known)
    return Round(stand, tools, fitted, [e[0] for e in stand.innovations([fitted.model])], near)


def plays(model: JointModel) -> bool:
    """Whether the gearbox of a model plays."""
    return any(use.term == "backlash" for use in model.physics)


def sticks(model: JointModel) -> bool:
    """Whether a model holds dry friction."""
    terms = shelf("gsfdi.terms", PhysicsTerm)
    return any(terms[use.term].place == "dry" for use in model.physics)


def likelier(new: Round | Turn, old: Round) -> float:
    """Log-likelihood that `new` gains upon `old`, each under the process noise that suits it best."""
    return surprise_of(old) - surprise_of(new)


def surprise_of(hand: Round | Turn) -> float:
    """Negative log-likelihood of what a fit leaves, under the process noise that suits it best."""
    return surprise(hand.stand, hand.innovations, hand.torque)
