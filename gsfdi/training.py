"""A training trajectory: what a joint is asked to do when there is no recording to replay."""

import numpy as np

from gsfdi.channels import Axis
from gsfdi.starting import Signals
from gsfdi.types import Array

SPEED: dict[Axis, float] = {"rotary": 0.08, "linear": 0.1}  # fastest slew [rad/s, m/s]
ACCELERATION: dict[Axis, float] = {"rotary": 0.05, "linear": 0.5}  # [rad/s², m/s²]
REACH: dict[Axis, float] = {"rotary": 0.5, "linear": 0.12}  # half of the range [rad, m]
EXCITATION = 0.02  # speed of the excitation over that of the fastest slew
TONES = np.array([0.13, 0.31, 0.57, 0.97, 1.61, 2.63, 3.7, 4.9, 6.1, 7.3, 8.9])  # [Hz], no one a multiple of another


def training(axis: Axis, rate: float, duration: float, seed: int) -> Signals:
    """Slews of many speeds with dwells and reversals, the middle third with a small multisine upon it.

    Parameters
    ----------
    axis : {'rotary', 'linear'}
        Sets the scale of the motion.
    rate, duration : float
        Samples per second [Hz] and length [s].
    seed : int
        The same seed gives the same motion.
    """
    rng = np.random.default_rng((seed, 0))
    t = np.arange(max(3, round(duration * rate))) / rate
    speed = slews(t, axis, rng)
    tones = TONES[0.3 * rate > TONES]
    phase = rng.uniform(0.0, 2.0 * np.pi, tones.size)
    window = np.clip(np.minimum(t - duration / 3, 2 * duration / 3 - t), 0.0, 1.0)
    amplitude = EXCITATION * SPEED[axis]
    angle = 2.0 * np.pi * np.outer(t, tones) + phase
    shake = amplitude / (2.0 * np.pi * tones) * np.sin(angle)
    position = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])
    bend = np.gradient(window, t)
    blank = np.full(t.size, np.nan)
    return Signals(
        t=t,
        setpoint=position + window * shake.sum(axis=1),
        setpoint_rate=speed + window * amplitude * np.cos(angle).sum(axis=1) + bend * shake.sum(axis=1),
        feedforward=np.zeros(t.size),
        effort=blank,
        position=blank,
        velocity=blank,
        temperature=20.0 + 4.0 * np.sin(2.0 * np.pi * t / 600.0 + rng.uniform(0.0, 2.0 * np.pi)),
    )


def slews(t: Array, axis: Axis, rng: np.random.Generator) -> Array:
    """Speed of smooth slews to random places within reach, with a dwell after each."""
    speed = np.zeros(t.size)
    place, now = 0.0, 1.0
    while now < t[-1]:
        goal = float(rng.uniform(-1.0, 1.0)) * REACH[axis]
        way, peak = goal - place, SPEED[axis] * float(rng.uniform(0.15, 1.0))
        # A raised cosine of speed peaks at twice its mean, and accelerates most at π times its peak over its length.
        length = max(2.0 * abs(way) / peak, np.sqrt(2.0 * np.pi * abs(way) / ACCELERATION[axis]))
        phase = (t - now) / length
        speed += np.where((phase > 0) & (phase < 1), way / length * (1.0 - np.cos(2.0 * np.pi * phase)), 0.0)
        place, now = goal, now + length + float(rng.choice([0.0, 0.5, 2.0]))
    return speed
