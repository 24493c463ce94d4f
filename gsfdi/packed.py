"""Turns a model into the arrays that the compiled replay runs on."""

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types

from gsfdi import replay
from gsfdi.errors import UnusableInputError, nearest
from gsfdi.model import JointModel, Plant, TermUse
from gsfdi.motion import QUANTITIES, STATES, STIFFNESS, TIME, VALUE, WINDUP, Law, PhysicsTerm
from gsfdi.registry import shelf
from gsfdi.types import Array

PARAMETERS = 4  # columns of a packed term: no term has more
LINEAR_PHASE = 0.5  # [rad] of the fastest mode per substep: the matrix exponential's series then holds to 1e-14
LAW_PHASE = 0.25  # the same where laws act: a harmonic oscillator made of laws is then 0.3 % off in frequency
LAW_DECAY = 0.5  # largest decay of a law's damping per substep

_SLOT = {
    "torque_constant": replay.TORQUE_CONSTANT,
    "current": replay.CURRENT,
    "delay": replay.DELAY,
    "windup": replay.WINDUP,
    "spring": replay.SPRING,
    "position_sensor": replay.POSITION_SENSOR,
    "velocity_sensor": replay.VELOCITY_SENSOR,
    "current_sensor": replay.CURRENT_SENSOR,
    "latency": replay.LATENCY,
}
_FACTORS = ("motor_inertia", "output_inertia", "stiffness")


def terms() -> dict[str, PhysicsTerm]:
    """Every term of the shelf by its id."""
    return shelf("gsfdi.terms", PhysicsTerm)


def term_of(use: TermUse) -> PhysicsTerm:
    """Find the term that `use` names."""
    if use.term not in terms():
        raise UnusableInputError(f"term {use.term!r}", "no physics term is called that", nearest(use.term, terms()))
    return terms()[use.term]


@cache
def compiled(law: Law) -> Any:
    """Compile `law` to machine code, or load it from numba's cache; its ``address`` goes to the kernel."""
    pointer = types.CPointer(types.float64)
    return numba.cfunc(types.float64(pointer, pointer, pointer), cache=True, error_model="numpy")(law)


def values_of(use: TermUse) -> Array:
    """Parameters of `use` in the order of its term, with what it leaves out at its start value."""
    return np.array([use.values.get(param.name, param.start) for param in term_of(use).params])


def slot_of(use: TermUse, structure: str) -> int:
    """Slot of the kernel in which the term's law runs; -1 for a factor on the plant."""
    term = term_of(use)
    if structure not in term.structures:
        raise UnusableInputError(f"term {term.name!r}", f"a {structure} joint has none", "it needs a flexible joint")
    if term.place in _FACTORS:
        return -1
    if term.place in _SLOT:
        return _SLOT[term.place]
    motor = structure == "rigid" or side_of(use) == "motor"
    if term.place == "dry":
        return replay.MOTOR_DRY if motor else replay.OUTPUT_DRY
    return replay.MOTOR_TORQUE if motor else replay.OUTPUT_TORQUE


def side_of(use: TermUse) -> str:
    """Side on which the term sits: as `use` says, else the term's usual one, else the motor's."""
    return use.side or next(iter(term_of(use).sides), "motor")


def plant_at(model: JointModel, time: float) -> Plant:
    """Plant with the factors that have set in by `time`."""
    plant = model.plant
    factor = dict.fromkeys(_FACTORS, 1.0)
    m = np.zeros(QUANTITIES)
    m[TIME] = time
    for use in model.physics:
        term = term_of(use)
        if term.place in _FACTORS and (use.onset is None or time >= use.onset):
            factor[term.place] *= term.law(m, values_of(use), np.zeros(STATES))
    return Plant(
        output_inertia=plant.output_inertia * factor["output_inertia"],
        motor_inertia=plant.motor_inertia * factor["motor_inertia"],
        gear_ratio=plant.gear_ratio,
        stiffness=plant.stiffness * factor["stiffness"],
        damping=plant.damping,
        torque_constant=plant.torque_constant,
    )


def era(model: JointModel, time: float) -> list[float]:
    """Row of `replay.Joint.eras` that begins at `time`."""
    plant = plant_at(model, time)
    gain = plant.gear_ratio * plant.torque_constant
    motor = plant.gear_ratio**2 * plant.motor_inertia
    if model.structure == "rigid":
        return [math.inf, plant.output_inertia + motor, 0.0, plant.damping, gain, 1.0, time]
    return [motor, plant.output_inertia, plant.stiffness, plant.damping, gain, 0.0, time]


