"""Orders worth trying: how much each wave per revolution of motor or joint would explain, by linear theory.

A wave of unknown order is too many hypotheses for replays. But a small torque or sensor error passes through the
observer as through a linear filter, so that sine and cosine of an order are filtered and regressed at once. And since
the filter is the same nearly always, what is left unexplained is first sent backwards through its answer to an impulse
and sorted by angle: how much of each order there is in that shows which are worth filtering.
"""

import math
from collections.abc import Mapping

import numpy as np

from gsfdi.channels import Axis
from gsfdi.motion import PhysicsTerm, Place
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import Round, project
from gsfdi.reconcile.screen import beginning
from gsfdi.registry import shelf
from gsfdi.types import Array
from gsfdi.whiten import respond

MOST = 3
AT_ONCE = 4
FILTERED = 8
"""Orders that are filtered, of those that look best before. In 24 searches on three joints, of up to a hundred orders,
the best three were always among them, but for a few that gained less than 3."""
MEMORY = 512
"""Samples after which the filter has forgotten an impulse."""
BINS, SPEEDS = 32, 16
"""Parts of the shortest wave into which angles are sorted, and of the highest speed into which speeds are."""
HIGHEST = 100.0
"""Order up to which waves are tried, however few samples they have at working speed: there they shrink by what the
joint takes the mean of, and alias, but every reversal shows them whole. A cogging of 95 Hz at full speed, sampled at
100 Hz, gained 8,000 of log-likelihood; with orders below those of the fastest motion only, delays stood in for it."""
LEAST_WAVES, OF_TORQUE = 0.75, 0.4
"""Waves of a motor that must lie within the motion, and of those that are a torque: a smaller part of one is what a
weight, a cable or another number of the plant does, too."""
ALONG = np.concatenate([np.geomspace(1.0, 12.0, 32), np.arange(13.0, 46.0)])
"""Waves per travel to try on a linear drive, of which nothing says that they are whole: no more than one apart."""


def worthy_orders(hand: Round, most: int = MOST) -> Mapping[str, tuple[float, ...]]:
    """Orders to try for every term that is a wave; the best `most` of each."""
    stand = hand.stand
    states = [np.nan_to_num(trace.state) for trace in stand.traces(hand.fitted.model)]
    waves = [term for term in shelf("gsfdi.terms", PhysicsTerm).values() if term.order is not None]
    return {
        term.name: _best(hand, term.place, states, most) for term in waves if stand.model.structure in term.structures
    }


def _best(hand: Round, place: Place, states: list[Array], most: int) -> tuple[float, ...]:
    orders = _promising(hand, place, states, _grid(hand.stand, place))
    chunks = np.array_split(orders, math.ceil(len(orders) / AT_ONCE))
    gains = np.concatenate([_gains(hand, _signatures(hand, place, states, chunk), len(chunk)) for chunk in chunks])
    return tuple(float(orders[k]) for k in np.argsort(-gains)[:most])


def _promising(hand: Round, place: Place, states: list[Array], orders: Array) -> Array:
    """Orders that would gain most if the filter were the same at all times."""
    if len(orders) <= FILTERED:
        return orders
    stand = hand.stand
    left = project(hand, hand.fitted.residual[None])[0][0]
    ends = np.cumsum([len(stand.awake(i)) for i in range(len(states))])
    scores, information = np.zeros(len(orders), dtype=np.complex128), np.zeros(len(orders))
    for i, (x, rest) in enumerate(zip(states, np.split(left, ends[:-1]), strict=True)):
        answer, angle, size = _answer(hand, place, i), _angle(stand, place, x), _size(stand, place, i)
        weights = size * beginning(rest, answer.ravel(), answer.shape[1])
        scores += _sorted(place, angle, weights, orders, stand.model.axis)
        information += _passed(place, answer, np.gradient(angle), size, orders)
    gains = np.abs(scores) ** 2 / np.maximum(information, 1e-300)
    return orders[np.sort(np.argsort(-gains)[:FILTERED])]


