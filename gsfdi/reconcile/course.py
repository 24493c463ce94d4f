"""What one stretch's log shows of the motion, drawn through once and read at any moment."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from gsfdi.drive import measured_velocity
from gsfdi.model import JointModel
from gsfdi.reconcile.gaps import at_corners, at_jolts, beside_lost
from gsfdi.reconcile.sensing import setpoint_rate
from gsfdi.types import Array, JointRecord, Mask

LEAST = 50
"""Samples that a stretch must have."""
CALM = 9
"""Samples through which a cubic is drawn to tell a speed from its noise."""


@dataclass(frozen=True)
class Curve:
    """Values read at any moment by cubics, which follow a ringing joint where straight lines would not."""

    known: Array
    values: Array

    def __call__(self, t: Array) -> Array:
        """Values at times `t`, beyond the ends those of the ends."""
        at = np.clip(t, self.known[0], self.known[-1])
        return self.values if np.array_equal(at, self.known) else np.asarray(self._cubics(at))

    @cached_property
    def _cubics(self) -> CubicSpline:
        return CubicSpline(self.known, self.values)


@dataclass(frozen=True)
class Course:
    """Position and speed of a stretch, and what the setpoint asks for, whatever the law makes of them.

    Parameters
    ----------
    record : JointRecord
    good : (n,) bool array
        Samples of which both position and speed are logged.
    position, velocity : Curve
        Drawn through these, the speed on the joint's side of the gear [rad, rad/s].
    rate : (n,) array
        Of the setpoint [rad/s].
    unrated : (n,) bool array
        Samples at which nobody knows it.
    """

    record: JointRecord
    good: Mask
    position: Curve
    velocity: Curve
    rate: Array
    unrated: Mask

    @cached_property
    def ahead(self) -> Array:
        """Effort that was fed forward."""
        name = f"{self.record.effort}_feedforward"
        return np.nan_to_num(self.record[name]) if name in self.record else np.zeros(len(self.record.t))

    def velocity_at(self, t: Array, age: float) -> Array:
        """Speed of age `age` at times `t`; one that is newer than the log has it still has the log's noise."""
        if age >= 0.0:
            return self.velocity(t - age)
        return self.velocity(t) + self._calm(t - age) - self._calm(t)

    @cached_property
    def _calm(self) -> Curve:
        return Curve(self.velocity.known, np.asarray(savgol_filter(self.velocity.values, CALM, 3)))


def course_of(record: JointRecord, model: JointModel, beyond: Array | float = 0.0) -> Course | None:
    """Read a stretch; None where too little of it is logged.

    Parameters
    ----------
    record : JointRecord
    model : JointModel
    beyond : (n,) array, optional
        What the motor's speed has beyond the slope of the positions [rad/s], where no speed is logged.
    """
    position, velocity = record["position"], measured_velocity(record, model)
    if model.structure == "flexible":
        velocity = velocity / model.plant.gear_ratio
    untold = not np.isfinite(velocity).any()
    if untold:
        velocity = np.gradient(position, record.t) + beyond
    good = np.isfinite(position) & np.isfinite(velocity)
    if good.sum() < LEAST:
        return None
    unknown = unrated(record, untold and model.structure == "flexible")
    way, speed = (Curve(record.t[good], values[good]) for values in (position, velocity))
    return Course(record, good, way, speed, setpoint_rate(record), unknown)


def unrated(record: JointRecord, winds: bool = False) -> Mask:
    """Samples at which nobody knows the setpoint's rate: beside lost ones and at corners, unless the rate is logged.

    A motor that nobody sees and that `winds` up its gearbox has a speed of its own, beside which only jolts matter. To
    leave out more would cost more: what is not told of the effort's noise looks like losses in the gearbox.
    """
    if "setpoint_rate" in record:
        return np.zeros(len(record.t), dtype=np.bool_)
    corners = at_jolts if winds else at_corners
    ends = np.isin(np.arange(len(record.t)), (0, len(record.t) - 1))  # where a slope has one side only
    return ends | beside_lost(record) | corners(record["setpoint"], record.t)
