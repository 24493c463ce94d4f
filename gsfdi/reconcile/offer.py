"""What each term of the shelf could be here: trial values in the joint's own scales, ready to be replayed.

An offer is a term with one column or two. A column is a trial of the term whose trace, less the trace without it, is
the term's signature; a term that is linear in two numbers at once (sine and cosine of a phase, spring and rest angle)
needs two. Numbers that enter non-linearly stand on a small grid, one offer each. Which number is which, and in what
sizes it is tried, the term's own file says.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gsfdi.model import Side, TermUse
from gsfdi.motion import Param, PhysicsTerm
from gsfdi.registry import shelf
from gsfdi.scales import Scales
from gsfdi.types import Array

Values = Mapping[str, float]
Mix = Callable[[Array], Values | None]
Form = tuple[tuple[Values, ...], Mix]
"""Columns of an offer, and how they mix."""
OFF = 0.05
"""How far off 1 a ratio to what is nominal is tried."""
FAR_LESS = 0.3
"""Ratio at which the fit of one begins that regression puts below what is possible."""
SHARE = 0.1
"""Share of what is usual in its unit at which any other number that sizes a term is tried, at most."""


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
    sets_in : {'readily', 'rarely', 'never'}
        How it may set in during a recording.
    """

    term: str
    side: Side | None
    columns: tuple[Values, ...]
    mix: Mix
    least: float = 0.0
    sets_in: Literal["readily", "rarely", "never"] = "readily"

    def use(self, values: Values, onset: float | None = None) -> TermUse:
        """Write the term as a model holds it."""
        return TermUse(self.term, dict(values), self.side, onset)

    def opposite(self, column: int) -> Values | None:
        """Turn the trial of a column round, None where it has no other way to act."""
        values, params = self.columns[column], shelf("gsfdi.terms", PhysicsTerm)[self.term].params
        phase = next((p.name for p in params if p.kind == "angle" and p.trials is None and p.name in values), None)
        if phase is not None:
            return {**values, phase: values[phase] + math.pi}
        sized = [p for p in params if p.neutral is not None and p.trials is None and p.name in values]
        turned = {p.name: 2 * (p.neutral or 0.0) - values[p.name] for p in sized}
        return {**values, **turned} if sized and all(p.low <= turned[p.name] <= p.high for p in sized) else None


def offers(
    term: PhysicsTerm, scales: Scales, worthy: Mapping[str, Sequence[float]], share: float = SHARE
) -> Iterator[Offer]:
    """Every form in which `term` is to be tried.

    Parameters
    ----------
    term : PhysicsTerm
    scales : Scales
    worthy : mapping of str to sequence of float
        Orders worth trying for the terms that are waves, frequencies for those that are resonances.
    share : float
        Share of what is usual at which a number that sizes the term is tried.
    """
    for side in term.sides or (None,):
        for columns, mix in _forms(term, scales, worthy.get(term.name, ()), share):
            yield Offer(term.name, side, columns, mix, sets_in=term.sets_in)


def _forms(term: PhysicsTerm, scales: Scales, worthy: Sequence[float], share: float) -> Iterator[Form]:
    """Columns and mix for every point of the grid on which the numbers stand that enter non-linearly."""
    trials = {param.name: param.trials(scales) for param in term.numbers if param.trials is not None}
    if not all(trials.values()):
        return
    for searched in filter(None, (term.order, term.frequency)):
        trials[searched.name] = worthy
    ends = {param.name: trials.pop(param.name) for param in term.params if param.kind == "arm"}
    size = next((p for p in term.params if p.neutral is not None and p.trials is None), None)
    small = {param.name: _small(param, scales, share) for param in term.params if param is size or param.linear}
    for point in itertools.product(*trials.values()):
        shape = dict(zip(trials, point, strict=True))
        yield _inverse(shape) if size is None else _sized(term, size, small, shape, ends, share)


def _sized(
    term: PhysicsTerm, size: Param, small: Values, shape: Values, ends: Mapping[str, Sequence[float]], share: float
) -> Form:
    """Columns and mix of a term that one of its numbers sizes, the others having or not having a `shape`."""
    value = small[size.name]
    phase = next((p.name for p in term.params if p.kind == "angle" and p.name not in shape), None)
    if phase is not None:
        return _waves({size.name: value, **shape}, size.name, phase)
    if ends:
        ((arm, (low, high)),) = ends.items()
        return _lever({size.name: value, **shape}, size.name, arm, (low, high))
    beside = next((p for p in term.params if p.linear and p is not size), None)
    if beside is not None:
        return _two({size.name: value}, {beside.name: small[beside.name]})
    followers = [p.name for p in term.params if p.kind == "follower"]
    if followers:
        grown = {name: shape[name] * share for name in followers}
        return _grown({**shape, **grown, size.name: value}, (*followers, size.name))
    return _along({**shape, size.name: value}, size)


def _small(size: Param, scales: Scales, share: float) -> float:
    """Value at which a number that sizes a term is tried."""
    if size.size is not None:
        return size.size(scales)
    return 1.0 + OFF if size.neutral == 1.0 else share * scales.of(size.unit)


def _along(trial: Values, size: Param) -> Form:
    """One column: the number `size` moves from its neutral value in proportion to the coefficient.

    A ratio may be far below 1, where regression, which draws a straight line, ends below zero.
    """
    neutral = size.neutral or 0.0

    def mix(c: Array) -> Values | None:
        value = neutral + float(c[0]) * (trial[size.name] - neutral)
        if neutral == 1.0 and value < size.low:
            value = FAR_LESS
        return {**trial, size.name: value} if size.low <= value <= size.high and c[0] != 0 else None

    return (trial,), mix


def _waves(trial: Values, size: str, phase: str) -> Form:
    """Sine and cosine of one wave."""

    def mix(c: Array) -> Values | None:
        size_now = float(np.hypot(c[0], c[1])) * trial[size]
        return {**trial, size: size_now, phase: math.atan2(c[1], c[0])} if size_now > 0 else None

    return ({**trial, phase: 0.0}, {**trial, phase: math.pi / 2}), mix


def _lever(trial: Values, size: str, arm: str, ends: tuple[float, float]) -> Form:
    """Number and arm of ``size · (x - arm)`` or ``size · (1 + arm x)``, spanned by the two ends of the arm."""

    def mix(c: Array) -> Values | None:
        whole = float(c[0] + c[1])
        if whole <= 0:
            return None
        return {**trial, size: whole * trial[size], arm: float(c[0] * ends[0] + c[1] * ends[1]) / whole}

    return ({**trial, arm: ends[0]}, {**trial, arm: ends[1]}), mix


def _two(one: Values, other: Values) -> Form:
    """Two numbers that both enter in proportion."""
    ((first, size),), ((second, beside),) = one.items(), other.items()

    def mix(c: Array) -> Values | None:
        return {first: float(c[0]) * size, second: float(c[1]) * beside}

    return ({first: size, second: 0.0}, {first: 0.0, second: beside}), mix


def _grown(trial: Values, names: Sequence[str]) -> Form:
    """Numbers that grow together, as those of a bristle that keeps the stretch at which it slides."""

    def mix(c: Array) -> Values | None:
        return {**trial, **{name: trial[name] * float(c[0]) for name in names}} if c[0] > 0 else None

    return (trial,), mix


def _inverse(trial: Values) -> Form:
    """Only number of a term whose effect falls with its square."""
    ((name, value),) = trial.items()

    def mix(c: Array) -> Values | None:
        return {name: value / math.sqrt(float(c[0]))} if c[0] > 1e-4 else None

    return (trial,), mix