def _answer(hand: Round, place: Place, i: int) -> Array:
    """White innovations ``(MEMORY, p)`` that an impulse in the middle of a stretch leaves."""
    stand, n = hand.stand, len(hand.stand.steps[i])
    impulse = np.zeros((1, n))
    impulse[0, n // 2] = 1.0
    torque, sensed = _acting(stand, place, impulse)
    shown = hand.tools[i](respond(stand.system, stand.gain, torque, sensed, stand.steps[i]))[0]
    return np.asarray(shown.reshape(n, -1)[n // 2 :][:MEMORY])


def _sorted(place: Place, angle: Array, weights: Array, orders: Array, axis: Axis) -> Array:
    """Share of every order in `weights` over the angle, as complex numbers."""
    whole = 2 * np.pi if axis == "rotary" else float(np.ptp(angle)) + 1e-12  # rotary orders are whole ones
    count = int(np.ceil(BINS * orders[-1] * whole / (2 * np.pi)))
    part = np.floor((angle - angle.min()) % whole / whole * count).astype(np.int64) % count
    turn = np.abs(np.gradient(angle))
    width = max(float(turn.max()), 1e-12) / SPEEDS
    speed = np.minimum(turn / width, SPEEDS - 1).astype(np.int64)
    by_speed = np.bincount(speed * count + part, weights, SPEEDS * count).reshape(SPEEDS, count)
    middle = angle.min() + (np.arange(count) + 0.5) * whole / count
    shares = np.exp(1j * np.outer(orders, middle)) @ by_speed.T
    return np.asarray(np.sum(shares * _shrink(place, np.outer(orders, (np.arange(SPEEDS) + 0.5) * width)), axis=1))


def _passed(place: Place, answer: Array, turn: Array, size: Array, orders: Array) -> Array:
    """Information in a wave of every order: how much of it the filter passes at the frequencies that it has.

    `turn` is the angle from sample to sample.
    """
    power = np.sum(np.abs(np.fft.rfft(answer, 2 * MEMORY, axis=0)) ** 2, axis=1)
    counts, edges = np.histogram(np.abs(turn), 8 * BINS, weights=size**2)
    phase = np.outer(orders, 0.5 * (edges[1:] + edges[:-1]))
    seen = np.abs((phase + np.pi) % (2 * np.pi) - np.pi)  # beyond half the sampling rate as one below it
    passed = np.interp(seen, np.linspace(0.0, np.pi, len(power)), power) * _shrink(place, phase) ** 2
    return np.asarray(passed @ counts)


def _shrink(place: Place, phase: Array) -> Array:
    """Share of a wave that is left in its mean from sample to sample, `phase` [rad] apart; sensors show it whole."""
    return np.ones_like(phase) if place == "position_sensor" else np.sinc(phase / (2 * np.pi))


def _signatures(hand: Round, place: Place, states: list[Array], orders: Array) -> Array:
    """White innovations that the sine of each order leaves, then those of the cosines."""
    stand = hand.stand
    parts = []
    for i, x in enumerate(states):
        angle = _angle(stand, place, x)
        after = angle if place == "position_sensor" else np.append(0.5 * (angle[1:] + angle[:-1]), angle[-1])
        turn = orders[:, None] * after
        shrink = _shrink(place, orders[:, None] * np.gradient(angle))
        waves = _size(stand, place, i) * np.concatenate([shrink * np.sin(turn), shrink * np.cos(turn)])
        torque, sensed = _acting(stand, place, waves)
        parts.append(respond(stand.system, stand.gain, torque, sensed, stand.steps[i]))
    return stand.white(parts, hand.tools)


def _angle(stand: Bench, place: Place, state: Array) -> Array:
    """Angle [rad] that waves at a term's place go with: the joint's, or the motor's before the gear."""
    return state[:, 0] + state[:, 2] if place == "position_sensor" else stand.model.plant.gear_ratio * state[:, 0]


def _grid(stand: Bench, place: Place) -> Array:
    """Whole orders; for a linear drive, waves per travel."""
    on_joint = place == "position_sensor"
    turns = 1.0 if on_joint else stand.model.plant.gear_ratio
    if stand.model.axis == "linear":
        return ALONG * np.pi / (stand.scales.reach * turns)
    waves = 0.0 if on_joint else OF_TORQUE if place == "torque" else LEAST_WAVES
    first = max(1.0, np.ceil(waves * np.pi / (stand.scales.reach * turns)))
    return np.arange(first, max(first + 1.0, HIGHEST) + 1.0)


def _size(stand: Bench, place: Place, i: int) -> Array:
    """Size of a wave at a term's place from sample to sample: that of a torque constant goes with the effort."""
    effort = stand.records[i][stand.records[i].effort]
    return np.nan_to_num(effort) / stand.scales.effort if place == "torque_constant" else np.ones(len(effort))


def _acting(stand: Bench, place: Place, waves: Array) -> tuple[Array, Array]:
    """Torque and sensor error that waves at a term's place make, in the sizes of the bench."""
    sides = stand.system.Bt.shape[1]
    torque, sensed = np.zeros((*waves.shape, sides)), np.zeros((*waves.shape, 2))
    size = 0.1 * stand.scales.torque
    if place in ("torque", "torque_constant"):
        torque[..., 0] = size * waves
    elif place == "windup":
        torque[..., 0], torque[..., -1] = -size * waves, size * waves
    else:
        sensed[..., 0] = waves * 10 * stand.scales.noise
    return torque, sensed


def _gains(hand: Round, signatures: Array, count: int) -> Array:
    """Gain in log-likelihood of each pair of sine and cosine."""
    bare, r = project(hand, signatures)
    scores = bare @ r
    gains = np.zeros(count)
    for k in range(count):
        pair = [k, k + count]
        info = bare[pair] @ bare[pair].T + 1e-9 * np.eye(2)
        gains[k] = 0.5 * scores[pair] @ np.linalg.solve(info, scores[pair])
    return gains
