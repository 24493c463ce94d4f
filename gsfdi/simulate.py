"""Simulates a joint: replays of a recording, and recordings of the simulator's own.

The interface others build on::

    drive = drive_of(record, model)               # what the recording commands, measures and starts from
    trace = replay(model, drive)                  # closed loop on the recorded setpoint
    trace = replay(model, drive, "open_loop")     # on the recorded effort
    trace = replay(model, drive, "predict", gain=K)             # observer; trace.innovation is (n, 2)
    trace = replay(model, drive, "open_loop", restarts=[0, 500, 1000])   # multiple shooting; states= sets its states
    traces = replay_many(models, drive, ...)      # the same for many models in one compiled loop
    record = simulate_record(model, faults=[fault_of("cogging=2@30", "rotary")], seed=1)   # with sensor noise and bus

A state is ``[Ω, Ω̇, ε, ε̇, integral part of the controller]``, a gain ``K`` (4, 2): state against the innovations of
position and of motor speed (joint speed of a rigid joint). A trace holds what noise-free sensors would show. What the
recording holds is in ``drive.signals``, and ``drive_from(signals, model)`` drives a replay with signals of any origin.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from gsfdi.drive import Clock, Drive, drive_from, drive_of
from gsfdi.errors import UnusableInputError
from gsfdi.fault import fault_of
from gsfdi.model import JointModel, TermUse
from gsfdi.packed import pack, stack
from gsfdi.replay import kernel, layout
from gsfdi.starting import Signals, Start, initial_state, recorded_states, resistance
from gsfdi.telemetry import measured_effort, noisy, over_bus
from gsfdi.training import training
from gsfdi.types import Array, JointRecord

__all__ = [
    "Drive",
    "Mode",
    "Signals",
    "Start",
    "Trace",
    "drive_from",
    "drive_of",
    "fault_of",
    "initial_state",
    "replay",
    "replay_many",
    "simulate_record",
]

LOG = logging.getLogger("gsfdi")
Mode = Literal["closed_loop", "open_loop", "predict", "predict_controller"]
EPOCH_NS = 1_767_225_600 * 10**9  # 2026-01-01: recordings that replay nothing begin at one fixed time
_MODES: dict[str, int] = {
    "closed_loop": layout.CLOSED_LOOP,
    "open_loop": layout.OPEN_LOOP,
    "predict": layout.PREDICT,
    "predict_controller": layout.PREDICT_CONTROLLER,
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
        Samples at which the state is set anew, to the rows of `states` (models, restarts, 5); without these, to what
        the recording shows from there (multiple shooting).
    finer : int
        Divides every substep.
    """
    require(models, drive, mode)
    packed = stack([pack(model, finer) for model in models])
    starts = np.array([initial_state(model, drive.start) for model in models]) if x0 is None else x0
    clock, again = drive.clock, np.zeros((len(models), 0, 5))
    if len(restarts):
        if states is None:
            states = np.array([recorded_states(model, drive.signals, restarts) for model in models])
        again = np.array(np.broadcast_to(states, (len(models), len(restarts), 5)), order="C")
        clock = clock.restarting(restarts)
    gains = np.array(np.broadcast_to(np.zeros((4, 2)) if gain is None else gain, (len(models), 4, 2)), order="C")
    return run(models, packed, clock, mode, np.array(starts, dtype=np.float64, order="C"), gains, again, drive.t)


def require(models: Sequence[JointModel], drive: Drive, mode: Mode) -> None:
    """Refuse a replay that lacks what its mode needs."""
    name = models[0].name
    if mode in ("closed_loop", "predict_controller") and any(model.controller is None for model in models):
        raise UnusableInputError(name, "a closed loop needs [controller]", "add it to the model, or simulate open-loop")
    if mode in ("closed_loop", "predict_controller") and not np.isfinite(drive.signals.setpoint).all():
        raise UnusableInputError(name, "the recording has no setpoint", "simulate open-loop")
    if mode == "predict_controller" and not np.isfinite(drive.signals.velocity).any():
        raise UnusableInputError(name, "the recording has no speed for the controller's law", 'use mode "predict"')
    if mode in ("open_loop", "predict") and not np.isfinite(drive.signals.effort).any():
        raise UnusableInputError(name, f"the recording has no {models[0].effort}", "replay its setpoint instead")


