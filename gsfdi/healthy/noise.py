"""How noisy a channel is, by itself or as its model file states it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsfdi.model import JointModel
from gsfdi.nominal import Nominal
from gsfdi.stretches import Stretch
from gsfdi.types import Array


def with_noise(nominal: Nominal, parts: Sequence[Stretch], model: JointModel | None) -> Nominal:
    """Take the channels' noise, and with it the speed below which the sign of motion is not known."""
    names = [name for name in ("position", nominal.velocity) if name]
    noise = [noise_of(np.concatenate([part.values[name] for part in parts])) for name in names]
    noise = _declared(noise, model, nominal.velocity)
    turns = nominal.plant.gear_ratio if nominal.velocity == "motor_velocity" else 1.0
    noise_speed = noise[1] / turns if len(noise) > 1 else noise[0] / nominal.step
    brisk = float(np.sqrt(np.mean(np.concatenate([np.gradient(p.values["position"], p.step) for p in parts]) ** 2)))
    return replace(nominal, noise=tuple(noise), slow=max(3.0 * noise_speed, 0.02 * brisk, 1e-9))


def noise_of(values: Array) -> float:
    """Standard deviation of a channel's white noise, from its third differences, which motion hardly enters.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> round(noise_of(np.sin(np.arange(9999) / 300) + 0.01 * rng.standard_normal(9999)), 3)
    0.01
    """
    third = np.abs(np.diff(values, 3))
    third = third[third > 1e-9 * float(np.ptp(values))]  # at rest a coarse channel shows no noise at all
    busy = len(third) > 0.1 * len(values)
    spread = 1.4826 * float(np.median(third)) / 20.0**0.5 if busy else 0.0
    return float(max(spread, _quantum(values) / 12.0**0.5, 1e-8 * float(np.ptp(values)), 1e-12))


def _quantum(values: Array) -> float:
    """Step of the channel's resolution, 0 where its values do not repeat."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-7 * float(np.ptp(values))]
    repeats = len(np.unique(values)) < 0.5 * len(values)
    return float(np.min(steps)) if len(steps) > 8 and repeats else 0.0


def _declared(found: list[float], model: JointModel | None, velocity: str) -> list[float]:
    """Noise as the model file states it, unless the recording shows less; what a recording shows holds motion too."""
    if model is None:
        return found
    sensors = model.sensors
    stated = [(sensors.position_noise, sensors.position_resolution)]
    if velocity == "motor_velocity":
        stated.append((sensors.motor_velocity_noise, sensors.motor_velocity_resolution))
    stated += [(0.0, 0.0)] * (len(found) - len(stated))
    return [
        min(seen, float(np.hypot(noise, step / 12.0**0.5))) if noise > 0 else seen
        for seen, (noise, step) in zip(found, stated, strict=True)
    ]
