"""Turns a model into the arrays that the compiled replay runs on, and chooses how long a substep may be.

What a substep leaves out is how a law's torque changes within it: held at its mean, it acts on a gearbox of frequency
ω as if it were off by (ωh)²/12. At `LAW_PHASE` a viscous friction on the motor of a third of the drive's torque errs,
predicted from sample to sample, by 0.6 to 2 times the noise of a speed sensor of 2 mrad/s; a substep half as long by a
quarter of that. To carry the slope of each torque on to the next substep, and to evaluate laws at the mean state, made
slow waves six times as good and viscous friction none, since the effort jumps from tick to tick. So it is not done;
waves know their slope from their phase (see `gsfdi.wave`).
"""

import math
from bisect import bisect_left
from collections.abc import Sequence
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import register_jitable

from gsfdi.errors import UnusableInputError, nearest
from gsfdi.model import JointModel, Plant, TermUse
from gsfdi.modelfile import terms
from gsfdi.motion import DIRECTION, QUANTITIES, SPEED, STATES, TIME, Law, PhysicsTerm
from gsfdi.replay import layout
from gsfdi.sliding import SMOOTH, sliding
from gsfdi.types import Array
from gsfdi.wave import half_phase, shrunk, sine

LINEAR_PHASE = 0.5  # [rad] of the fastest mode per substep: the matrix exponential's series then holds to 1e-14
LAW_PHASE = 0.25  # the same where laws act: a harmonic oscillator made of laws is then 0.3 % off in frequency
SPRING_PHASE = 0.16  # the same where laws add to the spring itself
TURNING = 4.0  # speed below which a smooth friction turns round, over the one that it turns by
AT_REST = 0.01  # speed that is as good as none, over the one that a friction turns by
LAW_DECAY = 0.5  # largest decay of a law's damping per substep

for shared in (sliding, half_phase, shrunk, sine):
    register_jitable(shared)  # here, so that who only lists terms need not load numba

_SLOT = {
    "torque_constant": layout.TORQUE_CONSTANT,
    "current": layout.CURRENT,
    "delay": layout.DELAY,
    "windup": layout.WINDUP,
    "spring": layout.SPRING,
    "position_sensor": layout.POSITION_SENSOR,
    "velocity_sensor": layout.VELOCITY_SENSOR,
    "current_sensor": layout.CURRENT_SENSOR,
    "latency": layout.LATENCY,
    "late_velocity_sensor": layout.SPEED_LATENCY,
}
_FACTORS = ("motor_inertia", "output_inertia", "stiffness")


def term_of(use: TermUse) -> PhysicsTerm:
    """Find the term that `use` names."""
    term = terms().get(use.term)
    if term is None:
        raise UnusableInputError(f"term {use.term!r}", "no physics term is called that", nearest(use.term, terms()))
    return term


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
    motor = structure == "rigid" or side_of(use, structure) == "motor"
    if term.place == "dry":
        return layout.MOTOR_DRY if motor else layout.OUTPUT_DRY
    return layout.MOTOR_TORQUE if motor else layout.OUTPUT_TORQUE


def side_of(use: TermUse, structure: str) -> str:
    """Side on which the term sits: as `use` says, else its usual one, else the motor's; a rigid joint has only one."""
    return "output" if structure == "rigid" else use.side or next(iter(term_of(use).sides), "motor")


def is_play(term: PhysicsTerm) -> bool:
    """Whether a term lets the gearbox be loose: one that maps the wind-up, but no wave."""
    return term.place == "windup" and not term.wave


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
    """Row of a packed model for the era that begins at `time`."""
    plant = plant_at(model, time)
    gain = plant.gear_ratio * plant.torque_constant
    motor = plant.gear_ratio**2 * plant.motor_inertia
    if model.structure == "rigid":
        return [math.inf, plant.output_inertia + motor, 0.0, plant.damping, gain, time]
    return [motor, plant.output_inertia, plant.stiffness, plant.damping, gain, time]


