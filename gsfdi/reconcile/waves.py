"""Orders worth trying: how much each wave per revolution of motor or joint would explain, by linear theory.

A wave of unknown order is too many hypotheses for replays. But a small torque or sensor error passes through the
observer as through a linear filter, so that sine and cosine of every order are filtered and regressed at once.
"""

import math
from collections.abc import Mapping

import numpy as np

from gsfdi.motion import PhysicsTerm, Place
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import Round, project
from gsfdi.registry import shelf
from gsfdi.types import Array
from gsfdi.whiten import respond

MOST = 3
AT_ONCE = 4
LEAST_WAVES = 0.75
"""Waves of a motor that must lie within the motion: a smaller part of one is what a weight or a cable does, too."""
ALONG = np.concatenate([np.geomspace(1.0, 12.0, 32), np.arange(13.0, 46.0)])
"""Waves per travel to try on a linear drive, of which nothing says that they are whole: no more than one apart."""


def worthy_orders(hand: Round, most: int = MOST) -> Mapping[str, tuple[float, ...]]:
    """Orders to try for every term that is a wave; the best `most` of each."""
    stand = hand.stand
    states = [trace.state for trace in stand.traces(hand.fitted.model)]
    waves = [term for term in shelf("gsfdi.terms", PhysicsTerm).values() if term.order is not None]
    return {
        term.name: _best(hand, term.place, states, most) for term in waves if stand.model.structure in term.structures
    }


def _best(hand: Round, place: Place, states: list[Array], most: int) -> tuple[float, ...]:
    on_joint = place == "position_sensor"
    orders = _grid(hand.stand, on_joint)
    chunks = np.array_split(orders, math.ceil(len(orders) / AT_ONCE))
    gains = np.concatenate([_gains(hand, _signatures(hand, place, states, chunk), len(chunk)) for chunk in chunks])
    return tuple(float(orders[k]) for k in np.argsort(-gains)[:most])


def _signatures(hand: Round, place: Place, states: list[Array], orders: Array) -> Array:
    """White innovations that the sine of each order leaves, then those of the cosines."""
    stand = hand.stand
    on_joint = place == "position_sensor"
    parts = []
    for i, x in enumerate(states):
        angle = x[:, 0] + x[:, 2] if on_joint else stand.model.plant.gear_ratio * x[:, 0]
        after = angle if on_joint else np.append(0.5 * (angle[1:] + angle[:-1]), angle[-1])
        turn = orders[:, None] * after
        shrink = 1.0 if on_joint else np.sinc(orders[:, None] * np.gradient(angle) / (2 * np.pi))
        waves = np.concatenate([shrink * np.sin(turn), shrink * np.cos(turn)])
        torque, sensed = _acting(stand, place, i, waves)
        parts.append(respond(stand.system, stand.gain, torque, sensed, stand.steps[i]))
    return stand.white(parts, hand.tools)


def _grid(stand: Bench, on_joint: bool) -> Array:
    """Whole orders that the sampling can resolve at working speed; for a linear drive, waves per travel."""
    turns = 1.0 if on_joint else stand.model.plant.gear_ratio
    fastest = np.pi / stand.scales.period / max(stand.scales.speed * turns, 1e-12)
    if stand.model.axis == "linear":
        return ALONG * np.pi / (stand.scales.reach * turns)
    first = 1.0 if on_joint else max(1.0, np.ceil(LEAST_WAVES * np.pi / (stand.scales.reach * turns)))
    return np.arange(first, max(first + 1.0, min(100.0, 0.9 * fastest)) + 1.0)


def _acting(stand: Bench, place: Place, i: int, waves: Array) -> tuple[Array, Array]:
    """Torque and sensor error that waves at a term's place make, in the sizes of the bench."""
    sides = stand.system.Bt.shape[1]
    torque, sensed = np.zeros((*waves.shape, sides)), np.zeros((*waves.shape, 2))
    size = 0.1 * stand.scales.torque
    if place == "torque":
        torque[..., 0] = size * waves
    elif place == "torque_constant":
        record = stand.records[i]
        torque[..., 0] = size * waves * np.nan_to_num(record[record.effort]) / stand.scales.effort
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
