"""What a fit may turn: numbers of the plant as far as they are believed, and those of terms within reason."""

import numpy as np

from gsfdi.bristle import MEMORY
from gsfdi.fit import BRISTLES, INTEGRAL, START, START_RATE, SWING, SWING_RATE, Knob
from gsfdi.model import JointModel
from gsfdi.motion import Param, PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import sticks
from gsfdi.reconcile.surplus import surplus
from gsfdi.reconcile.turning import DOUBT, believed
from gsfdi.registry import shelf

FARTHEST = 100.0
"""Times what is usual at which a stretch may begin: in a gearbox that plays, wherever in its gap the joint was left.

Of one that plays by 4 mrad, 55 times its wind-up, the gap was 5 % off within 20 times, and a position bias came beside.
"""


def plant_knobs(model: JointModel, effort: str) -> list[Knob]:
    """Knobs of the linear plant and of the terms that the nominal holds, each believed as far as the model says."""
    plant = model.plant
    names = ["output_inertia"]
    if effort == "motor_current":
        names.append("torque_constant")
    if model.structure == "flexible":
        names += ["motor_inertia", "stiffness"]
    if plant.damping > 0:  # taken as exact, it would tell the scale of torque from whatever else the model lacks
        names.append("damping")
    knobs = [_believed(-1, name, getattr(plant, name), model.trust.get(name, DOUBT)) for name in names]
    terms = shelf("gsfdi.terms", PhysicsTerm)
    for place, use in enumerate(model.physics):
        size = terms[use.term].params[0]
        value = use.values.get(size.name, size.start)
        if size.linear and value != 0:
            knobs.append(_believed(place, size.name, value, DOUBT))
    return knobs


def start_knobs(stand: Bench) -> list[Knob]:
    """Knobs of what each stretch begins with: wind-up, its rate, bristles, the integral part of a law that told speeds.

    A motor that sticks leaves the joint swinging on its gearbox. What observers make of that in the first moments is
    not its own speed, and the joint slipped too soon by it: a stiffness that changed after 6 s seemed to mend that.
    Where nothing sticks that speed is soon forgotten, and one number that is off was no longer found alone beside it.
    """
    sizes = dict[int, float]()
    if stand.model.structure == "flexible":
        sizes[START] = stand.scales.windup
        if sticks(stand.model):
            sizes[START_RATE] = float(np.sqrt(stand.doubt[3, 3]))
    if stand.lever > 0:
        sizes[INTEGRAL] = float(np.sqrt(stand.system.R[1])) / stand.lever
    terms = shelf("gsfdi.terms", PhysicsTerm)
    held = any(MEMORY in terms[use.term].params for use in stand.model.physics)
    return (bristle_knobs(stand) if held else []) + [
        Knob(place, str(i), size, -FARTHEST * size, FARTHEST * size, 0.0, 2 * size)
        for place, size in sizes.items()
        if size > 0
        for i in range(len(stand.records))
    ]


def bristle_knobs(stand: Bench) -> list[Knob]:
    """Knobs of how far bristles are stretched where a stretch begins: at rest, most likely, but a gap comes first."""
    return [Knob(BRISTLES, str(i), 0.2, -1.0, 1.0, 0.0, 0.5, is_size=False) for i in range(len(stand.records))]


def swing_knobs(stand: Bench, frequency: float) -> list[Knob]:
    """Knobs of how an appendage of this frequency [Hz] swings as a stretch begins: as far as drives shake it."""
    omega = 2 * np.pi * frequency
    rate = stand.scales.torque / stand.scales.inertia / omega
    return [
        Knob(place, str(i), 0.1 * size, -20 * size, 20 * size, 0.0, size)
        for place, size in ((SWING, rate / omega), (SWING_RATE, rate))
        for i in range(len(stand.records))
    ]


def _believed(place: int, name: str, value: float, share: float) -> Knob:
    doubt = share * abs(value)
    return Knob(place, name, doubt, *believed(value, doubt), value, doubt)


def term_knobs(stand: Bench, model: JointModel, place: int) -> list[Knob]:
    """Knobs of the term at `place`: its numbers, within what the shelf allows and this motion could show."""
    use = model.physics[place]
    term = shelf("gsfdi.terms", PhysicsTerm)[use.term]
    knobs = bristle_knobs(stand) if MEMORY in term.params else []
    for param in term.params:
        if param.kind == "choice" or param.name not in use.values:
            continue
        value = use.values[param.name]
        low, high = plausible(stand, term, param, value)
        if param.kind == "follower":  # a faint bristle is soft, too
            low *= min(1.0, abs(use.values[term.params[0].name]) / stand.scales.torque)
        if param.kind != "angle":
            low, high = max(low, param.low), min(high, param.high)
        if param is term.params[0] and (spare := surplus(stand.model, term, use.side)) > 0:
            low = -spare
        is_size = param is not term.order and param.kind != "angle"
        knobs.append(Knob(place, param.name, _step(stand, term, param, value), low, high, is_size=is_size))
    return knobs


def plausible(stand: Bench, term: PhysicsTerm, param: Param, value: float) -> tuple[float, float]:
    """Bounds within which a number near `value` is still what its name says, on this motion."""
    if param.plausible is not None:
        return param.plausible(stand.scales, value)
    if param is term.order:
        off = ORDER_OFF * value if stand.model.axis == "rotary" else TRAVEL_OFF / _turns(stand, term)
        return max(FIRST, value - off), value + off
    return (-ROUND, ROUND) if param.kind == "angle" else (-np.inf, np.inf)


ORDER_OFF = 0.01
"""Share by which a whole order may seem off, as that of a wave which repeats with each turn of a magnet or a disc: as
much as the gear ratio in the model may."""
TRAVEL_OFF = 0.6
"""Waves of a travel by which an order may be off, where nothing says that it is whole; a grid has no wider gaps."""
FIRST = 0.7
"""Least order of a wave: a slower one is what a weight or a cable does, too."""
ROUND = 20.0
"""How far a fit may turn a phase [rad]: round and round, for after each turn it is the same again."""


def _step(stand: Bench, term: PhysicsTerm, param: Param, value: float) -> float:
    """Size of a change that matters to a number."""
    if param.step is not None:
        return param.step(stand.scales)
    if param is term.order:
        return 0.3 / (np.pi * max(_turns(stand, term), 1.0))
    if param.kind == "angle":  # it counts from anywhere, so that its own size says nothing
        return param.typical
    return abs(value - (param.neutral or 0.0)) or param.typical


def _turns(stand: Bench, term: PhysicsTerm) -> float:
    """Revolutions, of the motor or of the joint, over the motion's range."""
    turns = 1.0 if term.place == "position_sensor" else stand.model.plant.gear_ratio
    return stand.scales.reach * turns / np.pi