def longest_step(model: JointModel, row: Sequence[float], finer: int) -> float:
    """Greatest substep [s] that resolves the plant of one era and the terms that act on it."""
    motor, output, stiffness, damping, _, rigid, _ = row
    compliance = {"motor": 1 / motor, "output": 1 / output, "spring": 1 / motor + 1 / output}
    square, decay, laws = stiffness * compliance["spring"], 0.0, False
    linear = min(LINEAR_PHASE / math.sqrt(max(square, 1e-12)), LINEAR_PHASE * output / max(damping, 1e-12))
    for use in model.physics:
        term = term_of(use)
        if term.place not in ("torque", "dry", "windup", "spring"):
            continue
        laws, values = True, values_of(use)
        place = "spring" if term.place in ("windup", "spring") else "output" if rigid else side_of(use)
        square += abs(term.stiffness(values)) * compliance[place] if term.stiffness else 0.0
        decay += abs(term.damping(values)) * compliance[place] if term.damping else 0.0
    if not laws:
        return linear / finer
    return min(linear, LAW_PHASE / math.sqrt(max(square, 1e-12)), LAW_DECAY / max(decay, 1e-12)) / finer


def pack(model: JointModel, finer: int = 1) -> replay.Joint:
    """Pack `model` for the kernel; `finer` divides every substep."""
    chosen = [(slot, use) for use in model.physics if (slot := slot_of(use, model.structure)) >= 0]
    chosen.sort(key=lambda pair: pair[0])
    changes = {use.onset for use in model.physics if slot_of(use, model.structure) < 0 and use.onset}
    eras = [era(model, time) for time in (0.0, *sorted(changes))]
    params, states = np.zeros((len(chosen), PARAMETERS)), np.zeros((len(chosen), STATES))
    wave = 0.0
    for row, (_, use) in zip(params, chosen, strict=True):
        values, term = values_of(use), term_of(use)
        row[: values.size] = values
        if term.wave:
            wave = max(wave, float(values[[param.name for param in term.params].index(term.wave)]))
    slots = np.array([slot for slot, _ in chosen], dtype=np.int64)
    control = model.controller
    return replay.Joint(
        eras=np.array(eras),
        controller=np.array(
            [
                control.proportional,
                control.integral,
                control.derivative,
                control.rate_feedforward,
                control.limit,
            ]
            if control
            else [0.0, 0.0, 0.0, 0.0, math.inf]
        ),
        steps=np.array([min(longest_step(model, row, finer) for row in eras), wave * finer, model.plant.gear_ratio]),
        address=np.array([compiled(term_of(use).law).address for _, use in chosen], dtype=np.int64),
        first=np.searchsorted(slots, np.arange(replay.SLOTS + 1)),
        params=params,
        onset=np.array([-math.inf if use.onset is None else use.onset for _, use in chosen]),
        states=states,
    )


def stack(joints: Sequence[replay.Joint]) -> replay.Joint:
    """Stack packed models of whatever shape along a leading axis."""
    if len(joints) == 1:
        return joints[0]._replace(**{name: array[None] for name, array in joints[0]._asdict().items()})

    def padded(arrays: Sequence[Any], fill: float) -> Any:
        rows = max(array.shape[0] for array in arrays)
        out = np.full((len(arrays), rows, *arrays[0].shape[1:]), fill, dtype=arrays[0].dtype)
        for target, array in zip(out, arrays, strict=True):
            target[: array.shape[0]] = array
        return out

    # A padded era never comes: it begins at infinity.
    fills: dict[str, float] = {"eras": math.inf}
    return replay.Joint(
        **{name: padded([getattr(j, name) for j in joints], fills.get(name, 0)) for name in replay.Joint._fields}
    )


def spring_inverse(model: JointModel, torque: float) -> float:
    """Wind-up at which the spring passes on `torque`, whatever terms shape it."""
    plant = plant_at(model, 0.0)
    shaping = [use for use in model.physics if term_of(use).place in ("windup", "spring")]
    if not shaping:
        return torque / plant.stiffness
    low, high = -(abs(torque) / plant.stiffness + 0.1), abs(torque) / plant.stiffness + 0.1
    passes = _spring(model, plant, shaping)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if passes(middle) < torque else (low, middle)
    return 0.5 * (low + high)


def _spring(model: JointModel, plant: Plant, shaping: Sequence[TermUse]) -> Callable[[float], float]:
    """Torque of the spring against wind-up at rest; terms with memory, whose past is unknown, are left out."""
    m = np.zeros(QUANTITIES)

    def passes(windup: float) -> float:
        m[STIFFNESS], m[VALUE] = plant.stiffness, windup
        for use in shaping:
            if term_of(use).place == "windup" and not term_of(use).wave:
                m[VALUE] = term_of(use).law(m, values_of(use), np.zeros(STATES))
        m[WINDUP] = m[VALUE]
        added = sum(
            term_of(use).law(m, values_of(use), np.zeros(STATES))
            for use in shaping
            if term_of(use).place == "spring" and not term_of(use).memory
        )
        return float(plant.stiffness * m[WINDUP] + added)

    return passes