def longest_step(model: JointModel, row: Sequence[float]) -> float:
    """Greatest substep [s] that resolves the plant of one era and the terms that act on it."""
    motor, output, stiffness, damping, *_ = row
    compliance = {"motor": 1 / motor, "output": 1 / output, "spring": 1 / motor + 1 / output}
    square, decay, phase = stiffness * compliance["spring"], 0.0, math.inf
    linear = LINEAR_PHASE / max(math.sqrt(square), damping / output, 1e-6)
    for use in model.physics:
        term = term_of(use)
        if term.wave:
            phase = min(phase, LAW_PHASE)
        if term.place not in ("torque", "dry", "windup", "spring"):
            continue
        values = values_of(use)
        place = "spring" if term.place in ("windup", "spring") else side_of(use, model.structure)
        phase = min(phase, SPRING_PHASE if term.place == "spring" else LAW_PHASE)
        square += abs(term.stiffness(values)) * compliance[place] if term.stiffness else 0.0
        decay += abs(term.damping(values)) * compliance[place] if term.damping else 0.0
    if math.isinf(phase):
        return linear
    return min(linear, phase / max(math.sqrt(square), 1e-6), LAW_DECAY / max(decay, 1e-6))


def turn_rate(model: JointModel, eras: Sequence[Sequence[float]]) -> float:
    """Fastest decay of speed by friction that turns round smoothly, at rest [1/s]: a step must be short beside it."""
    rates = {"motor": 0.0, "output": 0.0}
    m = np.zeros(QUANTITIES)
    m[DIRECTION] = 1.0
    for use in model.physics:
        term = term_of(use)
        if term.place == "dry" and use.values.get(SMOOTH.name, 0.0) > 0.0:
            m[SPEED] = AT_REST * use.values[SMOOTH.name]
            slope = term.law(m, values_of(use), np.zeros(STATES)) / m[SPEED]
            rates[side_of(use, model.structure)] += max(slope, 0.0)
    return max(max(rates["motor"] / motor, rates["output"] / output) for motor, output, *_ in eras)


def pack(model: JointModel, finer: int = 1) -> Array:
    """Pack `model` into one array for the kernel (laid out by `gsfdi.replay.layout`); `finer` divides every substep."""
    chosen = [(slot, use) for use in model.physics if (slot := slot_of(use, model.structure)) >= 0]
    chosen.sort(key=lambda pair: pair[0])
    changes = {use.onset for use in model.physics if use.onset and slot_of(use, model.structure) < 0}
    eras = [era(model, time) for time in (0.0, *sorted(changes))]
    slots = [slot for slot, _ in chosen]
    wave = 0.0
    rows = np.zeros((len(chosen), layout.TERM_WIDTH))
    for row, (_, use) in zip(rows, chosen, strict=True):
        values, term = values_of(use), term_of(use)
        row[layout.ADDRESS] = compiled(term.law).address  # below 2^53, so exact
        row[layout.ONSET] = -math.inf if use.onset is None else use.onset
        row[layout.PARAMS : layout.PARAMS + values.size] = values
        if term.wave:
            wave = max(wave, float(values[[param.name for param in term.params].index(term.wave)]))
    step = min(longest_step(model, row) for row in eras) / finer
    law = model.controller
    gains = (
        (law.at_once, law.integral, law.derivative, law.rate_feedforward, law.limit, law.derivative_delay)
        if law
        else (0,) * 6
    )
    rigid = model.structure == "rigid"
    slow = TURNING * max((use.values.get(SMOOTH.name, 0.0) for use in model.physics), default=0.0)
    play = any(is_play(term_of(use)) for _, use in chosen)
    turn = turn_rate(model, eras) * finer
    sided = any(term_of(use).sided for _, use in chosen)
    head = [*gains, step, wave * finer, model.plant.gear_ratio, rigid, slow, turn, play, sided, len(eras)]
    first = [bisect_left(slots, slot) for slot in range(layout.SLOTS + 1)]
    return np.concatenate([head, first, np.ravel(eras), rows.ravel()], dtype=np.float64)


def stack(packed: Sequence[Array]) -> Array:
    """Stack packed models (batch, length); each knows its own length, so what pads it is never read."""
    out = np.zeros((len(packed), max(array.size for array in packed)))
    for row, array in zip(out, packed, strict=True):
        row[: array.size] = array
    return out
