"""The observer of the nominal joint's model, run over a stretch."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gsfdi.directions import Direction, Moving
from gsfdi.joint import hold, matrices, ramp_hold
from gsfdi.nominal.description import Nominal
from gsfdi.observer import START_UP, Filter, innovations, riccati
from gsfdi.stretches import Stretch
from gsfdi.types import Array, Mask

GATE = 1e4
"""Weighted squared innovation above which a lone sample does not move the observer."""
TORQUES = {"motor": 0, "output": 1, "spring": 2}
"""Columns of the torques that enter the model, by where they do."""


def output_matrix(nominal: Nominal) -> Array:
    """From the joint's states to what is measured."""
    C = matrices(nominal.plant).C.copy()
    if nominal.velocity == "joint_velocity":
        C[1] = [0.0, 1.0, 0.0, 1.0] if nominal.flexible else [0.0, 1.0]
    return C[: nominal.measured]


def observer(nominal: Nominal) -> Filter:
    """Discretise the nominal joint and compute its Kalman gains."""
    joint = matrices(nominal.plant)
    Ad, Bu = hold(joint.A, joint.effort[:, None], nominal.step)
    Ad = np.ascontiguousarray(Ad)
    torque = np.column_stack([joint.motor, joint.output, joint.spring])
    _, Bt0, Bt1 = ramp_hold(joint.A, torque, nominal.step)
    C = output_matrix(nominal)
    R = np.diag(np.array(nominal.noise[: len(C)]) ** 2)
    Q = nominal.unrest**2 * (Bu @ Bu.T)
    speed = R[-1, -1] if nominal.velocity else (nominal.noise[0] / nominal.step) ** 2
    P = np.diag([100.0 * R[0, 0], speed, 100.0 * R[0, 0], speed][: len(Ad)])
    if nominal.flexible:
        P[2, 2] += (10.0 * np.abs(joint.effort[1] * nominal.unrest / joint.A[1, 2])) ** 2
    if nominal.velocity == "motor_velocity":
        P[1, 1] /= nominal.plant.gear_ratio**2
    dry = nominal.terms.get("coulomb_friction:motor", 0.0) * (Bt0 + Bt1)[:, 0]
    P += np.outer(dry, dry)  # what a friction that held does in a step, however small the noise
    gains, S = riccati(Ad, C, Q + 1e-18 * np.diag(np.diag(P)), R, P, START_UP)
    steady = np.linalg.inv(S[-1])
    excess = np.einsum("kij,ji->k", S, steady) / len(C)
    settled = int(np.argmax(excess < 1.02))
    weight = np.array(nominal.weight) if nominal.weight else steady
    return Filter(Ad, np.ascontiguousarray(Bu[:, 0]), Bt0, Bt1, np.ascontiguousarray(C), gains, weight, settled)


class Filtered(NamedTuple):
    """What the observer gives: the outputs, effort and torques that went in, innovations, states, where to look.

    `rough` is the motion from the measurements alone.
    """

    y: Array
    u: Array
    torque: Array
    free: Mask
    age: npt.NDArray[np.int64]
    e: Array
    states: Array
    used: Array
    live: Array
    rough: Moving


def filtered(nominal: Nominal, run: Filter, stretch: Stretch, directions: Mapping[str, Direction]) -> Filtered:
    """Run the observer over a stretch, and no more."""
    rough = roughly(nominal, stretch)
    u = acting(nominal, stretch)
    torque, stuck = learnt(nominal, directions, rough)
    y = np.column_stack([stretch.values[name] for name in ("position", nominal.velocity) if name])
    x = np.zeros(len(run.Ad))
    x[0], x[1] = y[0, 0], float(np.median(rough.speed[:5]))
    age = age_of(~stuck)
    e, states, used = innovations(*run[:-1], GATE, y, u, torque, age, x)
    live = stretch.trusted & (age >= min(run.settled, len(u) // 4)) & np.isfinite(e).all(axis=1)
    return Filtered(y, u, torque, ~stuck, age, e, states, used, live.astype(float), rough)


def acting(nominal: Nominal, stretch: Stretch) -> Array:
    """The effort that acts over each step, when what is logged was held a little longer or shorter."""
    u = stretch.values[nominal.effort]
    if nominal.held == 0.0:
        return u
    return (1.0 - nominal.held) * u + nominal.held * np.concatenate([u[:1], u[:-1]])


def learnt(nominal: Nominal, directions: Mapping[str, Direction], moving: Moving) -> tuple[Array, Mask]:
    """Torques of the learnt terms (motor, output, spring), and where the joint may be sticking."""
    torque = np.zeros((len(moving.t), 3))
    for key, value in nominal.terms.items():
        one = directions[key]
        if value and one.shape is not None and one.enters in TORQUES:  # most joints show few of the terms
            torque[:, TORQUES[one.enters]] += value * one.shape(moving)
    dry = nominal.terms.get("coulomb_friction:motor", 0.0)
    stuck = np.zeros(len(moving.t), dtype=np.bool_)
    if dry > 0.05 * float(np.std(moving.drive)):
        stuck = np.abs(moving.motor_speed) < 2.0 * nominal.slow
        rest = torque[:, 0] - dry * moving.motor_sign
        holds = np.clip(moving.drive - rest - torque[:, 1], -dry, dry)
        torque[stuck, 0] = (rest + holds)[stuck]
    return torque, stuck


def age_of(free: Mask) -> npt.NDArray[np.int64]:
    """Samples since the start, or since the joint last stuck.

    A dry friction that holds is whatever it takes; the observer does not know what it does to the state, and starts
    anew from what is measured.
    """
    places = np.arange(len(free))
    return places - np.maximum.accumulate(np.where(free, 0, places))


def speed_of(nominal: Nominal, stretch: Stretch) -> Array:
    """Speed of the joint as measured, or else from the smoothed position."""
    if nominal.velocity:
        turns = nominal.plant.gear_ratio if nominal.velocity == "motor_velocity" else 1.0
        return np.asarray(stretch.values[nominal.velocity] / turns)
    smooth = np.convolve(np.pad(stretch.values["position"], 2, mode="edge"), np.full(5, 0.2), mode="valid")
    return np.gradient(smooth, stretch.step)


def roughly(nominal: Nominal, stretch: Stretch) -> Moving:
    """Motion from the measurements alone, good enough to evaluate the learnt terms on."""
    q, t = stretch.values["position"], stretch.t
    v = speed_of(nominal, stretch)
    drive = nominal.plant.gear_ratio * nominal.plant.torque_constant * acting(nominal, stretch)
    a = np.gradient(v, stretch.step)
    zero = np.zeros_like(q)
    warmth = stretch.values.get("temperature", zero + 20.0)
    return Moving(t, q, v, a, q, v, a, zero, zero, drive, drive, warmth, nominal.plant, nominal.slow)
