"""What drives a replay: the recorded command and measurements, and the clock that they make."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from gsfdi.errors import UnusableInputError
from gsfdi.model import Controller, JointModel
from gsfdi.replay import layout
from gsfdi.starting import Signals, Start, start_of
from gsfdi.types import Array, JointRecord, frozen

REGULAR = 1e-3  # share of a period within which jittering stamps count as regular
SLOWER = 1.5
"""Periods of the controller from one sample to the next from which a recording holds only some of its efforts."""


class Clock(NamedTuple):
    """Events of a replay in order of time: controller ticks and recorded samples.

    ``events`` (E, layout.EVENT_WIDTH) holds what each brings; ``noise`` (E, 2) is what position and speed sensor add,
    or has no rows; ``resolution`` (2,) their smallest steps.
    """

    events: Array
    noise: Array
    resolution: Array

    def restarting(self, samples: Sequence[int]) -> "Clock":
        """Give the clock restarts at these samples, which take the states in this order."""
        events = self.events.copy()
        events[:, layout.RESTART] = -1
        at = np.flatnonzero(events[:, layout.RECORD] >= 0)[np.asarray(samples, dtype=np.int64)]
        events[at, layout.RESTART] = np.arange(len(samples))
        return self._replace(events=events)

    def with_lever(self, lever: float) -> "Clock":
        """Give the clock of a speed that was told by the recorded effort."""
        events = self.events.copy()
        events[:, layout.LEVER] = lever
        return self._replace(events=events)

    def logged(self) -> "Clock":
        """Give the clock of the samples alone, each with the mean effort of the events from it to the next."""
        at = np.flatnonzero(self.events[:, layout.RECORD] >= 0)
        events = self.events[at]
        counts = np.diff(at, append=len(self.events))
        events[:, layout.EFFORT] = np.add.reduceat(self.events[:, layout.EFFORT], at) / counts
        return self._replace(events=events)


@dataclass(frozen=True, slots=True)
class Drive:
    """What drives a replay: signals, where the joint starts, and the events of the kernel.

    ``clock`` has all of them, at the controller's rate; ``logged`` those of a replay under the recorded effort, to
    which what a controller does between two samples is of no use: each has the mean effort up to the next.
    """

    signals: Signals
    start: Start
    clock: Clock = field(repr=False)
    logged: Clock = field(repr=False)

    @property
    def t(self) -> Array:
        """Time of the samples (n,) [s]."""
        return self.signals.t

    def told(self, lever: float) -> "Drive":
        """Say that the speed was told by the recorded effort, `lever` [rad/s] per unit of it, and all of the start."""
        clock, logged = (one.with_lever(lever) for one in (self.clock, self.logged))
        return replace(self, clock=clock, logged=logged, start=self.start._replace(integral=0.0))


def drive_of(record: JointRecord, model: JointModel) -> Drive:
    """Take from `record` what a replay of `model` needs."""
    t = record.t
    if t.size < 3:
        raise UnusableInputError(f"joint {record.joint}", f"{t.size} samples cannot be replayed", "give a longer one")

    if model.effort not in record and record.effort in record:
        what = f"the recording carries {record.effort}, the model speaks {model.effort}"
        raise UnusableInputError(
            f"joint {record.joint}", what, "give gains and torque constant in the recording's unit"
        )

    def channel(name: str) -> Array:
        return record[name] if name in record else np.full(t.size, np.nan)

    setpoint = filled(t, channel("setpoint"))
    rate = filled(t, channel("setpoint_rate"))
    if not np.isfinite(rate).any() and np.isfinite(setpoint).any():
        rate = np.gradient(setpoint, t + 1e-12 * np.arange(t.size))  # stamps may repeat
    signals = Signals(
        t=t,
        setpoint=setpoint,
        setpoint_rate=rate,
        feedforward=np.nan_to_num(channel(f"{record.effort}_feedforward")),
        effort=channel(record.effort),
        position=channel("position"),
        velocity=measured_velocity(record, model),
        temperature=np.nan_to_num(filled(t, channel("temperature")), nan=20.0),
    )
    return drive_from(signals, model)


def drive_from(signals: Signals, model: JointModel, start: Start | None = None) -> Drive:
    """Build a drive from signals; without `start` from how their first samples move."""
    signals = Signals(*(frozen(values) for values in signals))
    clock = clock_of(signals, model.controller)
    logged = clock.logged() if is_thinned(signals.t, model.controller) else clock
    return Drive(signals, start or start_of(signals, model), clock, logged)


def is_thinned(t: Array, law: Controller | None) -> bool:
    """Whether a log with stamps `t` holds only some of the efforts that a controller made."""
    return law is not None and bool(np.median(np.diff(t)) > SLOWER / law.sample_rate)


def measured_velocity(record: JointRecord, model: JointModel) -> Array:
    """Measured speed that the model senses: the motor's, or the joint's when rigid."""
    if model.structure == "flexible" and "motor_velocity" in record:
        return record["motor_velocity"]
    if model.structure == "rigid" and "joint_velocity" in record:
        return record["joint_velocity"]
    if model.structure == "rigid" and "motor_velocity" in record:
        return record["motor_velocity"] / model.plant.gear_ratio
    return np.full(record.t.size, np.nan)


def filled(t: Array, values: Array) -> Array:
    """`values` with NaN replaced by interpolation over time; all NaN stays so."""
    good = np.isfinite(values)
    if good.all() or not good.any():
        return values
    return np.asarray(np.interp(t, t[good], values[good]), dtype=np.float64)


def regular(t: Array) -> Array:
    """Stamps on an even grid where they only jitter by less than `REGULAR` of a period, else as they are."""
    grid = np.linspace(t[0], t[-1], t.size)
    period = (t[-1] - t[0]) / (t.size - 1)
    return grid if np.max(np.abs(grid - t)) <= REGULAR * period else t


def course(t: Array, effort: Array, time: Array) -> Array:
    """Effort at `time` of a log that holds only some of a controller's, by a cubic spline.

    On Akima's curve, which does not ring at a jump, a joint that rang at 7 Hz and was logged at 100 Hz, a speed's lag
    told right in it, seemed to lack two modes of its link.
    """
    from scipy.interpolate import CubicSpline  # slow to load, and only logs of this kind need it

    good = np.isfinite(effort) & (np.diff(t, prepend=-np.inf) > 0)
    if good.sum() < 3:
        return np.full(time.size, np.nan)
    return np.asarray(CubicSpline(t[good], effort[good])(time), dtype=np.float64)


def clock_of(signals: Signals, law: Controller | None) -> Clock:
    """Lay out the events: recorded samples, and the controller's ticks between them.

    A recording no faster than the controller holds every so-manyeth tick: a step of k periods has k ticks, locked to
    the samples, and between two samples the effort runs smoothly from one to the next: held, it would be half a spacing
    late, and a mode of the gearbox be named for it. Where but a sample is lost, the effort before it is held.
    In a faster recording the controller acts on the first sample after each of its periods has passed.
    """
    t, period = regular(signals.t), 1.0 / law.sample_rate if law else None
    steps = np.diff(t)
    ticks = np.ones(steps.size, dtype=np.int64)  # from one sample to the next
    if period is not None and np.median(steps) >= 0.75 * period:
        ticks = np.maximum(1, np.rint(steps / period)).astype(np.int64)
    at = np.concatenate([[0], np.cumsum(ticks)])
    time = np.interp(np.arange(at[-1] + 1), at, t)
    record = np.full(time.size, -1, dtype=np.int64)
    record[at] = np.arange(t.size)
    tick = np.full(time.size, period is not None)
    if period is not None and np.median(steps) < 0.75 * period:
        tick = np.diff(np.floor((t - t[0]) / period + 0.01), prepend=-1.0) > 0
    before = np.maximum.accumulate(record)  # sample that an event follows
    events = np.empty((time.size, layout.EVENT_WIDTH))
    events[:, layout.TIME] = time
    events[:, layout.TICK] = tick
    events[:, layout.RECORD] = record
    events[:, layout.RESTART] = -1
    events[:, layout.SETPOINT] = np.interp(time, t, signals.setpoint)
    events[:, layout.RATE] = np.interp(time, t, signals.setpoint_rate)
    events[:, layout.FEEDFORWARD] = signals.feedforward[before]
    events[:, layout.EFFORT] = signals.effort[before]
    if is_thinned(t, law):
        between = course(t, signals.effort, time)
        events[:, layout.EFFORT] = np.where(np.isfinite(between), between, signals.effort[before])
    events[:, layout.POSITION] = np.where(record >= 0, signals.position[before], np.nan)
    events[:, layout.VELOCITY] = np.where(record >= 0, signals.velocity[before], np.nan)
    events[:, layout.LEVER] = 0.0
    events[:, layout.TEMPERATURE] = np.interp(time, t, signals.temperature)
    return Clock(events, np.empty((0, 2)), np.zeros(2))
