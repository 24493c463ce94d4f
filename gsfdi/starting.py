"""Where a replay starts: the state of the joint and of its controller at the first sample of a recording."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from gsfdi import motion
from gsfdi.model import JointModel, Plant, TermUse
from gsfdi.motion import QUANTITIES, STATES, Place
from gsfdi.packed import plant_at, side_of, term_of, values_of
from gsfdi.types import Array

SPAN = 0.3  # [s] from which the start is taken
FEWEST, MOST = 8, 64  # samples of it
UNKNOWN_NOISE = (1e-5, 1e-2)  # of position and speed, where the model says none: only their ratio counts
SENSOR_STEPS = 8  # towards what a sensor shows
NEAR, SLOPES = 1e-6, (0.1, 10.0)  # step of a sensor's slope [rad or rad/s], and what it may be
WIDEST = 100.0  # [rad] of wind-up, beyond which no law passes the torque on


class Signals(NamedTuple):
    """What a recording holds for a replay; all (n,), NaN where unknown.

    Time [s] from the start of the recording; the command; what was measured; `velocity` is the motor's, the joint's if
    the model is rigid; temperature [degC], 20 where unknown.
    """

    t: Array
    setpoint: Array
    setpoint_rate: Array
    feedforward: Array
    effort: Array
    position: Array
    velocity: Array
    temperature: Array


class Start(NamedTuple):
    """How a recording begins: joint angle and speed, motor speed (reflected), joint acceleration, integral part.

    `shown` says whether the angle is what a sensor showed rather than where the joint is; `felt` is the speed that was
    measured, on average, and `per_speed` what the first four gain per unit by which it is higher. `time` [s] is when.
    """

    angle: float
    speed: float
    motor_speed: float
    acceleration: float
    integral: float
    shown: bool = False
    felt: float = 0.0
    per_speed: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    time: float = 0.0


def start_of(signals: Signals, model: JointModel) -> Start:
    """How the recording begins, by least squares over its first moments.

    The linear joint under the recorded effort, with a constant torque on the motor for the friction and loads that
    it lacks, leaves four (rigid: two) numbers of the state and that torque to be found.
    """
    period = float(np.median(np.diff(signals.t[:MOST])))
    count = int(np.clip(SPAN / max(period, 1e-9), FEWEST, MOST))
    first = Signals(*(values[:count] for values in signals))
    angle, speed = float(np.nan_to_num(first.setpoint[0])), float(np.nan_to_num(first.setpoint_rate[0]))
    measured = np.concatenate([first.position, first.velocity])
    good = np.isfinite(measured)
    integral = integral_of(first, model)
    if good[:count].sum() < 3 or first.t[-1] <= first.t[0]:
        return Start(*begun(np.array([angle, speed, 0.0, 0.0]), model), integral, time=float(first.t[0]))
    columns, forced = responses(first, model)
    sensors = model.sensors
    noise = (sensors.position_noise, sensors.motor_velocity_noise)
    weight = np.repeat([1 / (known or usual) for known, usual in zip(noise, UNKNOWN_NOISE, strict=True)], count)
    wanted = np.column_stack([measured - forced, np.repeat([0.0, 1.0], count)])
    wanted, columns = (weight[:, None] * wanted)[good], (weight[:, None] * columns)[good]
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    found = np.linalg.lstsq(columns / scale, wanted, rcond=1e-10)[0] / scale[:, None]
    felt = float(np.mean(measured[count:][good[count:]])) if good[count:].any() else 0.0
    return Start(*begun(found[:, 0], model), integral, True, felt, begun(found[:, 1], model), float(first.t[0]))


def begun(found: Array, model: JointModel) -> tuple[float, float, float, float]:
    """Angle, speed, motor speed and acceleration of what was found of the state."""
    plant = model.plant
    motor, windup, rate = (found[1], 0.0, 0.0) if model.structure == "rigid" else found[1:4]
    speed, pull = float(motor + rate), float(plant.stiffness * windup)
    return float(found[0] + windup), speed, float(motor), -(pull + plant.damping * speed) / plant.output_inertia


def responses(first: Signals, model: JointModel) -> tuple[Array, Array]:
    """Position and speed, one after the other, per unit of each unknown (2n, 5 or 3), and under the effort (2n,)."""
    plant, rigid = model.plant, model.structure == "rigid"
    motor, output = plant.gear_ratio**2 * plant.motor_inertia, plant.output_inertia
    if rigid:
        matrix = np.array([[0.0, 1.0], [0.0, -plant.damping / (output + motor)]])
        entry, seen = np.array([0.0, 1.0 / (output + motor)]), np.array([[1.0, 0.0], [0.0, 1.0]])
    else:
        c, b = plant.stiffness, plant.damping
        matrix = np.array(
            [
                [0, 1, 0, 0],
                [0, 0, c / motor, 0],
                [0, 0, 0, 1],
                [0, -b / output, -c / motor - c / output, -b / output],
            ]
        )
        entry = np.array([0.0, 1.0 / motor, 0.0, -1.0 / motor])
        seen = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, plant.gear_ratio, 0.0, 0.0]])
    order = entry.size
    effort = plant.gear_ratio * plant.torque_constant * np.nan_to_num(first.effort)
    state = np.hstack([np.eye(order), np.zeros((order, 2))])
    shown = np.empty((first.t.size, 2, order + 2))
    flows: dict[float, Array] = {}
    for k, step in enumerate(np.diff(first.t, append=first.t[-1])):
        shown[k] = seen @ state
        key = round(float(step), 9)
        if key not in flows:
            flows[key] = expm(np.block([[matrix, entry[:, None]], [np.zeros((1, order + 1))]]) * step)
        torque = np.zeros(order + 2)
        torque[order:] = 1.0, effort[k]
        state = flows[key][:order, :order] @ state + np.outer(flows[key][:order, order], torque)
    stacked = np.concatenate([shown[:, 0], shown[:, 1]])
    return stacked[:, :-1], stacked[:, -1]


def integral_of(first: Signals, model: JointModel) -> float:
    """Integral part of the controller at the first sample: what its law leaves of the recorded effort."""
    law = model.controller
    if law is None or law.integral == 0.0:
        return 0.0
    error = first.setpoint - first.position
    speed = first.velocity / (1.0 if model.structure == "rigid" else model.plant.gear_ratio)
    if not np.isfinite(speed).any():
        speed = np.gradient(first.position, first.t + 1e-12 * np.arange(first.t.size))
    left = first.effort - first.feedforward - law.at_once * error
    left = left - law.derivative * (law.rate_feedforward * first.setpoint_rate - speed)
    known = np.where(np.isfinite(error), error, 0.0)
    swept = np.concatenate([[0.0], np.cumsum(0.5 * (known[1:] + known[:-1]) * np.diff(first.t))])
    parts = left - law.integral * swept
    return float(np.nanmean(parts)) if np.isfinite(parts).any() else 0.0


def initial_state(model: JointModel, start: Start) -> Array:
    """State (5,) of `model` that begins as `start` says, its spring wound against what resists the output.

    A joint that a biased sensor would have begin in motion would ring on against its own gearbox; stuck, for long. What
    has set in by then counts: after a gap a joint began 2.1 mrad off, by the bias that its sensor had got before.
    """
    model = in_force(model, start.time)
    if start.shown:
        start = start._replace(angle=true_value(model, "position_sensor", start.angle))
    if any(start.per_speed):
        off = true_value(model, "velocity_sensor", start.felt) - start.felt
        angle, speed, motor_speed, acceleration = np.add(start[:4], np.multiply(off, start.per_speed)).tolist()
        start = start._replace(angle=angle, speed=speed, motor_speed=motor_speed, acceleration=acceleration)
    if model.structure == "rigid":
        return np.array([start.angle, start.speed, 0.0, 0.0, start.integral])
    plant = plant_at(model, start.time)
    torque = plant.output_inertia * start.acceleration + plant.damping * start.speed + resistance(model, start)
    windup = windup_at(model, plant, -torque)
    return np.array([start.angle - windup, start.motor_speed, windup, start.speed - start.motor_speed, start.integral])


def in_force(model: JointModel, time: float) -> JointModel:
    """Give the model with the terms that are there at `time` [s], as if they always had been."""
    if all(use.onset is None for use in model.physics):
        return model
    physics = (replace(use, onset=None) for use in model.physics if use.onset is None or use.onset <= time)
    return replace(model, physics=tuple(physics))


def true_value(model: JointModel, place: Place, shown: float) -> float:
    """Angle or speed at which the sensor of `model` shows `shown`, by steps that each mend what still differs."""
    m, s = np.zeros(QUANTITIES), np.zeros(STATES)
    errors = [(term_of(use), values_of(use)) for use in model.physics]
    errors = [(term, values) for term, values in errors if term.place == place and not term.memory]

    def reading(value: float) -> float:
        m[motion.JOINT_ANGLE] = m[motion.VALUE] = value
        for term, values in errors:
            m[motion.VALUE] = term.law(m, values, s)
        return float(m[motion.VALUE])

    value = shown
    for _ in range(SENSOR_STEPS if errors else 0):
        slope = (reading(value + NEAR) - reading(value)) / NEAR
        low, high = SLOPES
        value += (shown - reading(value)) / (
            slope if low < slope < high else 1.0
        )  # coarse sensors have steps, no slope
    return value


def recorded_states(model: JointModel, signals: Signals, samples: Sequence[int]) -> Array:
    """States (samples, 5) of `model` at these samples of a recording, each from the moments that follow it."""
    parts = (Signals(*(values[i : i + MOST] for values in signals)) for i in samples)
    return np.array([initial_state(model, start_of(part, model)) for part in parts])


def resistance(model: JointModel, start: Start) -> float:
    """Torque of the terms that resist the output at the start; those with memory have none yet."""
    model = in_force(model, start.time)
    m, s, total = np.zeros(QUANTITIES), np.zeros(STATES), 0.0
    m[motion.ANGLE] = m[motion.JOINT_ANGLE] = start.angle
    m[motion.SPEED], m[motion.DIRECTION] = start.speed, np.sign(start.speed) or 1.0
    m[motion.TEMPERATURE] = motion.REFERENCE_TEMPERATURE
    for use in model.physics:
        term = term_of(use)
        here = side_of(use, model.structure) == "output" and not term.memory
        if here and term.place == "torque":
            total += term.law(m, values_of(use), s)
        elif here and term.place == "dry":  # at rest friction carries what it must, and the spring nothing of it
            total += term.law(m, values_of(use), s) * float(np.sign(start.speed))
    return total


def windup_at(model: JointModel, plant: Plant, torque: float) -> float:
    """Wind-up at which the spring passes on `torque`, whatever terms shape it; the bare spring's if there is none."""
    shaping = [use for use in model.physics if term_of(use).place in ("windup", "spring")]
    if not shaping:
        return torque / plant.stiffness
    reach = abs(torque) / plant.stiffness + 0.1
    passes = spring_law(plant, shaping)
    while not passes(-reach) < torque < passes(reach):  # the play of a worn gearbox may be wide
        reach *= 2.0
        if not reach < WIDEST:
            return torque / plant.stiffness
    return float(brentq(lambda windup: passes(windup) - torque, -reach, reach, xtol=1e-12))


def spring_law(plant: Plant, shaping: Sequence[TermUse]) -> Callable[[float], float]:
    """Torque of the spring against wind-up at rest; terms with memory, whose past is unknown, are left out."""
    m, s = np.zeros(QUANTITIES), np.zeros(STATES)
    maps = [(term_of(use).law, values_of(use)) for use in shaping if term_of(use).place == "windup"]
    adds = [(t.law, values_of(use)) for use in shaping if (t := term_of(use)).place == "spring" and not t.memory]

    def passes(windup: float) -> float:
        m[motion.STIFFNESS], m[motion.VALUE] = plant.stiffness, windup
        for law, values in maps:
            m[motion.VALUE] = law(m, values, s)
        m[motion.WINDUP] = m[motion.VALUE]
        return float(plant.stiffness * m[motion.WINDUP] + sum(law(m, values, s) for law, values in adds))

    return passes
