"""What a fit may turn: numbers of the plant as far as they are believed, and those of terms within reason."""

import numpy as np

from gsfdi.fit import START, Knob
from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.surplus import surplus
from gsfdi.reconcile.turning import DOUBT, believed
from gsfdi.registry import shelf


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
