"""How noisy and how coarse the sensors of a recording are: as the model states it, or as the values show it."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from gsfdi.drive import measured_velocity
from gsfdi.model import JointModel
from gsfdi.simulate import Trace
from gsfdi.types import Array, JointRecord

LEAST = 50
"""Samples from which the noise of a channel may be told."""
FAR = 2.0
"""Times its stated noise from which a sensor is taken to be as noisy as its values look.

A joint follows the noise of its sensors, so that they look noisier than they are."""
FINEST = 1e-7
"""Share of its reach to which a sensor is believed; of a simulation without noise no filter could be designed."""
NOISY = 1.5
"""Times what rounding alone would show from which a channel has noise besides."""


def sensor_variances(records: Sequence[JointRecord], model: JointModel) -> tuple[float, float]:
    """Variances of position and motor velocity: as stated by the model, else as the recordings show."""
    stated, found = model.sensors, []
    ratio = 1.0 if model.structure == "flexible" else model.plant.gear_ratio
    times = [record.t for record in records]
    positions = [record["position"] for record in records]
    speeds = [measured_velocity(record, model) for record in records]
    for values, noise, resolution in (
        (positions, stated.position_noise, stated.position_resolution),
        (speeds, stated.motor_velocity_noise / ratio, stated.motor_velocity_resolution / ratio),
    ):
        if not all(np.isfinite(v).any() and np.ptp(v[np.isfinite(v)]) > 0 for v in values):
            found.append(np.inf)
            continue
        seen = seen_noise(list(zip(times, values, strict=True)))
        grain = max(grain_of(v) for v in values)
        believed = np.hypot(noise, max(resolution, grain) / np.sqrt(12.0)) if noise + resolution > 0 else seen
        found.append(max(believed, 1e-3 * seen, finest(values)) ** 2)
    return found[0], found[1]


def as_shown(records: Sequence[JointRecord], model: JointModel) -> JointModel:
    """Give `model` with the noise of its sensors as values show it, where it states none, or far too little."""
    sensors, ratio = model.sensors, 1.0 if model.structure == "flexible" else model.plant.gear_ratio
    usable = [
        record for record in records if len(record.t) >= LEAST and {"position", record.effort} <= set(record.channels)
    ]
    positions = [(r.t, r["position"]) for r in usable]
    speeds = [(r.t, ratio * measured_velocity(r, model)) for r in usable]
    for channel, shown in (("position", positions), ("motor_velocity", speeds)):
        if shown and all(np.isfinite(v).sum() >= LEAST and np.ptp(v[np.isfinite(v)]) > 0 for _, v in shown):
            stated = getattr(sensors, f"{channel}_noise"), getattr(sensors, f"{channel}_resolution")
            noise, resolution = told_by(shown, *stated)
            noise = max(noise, 0.0 if resolution > 0 else finest([v for _, v in shown]))
            sensors = replace(sensors, **{f"{channel}_noise": noise, f"{channel}_resolution": resolution})
    if effort_noise(model) > 0:
        grain = max((grain_of(r[r.effort]) for r in usable), default=0.0)
        sensors = replace(sensors, effort_resolution=max(sensors.effort_resolution, grain))
    return replace(model, sensors=sensors)


def told_by(shown: Sequence[tuple[Array, Array]], noise: float, resolution: float) -> tuple[float, float]:
    """Noise and resolution of a sensor: as stated, unless nothing is, or its values show far more noise."""
    grain = max(grain_of(values) for _, values in shown)
    rounding = grain / np.sqrt(12.0)
    if noise + resolution > 0:
        seen = seen_noise(shown, order=9)
        if seen < FAR * np.hypot(noise, max(resolution, grain) / np.sqrt(12.0)):
            return noise, resolution or grain
    else:
        seen = seen_noise(shown)
    return float(np.sqrt(seen**2 - rounding**2)) if seen > NOISY * rounding else 0.0, resolution or grain


def finest(values: Sequence[Array]) -> float:
    """Noise that a channel is believed to have at least."""
    return FINEST * max(float(np.ptp(v[np.isfinite(v)])) for v in values)


def seen_noise(shown: Sequence[tuple[Array, Array]], order: int = 5) -> float:
    """White noise of a channel in several records ``(t, values)``: the median of theirs."""
    return float(np.median([noise_of(t, values, order) for t, values in shown]))


def shown_speed(trace: Trace, model: JointModel) -> Array:
    """Speed that the sensor shows in a replay, on the joint's side of the gear."""
    return trace.motor_velocity / model.plant.gear_ratio if model.structure == "flexible" else trace.joint_velocity


def setpoint_rate(record: JointRecord) -> Array:
    """Rate of the setpoint as logged, else its slope."""
    return record["setpoint_rate"] if "setpoint_rate" in record else np.gradient(record["setpoint"], record.t)


def effort_noise(model: JointModel) -> float:
    """Standard deviation of the recorded effort's error, as the model states its sensor; 0 where it does not."""
    return float(np.hypot(model.sensors.effort_noise, model.sensors.effort_resolution / np.sqrt(12.0)))


def believed_noise(stated: float, seen: float) -> float:
    """Noise of a sensor as it is stated, unless nothing is, or it is seen to be far noisier."""
    return seen if stated == 0 or seen > FAR * stated else stated


def logs_speed(records: Sequence[JointRecord], model: JointModel) -> bool:
    """Whether every record holds a speed."""
    return all(bool(np.isfinite(measured_velocity(record, model)).any()) for record in records)


def noise_of(t: Array, values: Array, order: int = 5) -> float:
    """Standard deviation of a channel's white noise, from divided differences, which motion hardly enters.

    The higher their order, the less a joint that rings or ripples seems to be noise. Values that are too few for it
    show none.
    """
    there = np.isfinite(values)
    t, values = t[there], values[there]
    if len(values) <= order:
        return 0.0
    at, near = sliding_window_view(t, order + 1), sliding_window_view(values, order + 1)
    weights = np.ones(at.shape)
    for i, j in permutations(range(order + 1), 2):
        weights[:, i] /= at[:, i] - at[:, j]
    differences = np.sum(weights * near, axis=1) / np.linalg.norm(weights, axis=1)
    spread = float(1.4826 * np.median(np.abs(differences)))
    return float(max(spread, grain_of(values) / 12.0**0.5))


def grain_of(values: Array) -> float:
    """Step between the values that a channel can take, 0 where it takes any.

    Examples
    --------
    >>> grain_of(np.round(np.sin(np.arange(500.0)) / 0.01) * 0.01)
    0.01
    """
    moves = np.abs(np.diff(values[np.isfinite(values)]))
    size = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    moves = moves[moves > 1e-9 * max(size, 1e-30)]
    if len(moves) < 20:
        return 0.0
    grain = float(moves.min())
    grain = float(np.mean(moves[moves < 1.5 * grain]))
    if np.quantile(moves, 0.9) > 1e4 * grain:
        return 0.0
    off = np.abs(moves / grain - np.round(moves / grain))
    return round(grain, 15) if np.quantile(off, 0.9) < 0.02 else 0.0
