"""Recordings of the simulator's own: a simulated motion as telemetry would show it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsfdi.drive import Drive, drive_from, drive_of
from gsfdi.errors import UnusableInputError
from gsfdi.model import JointModel, TermUse
from gsfdi.packed import pack, stack
from gsfdi.simulate.replaying import Mode, Trace, require, run
from gsfdi.starting import Start, initial_state, resistance
from gsfdi.telemetry import measured_effort, noisy, over_bus
from gsfdi.training import training
from gsfdi.types import Array, JointRecord

EPOCH_NS = 1_767_225_600 * 10**9  # 2026-01-01: recordings that replay nothing begin at one fixed time


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
    if replay is None and open_loop:
        raise UnusableInputError(model.name, "there is no recorded effort to drive", "give a recording")
    drive = drive_of(replay, model) if replay is not None else training_drive(model, duration, seed)
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


def training_drive(model: JointModel, duration: float, seed: int) -> Drive:
    """Drive along a training trajectory of `duration` [s], from rest."""
    if model.controller is None:
        raise UnusableInputError(model.name, "a training trajectory needs a controller", "add one, or give a recording")
    signals = training(model.axis, model.controller.sample_rate, duration, seed)
    at_rest = Start(float(signals.setpoint[0]), 0.0, 0.0, 0.0, 0.0)
    if model.controller.integral > 0:  # which has long found the effort that holds the joint
        holding = resistance(model, at_rest) / (model.plant.gear_ratio * model.plant.torque_constant)
        at_rest = at_rest._replace(integral=holding)
    return drive_from(signals, model, at_rest)


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
