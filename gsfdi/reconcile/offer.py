"""What each term of the shelf could be here: trial values in the joint's own scales, ready to be replayed.

An offer is a term with one column or two. A column is a trial of the term whose trace, less the trace without it, is
the term's signature; a term that is linear in two numbers at once (sine and cosine of a phase, spring and rest angle)
needs two. Numbers that enter non-linearly stand on a small grid, one offer each.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gsfdi.model import Side, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.scales import Scales
from gsfdi.types import Array

Values = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Offer:
    """A term to try.

    Parameters
    ----------
    term : str
    side : {'motor', 'output'} or None
    columns : tuple of mapping
        Trial values, one mapping a column.
    mix : callable
        Coefficients of the columns -> values of the term, or None where no such term can exist.
    least : float
        Least value of its first number where the model holds so much of it that less may be true, else 0.
    """

    term: str
    side: Side | None
    columns: tuple[Values, ...]
    mix: Callable[[Array], Values | None]
    least: float = 0.0

    def use(self, values: Values, onset: float | None = None) -> TermUse:
        """Write the term as a model holds it."""
        return TermUse(self.term, dict(values), self.side, onset)


def _along(term: PhysicsTerm, trial: Values, name: str) -> Callable[[Array], Values | None]:
    """Mix of one column: parameter `name` in proportion to the coefficient."""
    param = term.param(name)
    neutral = param.neutral if param.neutral is not None else 0.0

    def mix(c: Array) -> Values | None:
        value = neutral + float(c[0]) * (trial[name] - neutral)
        return {**trial, name: value} if param.low <= value <= param.high and c[0] != 0 else None

    return mix


def _waves(
    trial: Values, size: str, phase: str, sense: float = 1.0
) -> tuple[tuple[Values, ...], Callable[[Array], Values | None]]:
    """Sine and cosine of one wave; `sense` is -1 where the phase is subtracted."""

    def mix(c: Array) -> Values | None:
        size_now = float(np.hypot(c[0], c[1])) * trial[size]
        return {**trial, size: size_now, phase: sense * math.atan2(c[1], c[0])} if size_now > 0 else None

    return ({**trial, phase: 0.0}, {**trial, phase: sense * math.pi / 2}), mix


def _lever(
    trial: Values, size: str, arm: str, ends: tuple[float, float]
) -> tuple[tuple[Values, ...], Callable[[Array], Values | None]]:
    """Number and arm of ``size · (x - arm)`` or ``size · (1 + arm x)``, spanned by the two ends of the arm."""

    def mix(c: Array) -> Values | None:
        whole = float(c[0] + c[1])
        if whole <= 0:
            return None
        return {**trial, size: whole * trial[size], arm: float(c[0] * ends[0] + c[1] * ends[1]) / whole}

    return ({**trial, arm: ends[0]}, {**trial, arm: ends[1]}), mix


def offers(term: PhysicsTerm, scales: Scales, orders: Mapping[str, Sequence[float]]) -> Iterator[Offer]:
    """Every form in which `term` is to be tried.

    Parameters
    ----------
    term : PhysicsTerm
    scales : Scales
    orders : mapping of str to sequence of float
        Orders worth trying for the terms that are waves.
    """
    for side in term.sides or (None,):
        if term.name in orders:
            size = term.params[0]
            for order in orders[term.name]:
                trial = {size.name: 0.1 * _wave_size(size.unit, term, scales), "order": order, "phase_rad": 0.0}
                columns, mix = _waves(trial, size.name, "phase_rad")
                yield Offer(term.name, side, columns, mix)
        elif term.name in _PAIRS:
            yield from _pair(term, side, scales)
        else:
            yield from _grid(term, side, scales)


def _wave_size(unit: str, term: PhysicsTerm, scales: Scales) -> float:
    return 10 * max(scales.noise, 1e-3 * scales.reach) if term.place == "position_sensor" else scales.of(unit)


def _pair(term: PhysicsTerm, side: Side | None, scales: Scales) -> Iterator[Offer]:
    """Terms that are linear in two numbers."""
    low, high = scales.centre - scales.reach, scales.centre + scales.reach
    size = term.params[0]
    trial = {size.name: 0.1 * scales.of(size.unit)}
    if term.name == "gravity_unbalance":
        columns, mix = _waves(trial, size.name, "angle_rad")
        yield Offer(term.name, side, columns, mix)
    elif term.name == "cable_harness":
        columns, mix = _lever(trial, size.name, "rest_rad", (low, high))
        yield Offer(term.name, side, columns, mix)
    elif term.name == "temperature_dependent_friction":
        if scales.warms:
            columns, mix = _lever(trial, size.name, "per_degc", (-0.03, 0.01))
            yield Offer(term.name, side, columns, mix)
    else:
        dry, wet = (param.name for param in term.params)
        one = {dry: trial[size.name], wet: 0.0}
        two = {dry: 0.0, wet: 0.1 * scales.of(term.params[1].unit)}

        def mix(c: Array) -> Values | None:
            return {dry: float(c[0]) * one[dry], wet: float(c[1]) * two[wet]}

        yield Offer(term.name, side, (one, two), mix)


_PAIRS = ("gravity_unbalance", "cable_harness", "temperature_dependent_friction", "asymmetric_friction")


def _grid(term: PhysicsTerm, side: Side | None, scales: Scales) -> Iterator[Offer]:
    """Terms with one number that scales them and others on a grid."""
    shapes = _shapes(term, scales)
    size = next((p for p in term.params if p.neutral is not None), None)
    for point in itertools.product(*shapes.values()):
        trial = dict(zip(shapes, point, strict=True))
        if size is None or size.name in trial:
            yield Offer(term.name, side, (trial,), _inverse(trial))
            continue
        trial[size.name] = (size.neutral or 0.0) + _trial_size(term, size.name, size.unit, scales)
        if term.name == "presliding_friction":
            trial["stiffness_nm_rad"] *= trial[size.name] / scales.torque
            yield Offer(term.name, side, (trial,), _grown(trial))
            continue
        yield Offer(term.name, side, (trial,), _along(term, trial, size.name))


def _grown(trial: Values) -> Callable[[Array], Values | None]:
    """Mix of a term whose numbers all grow together: a bristle keeps the stretch at which it slides."""
    return lambda c: {name: value * float(c[0]) for name, value in trial.items()} if c[0] > 0 else None


def _inverse(trial: Values) -> Callable[[Array], Values | None]:
    """Mix of a term whose effect falls with the square of its only number."""
    ((name, value),) = trial.items()

    def mix(c: Array) -> Values | None:
        return {name: value / math.sqrt(float(c[0]))} if c[0] > 1e-4 else None

    return mix


def _trial_size(term: PhysicsTerm, name: str, unit: str, scales: Scales) -> float:
    if term.name == "structural_mode":
        return 0.05 * scales.inertia
    if term.place == "position_sensor" and unit == "rad":
        return 10 * max(scales.noise, 1e-4 * scales.reach)
    if term.name == "end_stop":
        return scales.of(unit)
    if name == "ratio":
        return 0.02
    return 0.1 * scales.of(unit, motor_axis=term.name == "velocity_bias")


def _shapes(term: PhysicsTerm, scales: Scales) -> Mapping[str, Sequence[float]]:
    """Grid of the numbers that enter non-linearly."""
    low, high = scales.centre - scales.reach, scales.centre + scales.reach
    spread = np.linspace(low, high, 11)[1:-1:2]
    stops = [a for s in (0.03, 0.1, 0.19) for a in (low + s * (high - low), high - s * (high - low))]
    middle = scales.centre
    grids: dict[str, dict[str, Sequence[float]]] = {
        "stribeck_friction": {"velocity_rad_s": [s * scales.speed for s in (0.02, 0.06, 0.15, 0.35)]},
        "presliding_friction": {"stiffness_nm_rad": [scales.torque / (s * scales.reach) for s in (2e-3, 1e-2, 5e-2)]},
        "position_dependent_friction": {
            "centre_rad": list(spread),
            "width_rad": [0.1 * scales.reach, 0.25 * scales.reach],
        },
        "gearbox_hysteresis": {"width_rad": [s * scales.windup for s in (0.1, 0.3, 1.0)]},
        "structural_mode": {
            "frequency_hz": list(np.geomspace(0.5, 0.2 / scales.period, 9)),
            "damping_ratio": [0.02],
        },
        "end_stop": {"angle_rad": [a for a in stops if (a > 0) == (a > middle)]},
        "torque_constant_drift": {"onset_s": [s * scales.seconds for s in (0.0, 0.2, 0.4, 0.6, 0.8)]},
        "magnetic_saturation": {"current_a": [s * scales.effort for s in (1.0, 3.0)]},
        "backlash": {"half_width_rad": [s * scales.windup for s in (0.02, 0.1, 0.4, 1.0)]},
        "actuation_delay": {"delay_s": [s * scales.period for s in (0.25, 1.0, 2.0)]},
        "timestamp_latency": {"delay_s": [s * scales.period for s in (0.25, 1.0, 2.0)]},
    }
    return grids.get(term.name, {})
