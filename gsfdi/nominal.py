"""What a fault-free joint is taken to be: a linear model, the terms learnt beside it, and its noise.

`watch` runs the observer of this model over an even stretch; `score` asks of its innovations how much they look like
each direction of the fault library.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft
from scipy.ndimage import uniform_filter1d

from gsfdi.directions import Direction, Moving, grouped
from gsfdi.joint import hold, hold_direction, matrices, ramp_hold, relative_directions
from gsfdi.model import Plant
from gsfdi.observer import START_UP, Filter, innovations, riccati, scores
from gsfdi.stretches import Stretch
from gsfdi.types import Array, Mask

GATE = 1e4
"""Weighted squared innovation above which a lone sample does not move the observer."""


@dataclass(frozen=True, slots=True)
class Nominal:
    """The fault-free joint.

    Parameters
    ----------
    plant : Plant
    effort, velocity : str
        Channels of the drive's effort and of the speed; an empty velocity where none is measured.
    step : float
        Sampling period on which the observer runs [s].
    terms : mapping of str to float
        Coefficient of each learnt direction, by `Direction.key`.
    noise : tuple of float
        Standard deviation of position and velocity noise.
    unrest : float
        Standard deviation of what drives the joint beside its effort, in the effort's unit.
    held : float
        Share of the previous sample's effort in what acts over a step.
    slow : float
        Speed below which the sign of motion is not known.
    weight : tuple of tuple of float
        Inverse covariance of the innovations, learnt on fault-free batches.
    """

    plant: Plant
    effort: str
    velocity: str
    step: float
    terms: Mapping[str, float] = field(default_factory=dict)
    noise: tuple[float, ...] = (1e-5, 1e-2)
    unrest: float = 1e-3
    held: float = 0.0
    slow: float = 1e-3
    weight: tuple[tuple[float, ...], ...] = ()

    @property
    def flexible(self) -> bool:
        """Whether motor and link move apart."""
        return bool(np.isfinite(self.plant.stiffness))

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that the observer needs."""
        return ("position", self.effort) + ((self.velocity,) if self.velocity else ())

    @property
    def measured(self) -> int:
        """Number of measured outputs."""
        return 2 if self.velocity else 1


class Watched(NamedTuple):
    """A stretch as the observer saw it; `states` and `u` are calmed, for directions to be evaluated on.

    ``y (n, p)`` the outputs, ``acting (n,)`` the effort and ``torque (n, 3)`` the learnt terms in the model.
    """

    stretch: Stretch
    y: Array
    acting: Array
    torque: Array
    moving_freely: Mask
    e: Array
    states: Array
    used: Array
    live: Array
    u: Array
    moving: Moving


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
    gains, S = riccati(Ad, C, Q + 1e-18 * np.diag(np.diag(P)), R, P, START_UP)
    steady = np.linalg.inv(S[-1])
    excess = np.einsum("kij,ji->k", S, steady) / len(C)
    settled = int(np.argmax(excess < 1.02))
    weight = np.array(nominal.weight) if nominal.weight else steady
    return Filter(Ad, np.ascontiguousarray(Bu[:, 0]), Bt0, Bt1, np.ascontiguousarray(C), gains, weight, settled)


def _rough(nominal: Nominal, stretch: Stretch) -> Moving:
    """Motion from the measurements alone, good enough to evaluate the learnt terms on."""
    q, t = stretch.values["position"], stretch.t
    turns = nominal.plant.gear_ratio if nominal.velocity == "motor_velocity" else 1.0
    if nominal.velocity:
        v = stretch.values[nominal.velocity] / turns
    else:
        v = np.gradient(uniform_filter1d(q, 5, mode="nearest"), stretch.step)
    drive = nominal.plant.gear_ratio * nominal.plant.torque_constant * _acting(nominal, stretch)
    a = np.gradient(v, stretch.step)
    zero = np.zeros_like(q)
    warmth = stretch.values.get("temperature", zero + 20.0)
    return Moving(t, q, v, a, q, v, a, zero, zero, drive, drive, warmth, nominal.plant, nominal.slow)


def _acting(nominal: Nominal, stretch: Stretch) -> Array:
    """The effort that acts over each step, when what is logged was held a little longer or shorter."""
    u = stretch.values[nominal.effort]
    return (1.0 - nominal.held) * u + nominal.held * np.concatenate([u[:1], u[:-1]])


