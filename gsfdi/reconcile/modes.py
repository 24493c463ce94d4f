"""Frequencies worth trying: how much an appendage of each would explain, by linear theory.

A resonance is far narrower than any grid of replays. But an appendage that the joint carries along pulls at it with a
torque that its motion alone decides, so that every frequency is filtered and regressed at once.
"""

import math
from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import Round, regressed
from gsfdi.reconcile.knobs import plausible
from gsfdi.registry import shelf
from gsfdi.types import Array
from gsfdi.whiten import respond

MOST = 3
SLOWEST = 0.3  # [Hz] below which a structure hangs on its joint more loosely than any that is built
DAMPING = 0.02
"""Share of critical damping with which a mode is tried."""
APART = 2.0 * DAMPING
"""Step from one frequency to the next, as a share: the width of a resonance."""
AT_ONCE = 16


def worthy_frequencies(hand: Round, most: int = MOST) -> Mapping[str, tuple[float, ...]]:
    """Frequencies [Hz] to try for every term that is a resonance; the best `most`."""
    modes = [term for term in shelf("gsfdi.terms", PhysicsTerm).values() if term.frequency is not None]
    return {term.name: _best(hand, fastest(hand.stand, term), most) for term in modes}


def _best(hand: Round, last: float, most: int) -> tuple[float, ...]:
    stand = hand.stand
    if last <= SLOWEST:
        return ()
    frequencies = np.geomspace(SLOWEST, last, 2 + int(math.log(last / SLOWEST) / APART))
    speeds = [trace.state[:, 1] + trace.state[:, 3] for trace in stand.traces(hand.fitted.model)]
    chunks = np.array_split(frequencies, math.ceil(len(frequencies) / AT_ONCE))
    gains = np.concatenate([_gains(hand, _signatures(hand, speeds, chunk)) for chunk in chunks])
    beside = np.concatenate([[0.0], gains, [0.0]])
    peaks = np.flatnonzero((gains > 0) & (gains >= beside[:-2]) & (gains > beside[2:]))
    return tuple(float(f) for f in frequencies[peaks[np.argsort(-gains[peaks])]][:most])


def fastest(stand: Bench, term: PhysicsTerm) -> float:
    """Frequency [Hz] above which the resonance of `term` is no longer plausible in these recordings."""
    assert term.frequency is not None
    return plausible(stand, term, term.frequency, term.frequency.start)[1]


def pull(speed: Array, frequency: float, period: float) -> Array:
    """Torque [N m] of an appendage of 1 kg m² that a joint of a given speed carries along.

    ``T(s) = s (ω² + 2 ζ ω s) / (s² + 2 ζ ω s + ω²) · v(s)``, by the bilinear transform; the speed before the first
    sample is the first one's.
    """
    omega = 2.0 * np.pi * frequency
    drag = 2.0 * DAMPING * omega
    rate = 2.0 / period
    up, across, down = drag * rate**2, omega**2 * rate, rate**2 + omega**2
    b = (up + across, -2.0 * up, up - across)
    a = (down + drag * rate, 2.0 * (omega**2 - rate**2), down - drag * rate)
    return np.asarray(lfilter(b, a, speed - speed[0]))


def _signatures(hand: Round, speeds: list[Array], frequencies: Array) -> Array:
    """White innovations that an appendage of each frequency leaves."""
    stand = hand.stand
    size = 0.1 * stand.scales.inertia
    parts = []
    for speed, steps in zip(speeds, stand.steps, strict=True):
        torque = np.zeros((len(frequencies), len(speed), stand.system.Bt.shape[1]))
        torque[..., -1] = size * np.array([pull(speed, f, stand.scales.period) for f in frequencies])
        parts.append(respond(stand.system, stand.gain, torque, np.zeros((*torque.shape[:2], 2)), steps))
    return stand.white(parts, hand.tools)


def _gains(hand: Round, signatures: Array) -> Array:
    """Gain in log-likelihood of each, none where its inertia would be below zero."""
    scores, information = regressed(hand, signatures)
    return np.where(scores < 0, 0.5 * scores**2 / information, 0.0)
