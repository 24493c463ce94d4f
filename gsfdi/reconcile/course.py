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
class Course:
    """Position and speed of a stretch, and what the setpoint asks for, whatever the law makes of them.

    Parameters
    ----------
    record : JointRecord
    good : (n,) bool array
        Samples of which both position and speed are logged.
    position, velocity : (m,) arrays
        There, the speed on the joint's side of the gear [rad, rad/s].
    rate : (n,) array
        Of the setpoint [rad/s].
    unrated : (n,) bool array
        Samples at which nobody knows it.
    """

    record: JointRecord
    good: Mask
    position: Array
    velocity: Array
    rate: Array
    unrated: Mask

    @cached_property
    def known(self) -> Array:
        """Times of the good samples."""
        return self.record.t[self.good]

    @cached_property
    def ahead(self) -> Array:
        """Effort that was fed forward."""
        name = f"{self.record.effort}_feedforward"
        return np.nan_to_num(self.record[name]) if name in self.record else np.zeros(len(self.record.t))

    def position_at(self, t: Array) -> Array:
        """Position at times `t`."""
        return self._read(self._positions, self.position, t)

    def velocity_at(self, t: Array, age: float) -> Array:
        """Speed of age `age` at times `t`; one that is newer than the log has it still has the log's noise."""
        if age >= 0.0:
            return self._read(self._speeds, self.velocity, t - age)
        now, later = (self._read(self._calm_speeds, self._calm, moment) for moment in (t, t - age))
        return self._read(self._speeds, self.velocity, t) + later - now

    def _read(self, curve: CubicSpline, values: Array, t: Array) -> Array:
        at = np.clip(t, self.known[0], self.known[-1])
        return np.asarray(curve(at)) if not np.array_equal(at, self.known) else values

    @cached_property
    def _calm(self) -> Array:
        return np.asarray(savgol_filter(self.velocity, CALM, 3))

    # cubics follow a ringing joint where straight lines would not
    @cached_property
    def _positions(self) -> CubicSpline:
        return CubicSpline(self.known, self.position)

    @cached_property
    def _speeds(self) -> CubicSpline:
        return CubicSpline(self.known, self.velocity)

    @cached_property
    def _calm_speeds(self) -> CubicSpline:
        return CubicSpline(self.known, self._calm)


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
    return Course(record, good, position[good], velocity[good], setpoint_rate(record), unknown)


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