def _learnt(nominal: Nominal, directions: Mapping[str, Direction], moving: Moving) -> tuple[Array, Mask]:
    """Torques of the learnt terms (motor, output, spring), and where the joint may be sticking."""
    torque = np.zeros((len(moving.t), 3))
    place = {"motor": 0, "output": 1, "spring": 2}
    for key, value in nominal.terms.items():
        one = directions[key]
        if value and one.shape is not None and one.enters in place:  # most joints show few of the terms
            torque[:, place[one.enters]] += value * one.shape(moving)
    dry = nominal.terms.get("coulomb_friction:motor", 0.0)
    stuck = np.zeros(len(moving.t), dtype=np.bool_)
    if dry > 0.05 * float(np.std(moving.drive)):
        stuck = np.abs(moving.motor_speed) < 2.0 * nominal.slow
        rest = torque[:, 0] - dry * moving.motor_sign
        holds = np.clip(moving.drive - rest - torque[:, 1], -dry, dry)
        torque[stuck, 0] = (rest + holds)[stuck]
    return torque, stuck


class Filtered(NamedTuple):
    """What the observer gives: the outputs, effort and torques that went in, innovations, states, where to look."""

    y: Array
    u: Array
    torque: Array
    free: Mask
    e: Array
    states: Array
    used: Array
    live: Array


def filtered(nominal: Nominal, run: Filter, stretch: Stretch, directions: Mapping[str, Direction]) -> Filtered:
    """Run the observer over a stretch, and no more."""
    return _filtered(nominal, run, stretch, directions, _rough(nominal, stretch))


