"""Simulates a joint: replays of a recording, and recordings of the simulator's own.

The interface others build on::

    drive = drive_of(record, model)               # what the recording commands, measures and starts from
    trace = replay(model, drive)                  # closed loop on the recorded setpoint
    trace = replay(model, drive, "open_loop")     # on the recorded effort
    trace = replay(model, drive, "predict", gain=K)             # observer; trace.innovation is (n, 2)
    trace = replay(model, drive, "open_loop", restarts=[0, 500, 1000], states=x)   # multiple shooting, x (3, 5)
    traces = replay_many(models, drive, ...)      # the same for many models in one compiled loop

A state is ``[Ω, Ω̇, ε, ε̇, integral part of the controller]``, a gain ``K`` (4, 2): state against the innovations of
position and of motor speed (joint speed of a rigid joint). A trace holds what noise-free sensors would show. What the
recording holds is in ``drive.signals``, and ``drive_from(signals, model)`` drives a replay with signals of any origin.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from gsfdi import replay as kernel
from gsfdi.drive import Drive, Signals, Start, drive_from, drive_of
from gsfdi.errors import UnusableInputError
from gsfdi.model import JointModel
from gsfdi.packed import pack, spring_inverse, stack
from gsfdi.types import Array

__all__ = [
    "Drive",
    "Mode",
    "Signals",
    "Start",
    "Trace",
    "drive_from",
    "drive_of",
    "initial_state",
    "replay",
    "replay_many",
]

Mode = Literal["closed_loop", "open_loop", "predict", "predict_controller"]
_MODES: dict[str, int] = {
    "closed_loop": kernel.CLOSED_LOOP,
    "open_loop": kernel.OPEN_LOOP,
    "predict": kernel.PREDICT,
    "predict_controller": kernel.PREDICT_CONTROLLER,
}


@dataclass(frozen=True, slots=True)
class Trace:
    """What a replay gives, one row per recorded sample; not a number from where the model ran away.

    Parameters
    ----------
    t, position, motor_velocity, joint_velocity, effort : (n,) array
        Time, and what noise-free sensors show; `joint_velocity` is true in a flexible joint, which does not sense it.
    windup, motor_angle : (n,) array
        True gearbox wind-up, and motor angle reflected to the output.
    state : (n, 5) array
        Motion and integral part; before the correction at that sample in the predict modes.
    innovation : (n, 2) array
        Measured less predicted position and speed (predict modes).
    """

    t: Array
    position: Array
    motor_velocity: Array
    joint_velocity: Array
    effort: Array
    windup: Array
    motor_angle: Array
    state: Array
    innovation: Array


def initial_state(model: JointModel, start: Start) -> Array:
    """State (5,) of `model` that begins as `start` says."""
    if model.structure == "rigid":
        return np.array([start.angle, start.speed, 0.0, 0.0, start.integral])
    windup = spring_inverse(model, start.spring_torque)
    return np.array([start.angle - windup, start.motor_speed, windup, start.speed - start.motor_speed, start.integral])


def replay(
    model: JointModel,
    drive: Drive,
    mode: Mode = "closed_loop",
    *,
    gain: Array | None = None,
    x0: Array | None = None,
    restarts: Sequence[int] = (),
    states: Array | None = None,
    finer: int = 1,
) -> Trace:
    """Replay `model` under `drive`; see `replay_many`."""
    some = None if states is None else states[None]
    first = None if x0 is None else x0[None]
    return replay_many([model], drive, mode, gain=gain, x0=first, restarts=restarts, states=some, finer=finer)[0]


def replay_many(
    models: Sequence[JointModel],
    drive: Drive,
    mode: Mode = "closed_loop",
    *,
    gain: Array | None = None,
    x0: Array | None = None,
    restarts: Sequence[int] = (),
    states: Array | None = None,
    finer: int = 1,
) -> list[Trace]:
    """Replay many models under one drive, in one compiled loop.

    Parameters
    ----------
    models : sequence of JointModel
        All of one structure.
    drive : Drive
        What the recording commands and measures.
    mode : {'closed_loop', 'open_loop', 'predict', 'predict_controller'}
        Controller on the simulated measurements; recorded effort; observer under the recorded effort; observer under
        the effort that the model's controller makes of the recorded measurements.
    gain : (4, 2) or (models, 4, 2) array
        Observer gain of the predict modes.
    x0 : (models, 5) array, optional
        Initial states in place of those from the recording's first samples.
    restarts : sequence of int
        Samples at which the state is set anew, to the rows of `states` (models, restarts, 5).
    finer : int
        Divides every substep.
    """
    if mode == "closed_loop" and any(model.controller is None for model in models):
        raise UnusableInputError(models[0].name, "a closed loop needs [controller]", "add it, or simulate open-loop")
    if mode == "closed_loop" and not np.isfinite(drive.signals.setpoint).all():
        raise UnusableInputError(models[0].name, "the recording has no setpoint", "simulate open-loop")
    joints = stack([pack(model, finer) for model in models])
    starts = np.array([initial_state(model, drive.start) for model in models]) if x0 is None else x0
    clock, again = drive.clock, np.zeros((len(models), 0, 5))
    if len(restarts):
        if states is None:
            raise ValueError("restarts need states (models, restarts, 5)")
        again = np.ascontiguousarray(np.broadcast_to(states, (len(models), len(restarts), 5)))
        clock = with_restarts(clock, restarts)
    gains = np.ascontiguousarray(np.broadcast_to(np.zeros((4, 2)) if gain is None else gain, (len(models), 4, 2)))
    return run(models, joints, clock, mode, starts, gains, again, drive.t)


def with_restarts(clock: kernel.Clock, restarts: Sequence[int]) -> kernel.Clock:
    """Give the clock restarts at the samples numbered in `restarts`."""
    marks = np.full(clock.time.size, -1, dtype=np.int64)
    marks[np.searchsorted(np.maximum.accumulate(clock.record), restarts)] = np.arange(len(restarts))
    return clock._replace(restart=marks)


def run(
    models: Sequence[JointModel],
    joints: kernel.Joint,
    clock: kernel.Clock,
    mode: Mode,
    starts: npt.NDArray[np.float64],
    gains: Array,
    again: Array,
    t: Array,
) -> list[Trace]:
    """Run the kernel and name what it gives."""
    batch, events, n = len(models), clock.time.size, t.size
    state, effort = np.full((batch, events, 5), np.nan), np.full((batch, events), np.nan)
    sensed, innovation = np.full((batch, n, 3), np.nan), np.full((batch, n, 2), np.nan)
    starts = np.ascontiguousarray(starts, dtype=np.float64)
    kernel.run_many(joints, clock, _MODES[mode], starts, gains, again, state, effort, sensed, innovation)
    samples = slice(None) if events == n else clock.record >= 0
    return [trace(model, t, state[b][samples], sensed[b], innovation[b]) for b, model in enumerate(models)]


def trace(model: JointModel, t: Array, state: Array, sensed: Array, innovation: Array) -> Trace:
    """Name the columns of what the kernel gave for one model."""
    rigid = model.structure == "rigid"
    speed = sensed[:, 1]
    return Trace(
        t=t,
        position=sensed[:, 0],
        motor_velocity=model.plant.gear_ratio * speed if rigid else speed,
        joint_velocity=speed if rigid else state[:, 1] + state[:, 3],
        effort=sensed[:, 2],
        windup=state[:, 2],
        motor_angle=state[:, 0],
        state=state,
        innovation=innovation,
    )
