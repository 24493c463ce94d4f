"""A model in hand: fitted to the recordings, with its noise model, ready to be compared with what could join it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from gsfdi.fit import START, Fitted, Knob, Started, slopes
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.noise import process_noise
from gsfdi.reconcile.surplus import surplus
from gsfdi.reconcile.turning import DOUBT, believed, fit_knobs
from gsfdi.registry import shelf
from gsfdi.types import Array
from gsfdi.whiten import Whitener


def plant_knobs(model: JointModel, effort: str) -> list[Knob]:
    """Knobs of the linear plant and of the terms that the nominal holds, each believed as far as the model says."""
    plant = model.plant
    names = ["output_inertia"]
    if effort == "motor_current":
        names.append("torque_constant")
    if model.structure == "flexible":
        names += ["motor_inertia", "stiffness"]
    knobs = [_believed(-1, name, getattr(plant, name), model.trust.get(name, DOUBT)) for name in names]
    terms = shelf("gsfdi.terms", PhysicsTerm)
    for place, use in enumerate(model.physics):
        size = terms[use.term].params[0]
        value = use.values.get(size.name, size.start)
        if size.linear and value != 0:
            knobs.append(_believed(place, size.name, value, DOUBT))
    return knobs


def start_knobs(stand: Bench) -> list[Knob]:
    """Knobs of the wind-up with which each stretch begins."""
    if stand.model.structure == "rigid":
        return []
    size = stand.scales.windup
    return [Knob(START, str(i), size, -20 * size, 20 * size, 0.0, 2 * size) for i in range(len(stand.records))]


def started(model: JointModel, stretches: int) -> Started:
    """`model` with a wind-up to begin each stretch."""
    if isinstance(model, Started):
        return model
    values = {field.name: getattr(model, field.name) for field in fields(JointModel)}
    return Started(**values, windups=(0.0,) * stretches)


def _believed(place: int, name: str, value: float, share: float) -> Knob:
    doubt = share * abs(value)
    return Knob(place, name, doubt, *believed(value, doubt), value, doubt)


def term_knobs(stand: Bench, model: JointModel, place: int) -> list[Knob]:
    """Knobs of the term at `place`: its numbers, within what the shelf allows and this motion could show."""
    use = model.physics[place]
    term = shelf("gsfdi.terms", PhysicsTerm)[use.term]
    knobs = []
    for param in term.params:
        value = use.values[param.name]
        low, high = plausible(stand, term, param.name)
        if term.name == "end_stop" and param.name == "angle_rad":
            low, high = _beyond(stand, value)
        if param.name == "order":
            reach = ORDER_OFF * value if _is_whole(stand, term) else 0.4
            low, high = max(0.7, value - reach), value + reach
        low, high = (
            (max(low, param.low), min(high, param.high))
            if param.name not in ("phase_rad", "angle_rad")
            else (low, high)
        )
        if param is term.params[0] and (spare := surplus(stand.model, term, use.side)) > 0:
            low = -spare
        scale = abs(value - (param.neutral or 0.0)) or param.typical
        if param.neutral is None:
            scale = _shape_scale(stand, term, param.name, scale)
        if term.name == "asymmetric_friction":
            scale = 0.1 * stand.scales.of(param.unit)
        knobs.append(Knob(place, param.name, scale, low, high))
    return knobs


PASSED = 0.4
"""Share of half the range by which the joint may press beyond a stop: what it passes by further does not stop it."""


def _beyond(stand: Bench, angle: float) -> tuple[float, float]:
    """Ends between which a stop near `angle` may lie: at the edge of the motion."""
    s = stand.scales
    ends = s.centre + np.sign(angle - s.centre) * s.reach * np.array([1 - PASSED, 1.05])
    return float(ends.min()), float(ends.max())


ORDER_OFF = 0.01
"""Share by which a whole order may seem off: as much as the gear ratio in the model may."""


def _is_whole(stand: Bench, term: PhysicsTerm) -> bool:
    """Whether a wave repeats with each turn of a magnet or a disc: its order is then a whole number."""
    return stand.model.axis == "rotary" and term.name != "transmission_error"


def _shape_scale(stand: Bench, term: PhysicsTerm, name: str, scale: float) -> float:
    """Size of a change that matters, for a number that gives a term its shape."""
    sizes = {
        "centre_rad": 0.3 * stand.scales.reach,
        "rest_rad": stand.scales.reach,
        "angle_rad": stand.scales.reach if term.name == "end_stop" else 1.0,
        "phase_rad": 1.0,
        "order": 0.3 / (np.pi * max(_turns(stand, term), 1.0)),
        "per_degc": 0.02,
        "onset_s": 0.05 * stand.scales.seconds,
    }
    return sizes.get(name, scale)


def plausible(stand: Bench, term: PhysicsTerm, name: str) -> tuple[float, float]:
    """Bounds within which a number is still what its name says, on this motion.

    A Stribeck speed beyond all speeds would be Coulomb friction by another name, and so would a stiff bristle.
    """
    s = stand.scales
    low, high = s.centre - 1.05 * s.reach, s.centre + 1.05 * s.reach
    ranges: dict[tuple[str, str], tuple[float, float]] = {
        ("torque_constant_change", "ratio"): (0.3, 1.5),
        ("current_gain", "ratio"): (0.3, 3.0),
        ("velocity_gain", "ratio"): (0.3, 3.0),
        ("position_gain", "ratio"): (0.3, 3.0),
        ("motor_inertia_change", "ratio"): (0.5, 2.0),
        ("output_inertia_change", "ratio"): (0.2, 5.0),
        ("stiffness_change", "ratio"): (0.2, 1.6),
        ("load_dependent_friction", "ratio"): (0.0, 0.5),
        ("torque_ripple", "amplitude_ratio"): (0.0, 0.6),
        ("stribeck_friction", "velocity_rad_s"): (0.004 * s.speed, 0.7 * s.speed),
        ("stiffening", "cubic_per_rad2"): (0.0, 10.0 * s.windup**-2),
        ("presliding_friction", "torque_nm"): (0.0, 3.0 * s.torque),
        ("gearbox_hysteresis", "torque_nm"): (0.0, 3.0 * s.torque),
        ("presliding_friction", "stiffness_nm_rad"): (0.05 * s.torque / s.reach, 3e3 * s.torque / s.reach),
        ("position_dependent_friction", "centre_rad"): (low, high),
        ("position_dependent_friction", "width_rad"): (0.01 * s.reach, 0.6 * s.reach),
        ("gearbox_hysteresis", "width_rad"): (0.02 * s.windup, 3.0 * s.windup),
        ("gearbox_damping", "coefficient_nms_rad"): (0.0, stand.critical),
        ("structural_mode", "frequency_hz"): (0.1, 0.25 / s.period),
        ("structural_mode", "damping_ratio"): (1e-3, 0.3),
        ("structural_mode", "inertia_kg_m2"): (0.0, 2.0 * s.inertia),
        ("end_stop", "stiffness_nm_rad"): (0.0, 300.0 * s.torque / s.reach),
        ("torque_constant_drift", "onset_s"): (0.0, 0.98 * s.seconds),
        ("torque_constant_drift", "rate_per_s"): (-0.1, 0.1),
        ("cable_harness", "rest_rad"): (s.centre - 10 * s.reach, s.centre + 10 * s.reach),
        ("backlash", "half_width_rad"): (0.0, 10 * s.windup),
        ("magnetic_saturation", "current_a"): (0.2 * s.effort, 1e3 * s.effort),
        ("actuation_delay", "delay_s"): (0.0, 10 * s.period),
    }
    free = (-20.0, 20.0) if name in ("phase_rad", "angle_rad") else (-np.inf, np.inf)
    return ranges.get((term.name, name), free)


def _turns(stand: Bench, term: PhysicsTerm) -> float:
    """Revolutions, of the motor or of the joint, over the motion's range."""
    turns = 1.0 if term.place == "position_sensor" else stand.model.plant.gear_ratio
    return stand.scales.reach * turns / np.pi