def _filtered(
    nominal: Nominal, run: Filter, stretch: Stretch, directions: Mapping[str, Direction], rough: Moving
) -> Filtered:
    u = _acting(nominal, stretch)
    torque, stuck = _learnt(nominal, directions, rough)
    y = np.column_stack([stretch.values[name] for name in ("position", nominal.velocity) if name])
    x = np.zeros(len(run.Ad))
    x[0], x[1] = y[0, 0], float(np.median(rough.speed[:5]))
    e, states, used = innovations(*run[:-1], GATE, y, u, torque, x)
    live = (stretch.trusted & ~stuck & np.isfinite(e).all(axis=1)).astype(float)
    live[: min(run.settled, len(u) // 4)] = 0.0
    return Filtered(y, u, torque, ~stuck, e, states, used, live)


def watch(nominal: Nominal, run: Filter, stretch: Stretch, directions: Mapping[str, Direction]) -> Watched:
    """Run the observer over a stretch, and prepare what directions are evaluated on."""
    rough = _rough(nominal, stretch)
    seen = _filtered(nominal, run, stretch, directions, rough)
    # The noise of the measured effort reaches states and innovations alike; a regressor that held it would lean on a
    # healthy joint, so what the directions are evaluated on is kept below the frequency where the effort is noise.
    ceiling = ceiling_of(seen.u, stretch.step)
    calmed = calm(np.column_stack([seen.states, seen.u]), stretch.step, ceiling)
    states, u = np.ascontiguousarray(calmed[:, :-1]), np.ascontiguousarray(calmed[:, -1])
    rough = rough._replace(drive=nominal.plant.gear_ratio * nominal.plant.torque_constant * u)
    return Watched(stretch, seen.y, seen.u, seen.torque, seen.free, seen.e, states, seen.used, seen.live, u,
                   _observed(nominal, rough, states))  # fmt: skip


def _observed(nominal: Nominal, rough: Moving, states: Array) -> Moving:
    """Motion as the observer has it; wind-up and load where the joint is flexible."""
    plant = nominal.plant
    if not nominal.flexible:
        acceleration = np.gradient(states[:, 1], nominal.step)
        angle, speed = states.T
        return rough._replace(
            angle=angle, speed=speed, acceleration=acceleration, motor_angle=angle, motor_speed=speed,
            motor_acceleration=acceleration, load=rough.drive,
        )  # fmt: skip
    angle, speed, windup, rate = states.T
    load = -plant.stiffness * windup
    return rough._replace(
        angle=angle + windup, speed=speed + rate,
        acceleration=(load - plant.damping * (speed + rate)) / plant.output_inertia,
        motor_angle=angle, motor_speed=speed, windup=windup, windup_rate=rate, load=load,
        motor_acceleration=(rough.drive - load) / (plant.gear_ratio**2 * plant.motor_inertia),
    )  # fmt: skip


class Entries(NamedTuple):
    """How each direction enters the discrete model; exact ones come first."""

    exact: Array
    exact_u: Array
    early: Array
    late: Array
    sensed: Array


def entries(nominal: Nominal, run: Filter, directions: Sequence[Direction]) -> Entries:
    """Columns by which the directions act on the observer's model."""
    joint, nx, p = matrices(nominal.plant), len(run.Ad), len(run.C)
    early, late, sensed = (
        np.zeros((len(directions), nx)),
        np.zeros((len(directions), nx)),
        np.zeros((len(directions), p)),
    )
    changes = relative_directions(nominal.plant)
    exact = []
    place = {"motor": 0, "output": 1, "spring": 2}
    for j, one in enumerate(directions):
        if one.enters == "exact":
            dA, dB = changes[one.key]
            exact.append(hold_direction(joint.A, joint.effort[:, None], dA, dB[:, None], nominal.step))
        elif one.enters in place:
            early[j], late[j] = run.Bt0[:, place[one.enters]], run.Bt1[:, place[one.enters]]
        else:
            sensed[j, 0 if one.enters == "position" else p - 1] = 1.0
    L = np.array([a for a, _ in exact]).reshape(-1, nx, nx)
    Lu = np.array([b[:, 0] for _, b in exact]).reshape(-1, nx)
    return Entries(L, Lu, early, late, sensed)


class Scored(NamedTuple):
    """Scores ``g``, information ``h`` and ``x`` with the mate by bin; joint information ``H``; energy by bin."""

    g: Array
    h: Array
    x: Array
    H: Array
    energy: Array


def score(
    run: Filter,
    entry: Entries,
    watched: Watched,
    directions: Sequence[Direction],
    bins: npt.NDArray[np.int64],
    count: int,
) -> Scored:
    """Score every direction on a watched stretch, in bins of time."""
    size = np.zeros((len(watched.u), len(directions)))
    for j, one in enumerate(directions):
        if one.shape is not None:
            size[:, j] = one.shape(watched.moving)
    e = np.where(np.isfinite(watched.e), watched.e, 0.0)
    mate = np.full(len(directions), -1, dtype=np.int64)
    for _, members in grouped(directions):
        if len(members) == 2:
            mate[members] = members[::-1]
    return Scored(
        *scores(run.Ad, run.C, run.gains, run.weight, e, watched.used, watched.live, bins, count, *entry[:2],
                watched.states, watched.u, *entry[2:], size, mate)
    )  # fmt: skip


def calm(values: Array, step: float, ceiling: float) -> Array:
    """Low-pass columns of `values` at `ceiling` [Hz], without delay and without kinks at the ends."""
    n = len(values)
    side = min(n - 1, max(int(2.0 / (ceiling * step)), 16))
    first, last = values[:1], values[-1:]
    before, after = 2 * first - values[side:0:-1], 2 * last - values[-2 : -side - 2 : -1]
    rest = next_fast_len(n + 2 * side, real=True) - n - 2 * side
    after = np.concatenate([after, np.repeat(after[-1:], rest, axis=0)])
    whole = np.concatenate([before, values, after])
    frequency = np.fft.rfftfreq(len(whole), step)
    gain = 0.5 * (1.0 + np.cos(np.pi * np.clip((frequency - ceiling) / (0.5 * ceiling), 0.0, 1.0)))
    spectrum = rfft(whole, axis=0)
    low = irfft(spectrum * gain.reshape(-1, *[1] * (values.ndim - 1)), len(whole), axis=0)
    return np.asarray(low[side : side + n], dtype=np.float64)


def ceiling_of(values: Array, step: float) -> float:
    """Frequency above which a channel holds little but noise [Hz], from its own spectrum."""
    n = next_fast_len(len(values), real=True)
    power = np.abs(rfft((values - values.mean()) * np.hanning(len(values)), n)) ** 2
    frequency = np.fft.rfftfreq(n, step)
    top = frequency[-1]
    floor = float(np.mean(power[frequency > 0.6 * top]))
    edges = np.geomspace(max(4.0 * frequency[1], top / 500.0), top, 40)
    for low, high in zip(edges[-2::-1], edges[:0:-1], strict=True):
        inside = power[(frequency >= low) & (frequency < high)]
        if len(inside) > 3 and inside.mean() > 30.0 * floor:
            return float(min(1.3 * high, top))
    return float(edges[4])
