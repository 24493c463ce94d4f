"""Numbers of a model that a fit may turn."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.model import JointModel
from gsfdi.types import Array

START, INTEGRAL, BRISTLES, SHIFT, SWING, SWING_RATE, START_RATE = range(-2, -9, -1)
"""Places of what a stretch of a `Started` model begins with: wind-up, the controller's integral part, bristles; of its
shift of time; of how an appendage swings as a stretch begins; and of how fast the wind-up grows then."""

BEGINS = {
    START: "windups",
    INTEGRAL: "integrals",
    BRISTLES: "bristles",
    SWING: "swings",
    SWING_RATE: "swing_rates",
    START_RATE: "windup_rates",
}


@dataclass(frozen=True, slots=True)
class Started(JointModel):
    """A model with what each stretch begins with: wind-up, integral part, stretch of bristles and swing of a mode.

    The wind-up is that beyond what balances the first effort [rad], the stretch of bristles a share of the full. No
    sensor tells the motor's absolute angle, so that the wind-up at the start is as unknown as any parameter, and so
    is the integral part of the controller that told a speed, beyond what was assumed of it. What went before a gap
    has left bristles somewhere, too, and an appendage swinging: behind the joint by an angle [rad] and a speed [rad/s].
    A joint that swings on its gearbox while the motor sticks begins with a wind-up that changes [rad/s].

    And a log that a simulator made in steps has a shift of time, of half a step: each effort acts as long before its
    stamp, and each speed is as much older than its stamp [s].
    """

    windups: tuple[float, ...] = ()
    integrals: tuple[float, ...] = ()
    bristles: tuple[float, ...] = ()
    swings: tuple[float, ...] = ()
    swing_rates: tuple[float, ...] = ()
    windup_rates: tuple[float, ...] = ()
    shift: float = 0.0

    def beginning(self, name: str, stretch: int, value: float) -> "Started":
        """Give the same model with one of these numbers at `value`."""
        row = list(getattr(self, name))
        row[stretch] = value
        return replace(self, **{name: tuple(row)})  # type: ignore[arg-type]  # mypy cannot tell which field it is

    def begun(self, numbers: tuple[float, ...]) -> "Started":
        """Give the same model whose stretches begin with `numbers`, one by stretch, in all that they begin with."""
        return replace(self, **dict.fromkeys(BEGINS.values(), numbers))  # type: ignore[arg-type]  # as above


AT_END = 1e-3
"""Distance from an end, as a share of a knob's step, at which a fit has ended there: the gauge moves it that much."""


@dataclass(frozen=True, slots=True)
class Knob:
    """One number of a model that a fit may turn.

    Parameters
    ----------
    place : int
        Index of the term in the model's physics; -1 for a number of the linear plant, one of `BEGINS` for that with
        which a stretch of a :class:`Started` model begins, `SHIFT` for its shift of time.
    name : str
        Field of the plant, or parameter of the term.
    scale : float
        A change of this size matters: the unit in which the fit counts.
    low, high : float
        Bounds.
    prior : float or None
        What is believed before the data, with standard deviation `doubt`; None believes nothing.
    is_size : bool
        Whether a change may be felt by its share of the value. A phase counts from anywhere, and a wave's order times
        the way that the joint goes is a phase.
    """

    place: int
    name: str
    scale: float
    low: float = -np.inf
    high: float = np.inf
    prior: float | None = None
    doubt: float = np.inf
    is_size: bool = True

    def read(self, model: JointModel) -> float:
        """Read the knob's value off `model`."""
        if self.place in BEGINS:
            return float(getattr(model, BEGINS[self.place])[int(self.name)]) if isinstance(model, Started) else 0.0
        if self.place == SHIFT:
            return float(getattr(model, self.name, 0.0))
        if self.place < 0:
            return float(getattr(model.plant, self.name))
        use = model.physics[self.place]
        if self.name == "onset":
            return float(use.onset or 0.0)
        return float(use.values[self.name])

    def is_at(self, end: float, value: float) -> bool:
        """Whether `value` lies at an end of the knob's, as nearly as a fit leaves it there."""
        return abs(value - end) < AT_END * self.scale

    def is_at_end(self, value: float) -> bool:
        """Whether a number ended where it may go no farther."""
        return self.is_at(self.low, value) or self.is_at(self.high, value)

    def turn(self, model: JointModel, value: float) -> JointModel:
        """Give `model` with this knob at `value`, kept within its bounds."""
        value = float(min(max(value, self.low), self.high))
        if self.place in BEGINS and isinstance(model, Started):
            return model.beginning(BEGINS[self.place], int(self.name), value)
        if self.place == SHIFT:
            return replace(model, **{self.name: value})  # type: ignore[arg-type]  # as above
        if self.place < 0:
            return replace(model, plant=replace(model.plant, **{self.name: value}))
        use = model.physics[self.place]
        if self.name == "onset":
            new = replace(use, onset=value)
        else:
            new = replace(use, values={**use.values, self.name: value})
        return model.with_use(self.place, new)


def turned(model: JointModel, knobs: Sequence[Knob], values: Array) -> JointModel:
    """`model` with every knob at its value."""
    for knob, value in zip(knobs, values, strict=True):
        model = knob.turn(model, value)
    return model