@dataclass(frozen=True, slots=True)
class Round:
    """What one round of the competition works on: the model in hand, its white innovations and their slopes."""

    stand: Bench
    tools: list[Whitener]
    fitted: Fitted
    innovations: list[Array]
    torque: Array

    def misfit(self, models: Sequence[JointModel]) -> Array:
        """White innovations of models."""
        return self.stand.white(self.stand.innovations(models), self.tools)


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


def is_sensor(term: str) -> bool:
    """Whether a term acts on what is measured rather than on the joint."""
    return str(shelf("gsfdi.terms", PhysicsTerm)[term].place).endswith("sensor")


def with_term(model: JointModel, use: TermUse) -> JointModel:
    """`model` with one term more."""
    return replace(model, physics=(*model.physics, use))


def take_up(stand: Bench, tools: list[Whitener], model: JointModel, knobs: Sequence[Knob], rounds: int = 6) -> Round:
    """Fit the knobs of `model` and lay out a round around the result."""

    def misfit(models: Sequence[JointModel]) -> Array:
        return stand.white(stand.innovations(models), tools)

    fitted = fit_knobs(misfit, model, knobs, rounds)
    return lay_out(stand, tools, fitted)


def lay_out(stand: Bench, tools: list[Whitener], fitted: Fitted) -> Round:
    """Lay out a round around a fitted model, with fresh slopes."""
    innovations = [e[0] for e in stand.innovations([fitted.model])]
    hand = Round(stand, tools, fitted, innovations, np.zeros(0))
    jacobian = slopes(hand.misfit, fitted.model, fitted.knobs, fitted.values, fitted.residual)
    return replace(hand, fitted=replace(fitted, jacobian=jacobian))


def settle(stand: Bench, model: JointModel, knobs: Sequence[Knob], floor: Array) -> Round:
    """Fit the knobs and estimate the process noise in turns, from coarse to fine."""
    near = process_noise(stand, [e[0] for e in stand.innovations([model])], floor)
    for finer in (False, True, True):
        stand = stand.rebased(near, model)
        hand = take_up(stand, stand.whiteners(near), model, knobs, 5)
        near = process_noise(stand, hand.innovations, floor, near if finer else None)
        model = hand.fitted.model
    stand = stand.rebased(near, model)
    hand = take_up(stand, stand.whiteners(near), model, knobs, 8)
    return replace(hand, torque=near)
