"""From a simulated motion to telemetry: what sensors and bus make of it."""

import numpy as np

from gsfdi.drive import Clock
from gsfdi.model import Bus, JointModel, Sensors
from gsfdi.types import Array


def noisy(clock: Clock, sensors: Sensors, seed: int) -> Clock:
    """Give the clock the noise and resolution of the sensors, which the controller then sees too."""
    noise = np.random.default_rng((seed, 1)).standard_normal((clock.events.shape[0], 2))
    noise *= [sensors.position_noise, sensors.motor_velocity_noise]
    return clock._replace(
        noise=noise, resolution=np.array([sensors.position_resolution, sensors.motor_velocity_resolution])
    )


def measured_effort(effort: Array, sensors: Sensors, seed: int) -> Array:
    """What the drive reports of its effort."""
    shown = effort + sensors.effort_noise * np.random.default_rng((seed, 2)).standard_normal(effort.size)
    step = sensors.effort_resolution
    return np.asarray(np.rint(shown / step) * step if step > 0 else shown)


def over_bus(t: Array, channels: dict[str, Array], model: JointModel, seed: int) -> tuple[Array, dict[str, Array]]:
    """Frames as they arrive: late, jittering, some lost, some twice."""
    bus = model.bus
    if bus == Bus():
        return t, channels
    rng = np.random.default_rng((seed, 3))
    stamps = t + bus.latency + np.abs(bus.jitter * rng.standard_normal(t.size))
    arrives = rng.random(t.size) >= bus.lost
    twice = rng.random(t.size) < bus.repeated
    frames = np.repeat(np.arange(t.size), arrives.astype(int) * (1 + twice))
    frames = frames[np.argsort(stamps[frames], kind="stable")]
    return stamps[frames], {name: values[frames] for name, values in channels.items()}
