"""Replays a recording on one model or many, and names what the kernel gives."""

import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from gsfdi.drive import Clock, Drive
from gsfdi.errors import UnusableInputError
from gsfdi.model import JointModel
from gsfdi.packed import pack, stack
from gsfdi.replay import kernel, layout
from gsfdi.starting import initial_state, recorded_states
from gsfdi.types import Array

LOG = logging.getLogger("gsfdi")
Mode = Literal["closed_loop", "open_loop", "predict", "predict_controller"]
_MODES: dict[str, int] = {
    "closed_loop": layout.CLOSED_LOOP,
    "open_loop": layout.OPEN_LOOP,
    "predict": layout.PREDICT,
    "predict_controller": layout.PREDICT_CONTROLLER,
}
_HANDS = ContextVar("_HANDS", default=1)


@contextmanager
def at_once(models: int) -> Iterator[None]:
    """Replay so many models at a time, a processor to each: the kernel holds no lock."""
    before = _HANDS.set(models)
    try:
        yield
    finally:
        _HANDS.reset(before)


@cache
def _pool(size: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(size, thread_name_prefix="replay")


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
    x0 : (models, 5 to 9) array, optional
        Initial states in place of those from the recording's first samples; further columns say how far bristles are
        stretched, as a share of the full, how long before its stamp a recorded effort acts and the speed is older than
        its stamp [s], and how far [rad] and how fast [rad/s] an appendage falls behind the joint.
    restarts : sequence of int
        Samples at which the state is set anew, to the rows of `states` (models, restarts, 5); without these, to what
        the recording shows from there (multiple shooting).
    finer : int
        Divides every substep.
    """
    require(models, drive, mode)
    packed = stack([pack(model, finer) for model in models])
    starts = np.array([initial_state(model, drive.start) for model in models]) if x0 is None else x0
    clock = drive.logged if mode in ("open_loop", "predict") else drive.clock
    again = np.zeros((len(models), 0, 5))
    if len(restarts):
        if states is None:
            states = np.array([recorded_states(model, drive.signals, restarts) for model in models])
        again = np.array(np.broadcast_to(states, (len(models), len(restarts), 5)), order="C")
        clock = clock.restarting(restarts)
    gains = np.array(np.broadcast_to(np.zeros((4, 2)) if gain is None else gain, (len(models), 4, 2)), order="C")
    return run(models, packed, clock, mode, np.array(starts, dtype=np.float64, order="C"), gains, again, drive.t)


def innovations_of(models: Sequence[JointModel], drive: Drive, gain: Array, x0: Array) -> Array:
    """Innovations ``(models, n, 2)`` of observers under the recorded effort: mode "predict" of `replay_many`, no more.

    What else a replay gives is written over by the next: to keep it takes three per cent longer, and room for it.

    Parameters
    ----------
    models, drive, x0
        See `replay_many`.
    gain : (4, 2) array
        Observer gain of all.
    """
    found = np.empty((len(models), drive.t.size, 2))
    if not models:
        return found
    require(models, drive, "predict")
    announce_compilation()
    packed, clock, terms = stack([pack(model) for model in models]), drive.logged, most_terms(models)
    starts, gains, again = np.array(x0, np.float64, order="C"), np.array(gain[None], order="C"), np.zeros((1, 0, 5))

    def part(b: slice) -> None:
        room = kernel.scratch(terms)
        state = np.empty((1, clock.events.shape[0], layout.STATE_WIDTH))
        shown = np.empty((1, drive.t.size, layout.SHOWN_WIDTH))
        for k in range(b.start, b.stop):
            own = (packed[k : k + 1], *clock, layout.PREDICT, starts[k : k + 1, None, :], gains, again)
            kernel.run_many(*own, state, shown, *room)
            found[k] = shown[0, :, layout.INNOVATION :]

    share_out(part, len(models))
    return found


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
    terms = most_terms(models)

    def part(b: slice) -> None:
        room, own = kernel.scratch(terms), (gains[b], again[b], state[b], shown[b])
        kernel.run_many(packed[b], *clock, _MODES[mode], starts[b, None, :], *own, *room)

    share_out(part, len(models))
    at = slice(None) if events == t.size else clock.events[:, layout.RECORD] >= 0
    return [trace(model, t, state[b][at], shown[b]) for b, model in enumerate(models)]


def most_terms(models: Sequence[JointModel]) -> int:
    """Terms of the model that has most."""
    return max(len(model.physics) for model in models)


def share_out(part: Callable[[slice], None], models: int) -> None:
    """Have each hand replay its part of the models."""
    hands = min(_HANDS.get(), models)
    edges = np.linspace(0, models, hands + 1).astype(int)
    parts = map(slice, edges, edges[1:])
    list(map(part, parts) if hands < 2 else _pool(hands).map(part, parts))


@cache
def announce_compilation() -> None:
    """Say so, once, where the kernel is about to be compiled rather than loaded from numba's cache."""
    if not kernel.is_compiled():
        LOG.warning("compiling the simulator, once after installation: some 20 s")


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
