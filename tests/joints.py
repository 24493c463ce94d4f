"""Joints for the detectors' tests: the paper's joint as it is simulated, and what is learnt of it fault-free."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from gsfdi.baseline import Gathering, JointBaseline, learn_joint
from gsfdi.model import Controller, JointModel, Plant, Sensors
from gsfdi.reconcile.contract import without_speed as without_speed
from gsfdi.simulate import fault_of, simulate_record
from gsfdi.types import Array, JointRecord

PLANT = Plant(400.0, 0.0011, 260.6, 130000.0, 0.4, 0.6)
MODEL = JointModel(
    "SH1",
    "flexible",
    PLANT,
    controller=Controller(28.0, 4.0, 17.0, 100.0),
    sensors=Sensors(1e-6, 4e-6, 0.0, 2e-3, 0.0, 2e-4),
)


def off(**ratios: float) -> JointModel:
    """Give the joint with numbers of its plant off by these ratios."""
    return replace(
        MODEL, plant=replace(MODEL.plant, **{name: r * getattr(MODEL.plant, name) for name, r in ratios.items()})
    )


@cache
def record(*faults: str, seed: int = 0, duration: float = 40.0) -> JointRecord:
    """Telemetry of the paper's joint with the faults given as on the command line."""
    return simulate_record(MODEL, faults=tuple(fault_of(one) for one in faults), seed=seed, duration=duration)


def swinging(
    reach: float, rate: float, model: JointModel = MODEL, seed: int = 0, duration: float = 60.0
) -> JointRecord:
    """Telemetry of a joint that swings gently, by `reach` [rad] at `rate` [rad/s]."""
    asked = along(simulate_record(MODEL, seed=seed, duration=duration), ((reach, rate, 0.0),))
    return simulate_record(model, replay=asked, seed=seed)


def along(record: JointRecord, waves: Sequence[tuple[float, float, float]], middle: float = 0.0) -> JointRecord:
    """Give a record with a setpoint along waves of an amplitude [rad], a rate [rad/s] and a phase about a middle."""
    place = middle + sum(a * np.sin(w * record.t + p) for a, w, p in waves)
    rate = sum(a * w * np.cos(w * record.t + p) for a, w, p in waves)
    return replace(record, channels={**record.channels, "setpoint": place, "setpoint_rate": rate}, valid={})


def ramped(strokes: int = 12) -> Array:
    """Setpoint [rad] at 100 Hz that moves to and fro, its acceleration on ramps for two fifths of the time."""
    up, rest = np.repeat([0.2, -0.2], 50), np.zeros(150)
    stroke = np.concatenate([up, rest, -up, rest])
    jerk = np.concatenate([stroke * (-1) ** k for k in range(strokes)])
    return np.asarray(np.cumsum(np.cumsum(np.cumsum(jerk))) * 0.01**3)


def torn(whole: JointRecord, first: float, last: float) -> JointRecord:
    """Give a record without what lies between these times [s]."""
    keep = (whole.t < first) | (whole.t > last)
    return replace(whole, t=whole.t[keep], channels={k: whole[k][keep] for k in whole.channels}, valid={})


def along_ramps(model: JointModel, seed: int) -> JointRecord:
    """Telemetry of a joint along such a setpoint, its rate not logged."""
    setpoint = ramped()
    t = 0.01 * np.arange(len(setpoint))
    asked = replace(simulate_record(MODEL, duration=1.0), t=t, channels={"setpoint": setpoint}, valid={})
    shown = simulate_record(model, replay=asked, seed=seed)
    return replace(shown, channels={name: shown[name] for name in shown.channels if name != "setpoint_rate"})


def ramping(model: JointModel, seed: int) -> JointRecord:
    """The same without any speed."""
    return without_speed(along_ramps(model, seed))


@cache
def learnt() -> JointBaseline:
    """A baseline from four fault-free batches."""
    return learn_joint([record(seed=seed) for seed in range(4)], MODEL)


def gathered(*pieces: JointRecord) -> dict[str, dict[str, Array]]:
    """Every detector's numbers of a batch, as the baseline of this joint has it."""
    seen = Gathering(learnt().nominal)
    for piece in pieces:
        seen.add(piece)
    return seen.numbers()
