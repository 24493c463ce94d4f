"""What the joints of the proof are asked to do: slews, dwells, reversals, sines, staircases, sweeps, in turn."""

from collections.abc import Callable

import numpy as np

from gsfdi.proof.world import Motion
from gsfdi.types import Array

Rng = np.random.Generator


def _quintic(x: Array) -> Array:
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def _trapezoid(x: Array) -> Array:
    """Position of a move that speeds up for a quarter of its time, cruises, and slows down for a quarter."""
    x, a = np.clip(x, 0.0, 1.0), 0.25
    v = 1.0 / (1.0 - a)
    out: Array = np.where(
        x < a, 0.5 * v * x * x / a, np.where(x < 1 - a, v * (x - 0.5 * a), 1 - 0.5 * v * (1 - x) ** 2 / a)
    )
    return out


def slews(t: Array, reach: float, speed: float, rng: Rng) -> Array:
    """Point to point moves with dwells between, trapezoidal and smooth."""
    out, at, clock = np.zeros(t.size), 0.0, rng.uniform(0.5, 2.0)
    while clock < t[-1]:
        target = rng.uniform(-reach, reach)
        if abs(target - at) < 0.3 * reach:
            continue
        lasts = 1.6 * abs(target - at) / speed
        shape = _quintic if rng.random() < 0.5 else _trapezoid
        out += (target - at) * shape((t - clock) / lasts)
        at, clock = target, clock + lasts + rng.uniform(0.0, 4.0) * reach / speed / 4
    return out


def multisine(t: Array, reach: float, speed: float, rng: Rng) -> Array:
    """Seven sines from the slowest that fits the range to a few hertz; the quick ones take less of the speed."""
    base = speed / reach / (2 * np.pi)
    out = np.zeros(t.size)
    for f in np.geomspace(0.7 * base, min(4.0, 150 * base), 7) * rng.uniform(0.9, 1.1, 7):
        share = 0.35 * min(1.0, (4.0 * base / f) ** 0.7)
        out += share * speed / (2 * np.pi * f) * np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi))
    started: Array = (out - out[0]) * _quintic(t / 2.0 * speed / reach)
    return started


def staircase(t: Array, reach: float, speed: float, rng: Rng) -> Array:
    """Small moves one way with pauses, then back."""
    step = 2 * reach / rng.integers(5, 9)
    out, level, way, clock = np.zeros(t.size), 0.0, 1.0, 1.0
    while clock < t[-1]:
        if abs(level + way * step) > reach:
            way = -way
        lasts = 2.0 * step / speed
        out += way * step * _quintic((t - clock) / lasts)
        level += way * step
        clock += lasts + rng.uniform(0.3, 1.0)
    return out


def sweep(t: Array, reach: float, speed: float, rng: Rng) -> Array:
    """A sine whose frequency rises while its speed stays."""
    low, high = 0.6 * speed / reach / (2 * np.pi), min(5.0, 40 * speed / reach)
    ratio = np.log(high / low)
    last = t[-1]
    f = low * np.exp(ratio * t / last)
    phase = 2 * np.pi * low * last / ratio * (np.exp(ratio * t / last) - 1)
    size = 0.8 * speed * (low / f) ** 0.35 / (2 * np.pi * f) * rng.choice([-1.0, 1.0])
    out: Array = size * np.sin(phase) * _quintic(t / 2.0)
    return out


def reversals(t: Array, reach: float, speed: float, rng: Rng) -> Array:
    """Back and forth over the whole range at steady speeds that differ from pass to pass."""
    out, at, way, clock = np.zeros(t.size), 0.0, rng.choice([-1.0, 1.0]), 1.0
    while clock < t[-1]:
        target = way * reach * rng.uniform(0.5, 1.0)
        lasts = abs(target - at) / (speed * rng.uniform(0.35, 0.95)) / 0.75
        out += (target - at) * _trapezoid((t - clock) / lasts)
        at, way, clock = target, -way, clock + lasts
    return out


KINDS: dict[str, Callable[[Array, float, float, Rng], Array]] = {
    "slews": slews,
    "multisine": multisine,
    "staircase": staircase,
    "sweep": sweep,
    "reversals": reversals,
}


def draw(rng: Rng, seconds: float, sample_rate: float, reach: float, speed: float, jitter: float = 0.0) -> Motion:
    """Draw a motion of one or two kinds, with a temperature that wanders and no feed-forward.

    Parameters
    ----------
    rng : numpy Generator
    seconds, sample_rate : float
        Length [s] and ticks per second; `jitter` is the spread of the ticks as a share of their distance.
    reach, speed : float
        Bounds of position and speed.
    """
    n = round(seconds * sample_rate)
    t = np.arange(n) / sample_rate
    if jitter:
        t[1:] += rng.uniform(-jitter, jitter, n - 1) / sample_rate
    first, second = rng.choice(list(KINDS), 2, replace=False)
    share = rng.uniform(0.4, 0.6) * t[-1]
    a = KINDS[first](t, reach, speed, rng)
    b = KINDS[second](np.maximum(t - share, 0.0), reach, speed, rng)
    # the second motion begins where the first is brought to rest over two seconds' worth of travel
    fade = _quintic((t - share + reach / speed) / (reach / speed))
    setpoint = a * (1 - fade) + b
    setpoint -= setpoint[0]
    setpoint *= min(1.0, speed / np.abs(np.gradient(setpoint, t)).max())
    temperature = (
        20.0 + rng.uniform(-8, 8) + rng.uniform(6, 15) * np.sin(2 * np.pi * (t / t[-1] * rng.uniform(0.4, 1.1)))
    )
    return Motion(t, setpoint, np.gradient(setpoint, t), np.zeros(n), temperature)