def run(
    models: Sequence[JointModel],
    packed: Array,
    clock: Clock,
    mode: Mode,
    starts: Array,
    gains: Array,
    again: Array,
    t: Array,
) -> list[Trace]:
    """Run the kernel and name what it gives.

    Every array goes in as numpy makes it by itself: a read-only or strided one would have the kernel compiled anew.
    """
    announce_compilation()
    events = clock.events.shape[0]
    state = np.empty((len(models), events, layout.STATE_WIDTH))
    shown = np.empty((len(models), t.size, layout.SHOWN_WIDTH))
    room = kernel.scratch(max(len(model.physics) for model in models))
    kernel.run_many(packed, *clock, _MODES[mode], starts[:, None, :], gains, again, state, shown, *room)
    at = slice(None) if events == t.size else clock.events[:, layout.RECORD] >= 0
    return [trace(model, t, state[b][at], shown[b]) for b, model in enumerate(models)]


@cache
def announce_compilation() -> None:
    """Say so, once, where the kernel is about to be compiled rather than loaded from numba's cache."""
    if not kernel.is_compiled():
        LOG.warning("compiling the simulator, once after installation: some 10 s")


def trace(model: JointModel, t: Array, state: Array, shown: Array) -> Trace:
    """Name the columns of what the kernel gave for one model."""
    rigid = model.structure == "rigid"
    speed = shown[:, 1]
    return Trace(
        t=t,
        position=shown[:, 0],
        motor_velocity=model.plant.gear_ratio * speed if rigid else speed,
        joint_velocity=speed if rigid else state[:, 1] + state[:, 3],
        effort=shown[:, layout.SHOWN_EFFORT],
        windup=state[:, 2],
        motor_angle=state[:, 0],
        state=state[:, : layout.INTEGRAL + 1],
        innovation=shown[:, layout.INNOVATION :],
    )


def simulate_record(
    model: JointModel,
    *,
    replay: JointRecord | None = None,
    faults: Sequence[TermUse] = (),
    seed: int = 0,
    open_loop: bool = False,
    duration: float = 180.0,
) -> JointRecord:
    """Simulate telemetry of a joint; the same seed gives the same bytes.

    Parameters
    ----------
    model : JointModel
        The joint, with its sensors and bus.
    replay : JointRecord, optional
        Recording whose setpoint (effort, with `open_loop`) drives the joint, from its own initial state and at its
        temperature; else a training trajectory of `duration` [s].
    faults : sequence of TermUse
        Terms beyond those of the model.
    seed : int
        Of noise, bus and trajectory.
    """
    faulty = replace(model, physics=(*model.physics, *faults))
    mode: Mode = "open_loop" if open_loop else "closed_loop"
    if replay is not None:
        drive = drive_of(replay, model)
    elif model.controller is None or open_loop:
        raise UnusableInputError(model.name, "a training trajectory needs a controller", "add one, or give a recording")
    else:
        signals = training(model.axis, model.controller.sample_rate, duration, seed)
        at_rest = Start(float(signals.setpoint[0]), 0.0, 0.0, 0.0, 0.0)
        if model.controller.integral > 0:  # which has long found the effort that holds the joint
            holding = resistance(model, at_rest) / (model.plant.gear_ratio * model.plant.torque_constant)
            at_rest = at_rest._replace(integral=holding)
        drive = drive_from(signals, model, at_rest)
    require([faulty], drive, mode)
    clock, start = noisy(drive.clock, model.sensors, seed), initial_state(faulty, drive.start)
    gains, again = np.zeros((1, 4, 2)), np.zeros((1, 0, 5))
    shown = run([faulty], stack([pack(faulty)]), clock, mode, start[None], gains, again, drive.t)[0]
    if not np.isfinite(shown.position).all():
        raise UnusableInputError(model.name, "the simulation runs away", "check inertia, stiffness, gains and terms")
    t, channels = over_bus(drive.t, channels_of(model, drive, shown, seed), model, seed)
    return JointRecord(
        robot=replay.robot if replay else "simulated",
        joint=model.name,
        t0_ns=replay.t0_ns if replay else EPOCH_NS,
        t=t,
        channels=channels,
        axis=model.axis,
    )


def channels_of(model: JointModel, drive: Drive, shown: Trace, seed: int) -> dict[str, Array]:
    """Channels that the telemetry of a simulated motion carries."""
    signals = drive.signals
    channels = {"setpoint": signals.setpoint, "setpoint_rate": signals.setpoint_rate, "position": shown.position}
    if model.structure == "flexible":
        channels["motor_velocity"] = shown.motor_velocity
    else:
        channels["joint_velocity"] = shown.joint_velocity
    channels[model.effort] = measured_effort(shown.effort, model.sensors, seed)
    if signals.feedforward.any():
        channels[f"{model.effort}_feedforward"] = signals.feedforward
    channels["temperature"] = signals.temperature
    return {name: values for name, values in channels.items() if np.isfinite(values).any()}
