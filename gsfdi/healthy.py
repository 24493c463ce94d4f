"""The fault-free joint, found from fault-free recordings: a model file's plant where there is one, refined either way.

A real joint has friction, weight and cables that no linear model holds. What is learnt here is a description of
normality, not a diagnosis: terms share what they cannot tell apart, and a prior keeps each of them sensible.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy import signal

from gsfdi.directions import DIRECTIONS, Direction, Moving, library
from gsfdi.errors import BaselineError
from gsfdi.model import JointModel, Plant
from gsfdi.nominal import Nominal, entries, filtered, observer, score, watch
from gsfdi.stretches import Stretch, sampling_step, stretches
from gsfdi.types import Array, JointRecord

BY_KEY: Mapping[str, Direction] = {one.key: one for one in DIRECTIONS}
LEARNT = (
    "constant_load", "coulomb_friction:motor", "viscous_friction:motor", "asymmetric_friction", "stribeck_friction",
    "gravity_unbalance:s", "gravity_unbalance:c", "cable_harness", "quadratic_friction", "load_dependent_friction",
    *(one.key for one in DIRECTIONS if one.fault in ("cogging", "torque_ripple")),
)  # fmt: skip
"""Terms that a fault-free joint may be found to have."""
SIMPLE = LEARNT[:4] + LEARNT[5:7]
"""Those of them that a first regression may find."""
TRUST = 0.2
"""Spread of the prior on a model file's inertias and stiffness, as a share."""
WORTH = 0.01
"""Drop of the innovations' weighted squares, per sample, for which the nominal joint is changed.

Noise of the measured effort correlates with the loop's own wobble, and leans on weakly excited directions a little; a
joint that truly differs from its model file differs by far more than this."""
EXTRA = ("setpoint", "temperature")
"""Channels carried along where every batch has them."""


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


def cut(record: JointRecord, nominal: Nominal, extra: Sequence[str] = ()) -> list[Stretch]:
    """Stretches of a record on which the nominal joint's observer can run."""
    return list(stretches(record, nominal.channels + tuple(extra), nominal.step))


def learn_nominal(records: Sequence[JointRecord], model: JointModel | None) -> Nominal:
    """Find the nominal joint behind several fault-free records of it."""
    nominal = _first_guess(records, model)
    parts = [part for record in records for part in cut(record, nominal)]
    if not parts:
        raise BaselineError(
            records[0].joint, "no stretch of usable telemetry to learn from", "give longer fault-free batches"
        )
    parts = _spread(parts)
    noise = [noise_of(np.concatenate([part.values["position"] for part in parts]))]
    if nominal.velocity:
        noise.append(noise_of(np.concatenate([part.values[nominal.velocity] for part in parts])))
    noise = _declared(noise, model, nominal.velocity)
    turns = nominal.plant.gear_ratio if nominal.velocity == "motor_velocity" else 1.0
    noise_speed = noise[1] / turns if len(noise) > 1 else noise[0] / nominal.step
    brisk = float(np.sqrt(np.mean(np.concatenate([np.gradient(p.values["position"], p.step) for p in parts]) ** 2)))
    nominal = replace(nominal, noise=tuple(noise), slow=max(3.0 * noise_speed, 0.02 * brisk, 1e-9))
    if model is None:
        nominal = _regressed(nominal, parts)
    nominal = _tuned(nominal, parts)
    keys = _terms(nominal, parts)
    for _ in range(2):
        nominal = _refined(nominal, parts, keys, model)
        nominal = _tuned(nominal, parts)
    nominal = _refined(nominal, parts, keys, model)
    return _weighted(nominal, parts)


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


def _spread(parts: list[Stretch], most: int = 120_000) -> list[Stretch]:
    """At most about `most` samples, taken evenly over the stretches, so that learning takes a bounded time."""
    total = sum(len(part.trusted) for part in parts)
    if total <= most:
        return parts
    kept, share, owed = [], most / total, 0.0
    for part in parts:
        owed += share * len(part.trusted)
        take = int(min(owed, len(part.trusted)))
        if take >= 200:
            kept.append(
                part._replace(values={k: v[:take] for k, v in part.values.items()}, trusted=part.trusted[:take])
            )
            owed -= take
    return kept


def _first_guess(records: Sequence[JointRecord], model: JointModel | None) -> Nominal:
    first = records[0]
    effort = first.effort
    if effort not in first or "position" not in first:
        raise BaselineError(first.joint, "a baseline needs position and motor current or drive torque", "map them")
    step = sampling_step(records)
    velocity = next((n for n in ("motor_velocity", "joint_velocity") if all(_moves(r, n) for r in records)), "")
    plant = model.plant if model is not None else Plant(output_inertia=1.0)
    if effort == "drive_torque":
        plant = replace(plant, torque_constant=1.0 / plant.gear_ratio)
    if model is None and velocity == "motor_velocity":
        plant = replace(plant, gear_ratio=_ratio(records), torque_constant=1.0 / _ratio(records))
    return Nominal(plant, effort, velocity, step)


def _moves(record: JointRecord, name: str) -> bool:
    """Whether the channel is there and is more than a constant."""
    if name not in record:
        return False
    values = record[name]
    values = values[np.isfinite(values)]
    return len(values) > 50 and float(np.ptp(values)) > 0


def _ratio(records: Sequence[JointRecord]) -> float:
    """Gear ratio from motor speed against the slope of the joint angle."""
    top = bottom = 0.0
    for record in records:
        for part in stretches(record, ("position", "motor_velocity"), sampling_step(records)):
            slope = np.gradient(part.values["position"], part.step)
            top += float(np.sum(slope * part.values["motor_velocity"]))
            bottom += float(np.sum(slope * slope))
    return top / bottom if bottom > 0 and top > 0 else 1.0


def _regressed(nominal: Nominal, parts: Sequence[Stretch]) -> Nominal:
    """Inertia, friction and weight of a joint without a model file: smoothed effort regressed on smoothed motion."""
    keys = [key for key in _terms(nominal, parts) if key in SIMPLE]
    rows, pushes = [], []
    b, a = signal.butter(2, min(0.5, max(10.0 * nominal.step, 0.05)))
    for part in parts:
        if len(part.trusted) < 60:
            continue
        smooth = {name: signal.filtfilt(b, a, part.values[name]) for name in ("position", nominal.effort)}
        speed = np.gradient(smooth["position"], part.step)
        zero = np.zeros_like(speed)
        seen = Moving(part.t, smooth["position"], speed, zero, smooth["position"], speed, zero, zero, zero, zero, zero,
                      zero, nominal.plant, nominal.slow)  # fmt: skip
        columns = [np.gradient(speed, part.step), *(BY_KEY[key].shape(seen) for key in keys)]  # type: ignore[misc]
        rows.append(np.column_stack(columns)[5:-5])
        pushes.append(smooth[nominal.effort][5:-5] * nominal.plant.gear_ratio * nominal.plant.torque_constant)
    if not rows:
        return nominal
    X, y = np.concatenate(rows), np.concatenate(pushes)
    X = X / (scale := np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-12))
    found = np.linalg.solve(X.T @ X + 1e-4 * len(X) * np.eye(X.shape[1]), X.T @ y) / scale
    least = 0.02 * float(np.std(y)) / max(float(scale[0]), 1e-12)
    terms = dict(zip(keys, (float(value) for value in found[1:]), strict=True))
    terms["coulomb_friction:motor"] = max(terms.get("coulomb_friction:motor", 0.0), 0.0)
    plant = replace(nominal.plant, output_inertia=max(float(found[0]), least))
    return replace(nominal, plant=plant, terms=terms)


def _terms(nominal: Nominal, parts: Sequence[Stretch]) -> tuple[str, ...]:
    """Terms to learn: those that this joint's motion can tell from nothing."""
    reach = float(np.ptp(np.concatenate([part.values["position"] for part in parts])))
    keys = [key for key in LEARNT if nominal.flexible or BY_KEY[key].rigid]
    if reach < 0.3:
        keys = [key for key in keys if not key.startswith("gravity")]
    turns = reach * nominal.plant.gear_ratio / (2.0 * np.pi)  # a wave that does not come round twice is a slope
    waves = {key for key in keys if BY_KEY[key].fault in ("cogging", "torque_ripple")}
    return tuple(key for key in keys if key not in waves or turns * _order(key) > 2.0)


def _order(key: str) -> int:
    return int(key.partition(":")[2][:-1])


def _likelihood(nominal: Nominal, parts: Sequence[Stretch]) -> float:
    """Gaussian log-likelihood of the innovations, their covariance taken from themselves."""
    run = observer(nominal)
    total, count = np.zeros((nominal.measured, nominal.measured)), 0.0
    for part in parts:
        seen = filtered(nominal, run, part, BY_KEY)
        e = seen.e[seen.live * seen.used > 0]
        with np.errstate(over="ignore", invalid="ignore"):  # a guess may run away
            total += e.T @ e
        count += len(e)
    if not np.isfinite(total).all():
        return -np.inf
    sign, size = np.linalg.slogdet(total / max(count, 1.0) + 1e-300 * np.eye(len(total)))
    return -0.5 * count * float(size) if sign > 0 and np.isfinite(size) else -np.inf


def _tuned(nominal: Nominal, parts: Sequence[Stretch]) -> Nominal:
    """Choose the unrest of the drive and the hold of the effort that make the innovations most likely."""
    some = _spread(list(parts), 20_000)
    usual = float(np.std(np.concatenate([part.values[nominal.effort] for part in some]))) or 1.0
    for powers in (np.arange(-4.5, 1.1, 0.75), (-0.5, -0.25, 0.0, 0.25, 0.5)):
        middle = usual if len(powers) > 5 else nominal.unrest
        grid = [replace(nominal, unrest=float(middle * 10.0**power)) for power in powers]
        nominal = max(grid, key=lambda one: _likelihood(one, some))
    return max((replace(nominal, held=share) for share in (0.0, 0.5, 1.0)), key=lambda one: _likelihood(one, some))


def _refined(nominal: Nominal, parts: Sequence[Stretch], keys: Sequence[str], model: JointModel | None) -> Nominal:
    """One Gauss-Newton step on the terms and on the plant's inertias and stiffness, with priors."""
    exact = [d for d in library(nominal.flexible, bool(nominal.velocity), False) if d.enters == "exact"]
    exact = [d for d in exact if d.fault != "torque_constant_change"]
    directions = [*exact, *(BY_KEY[key] for key in keys)]
    nominal = _weighted(nominal, parts)
    run = observer(nominal)
    entry = entries(nominal, run, directions)
    g, H, samples = np.zeros(len(directions)), np.zeros((len(directions),) * 2), 0.0
    for part in parts:
        seen = watch(nominal, run, part, BY_KEY)
        scored = score(run, entry, seen, directions, np.zeros(len(seen.u), dtype=np.int64), 1)
        g += scored.g[0]
        H += scored.H
        samples += float(scored.energy[:, 1].sum())
    trust = TRUST if model is not None else 1.0
    prior = np.zeros(len(directions))
    for j, one in enumerate(directions):
        prior[j] = 1.0 / trust**2 if one.enters == "exact" else 1e-6 * H[j, j] + 1e-300
    start = model.plant if model is not None else nominal.plant
    gone = [
        _gone(nominal.plant, start, d) if d.enters == "exact" else nominal.terms.get(d.key, 0.0) for d in directions
    ]
    pull = prior * np.array(gone)
    H += np.diag(prior)
    step = np.array([0.0 if d.enters == "exact" else -nominal.terms.get(d.key, 0.0) for d in directions])
    bare = g - pull - H @ step  # the score of the joint without any learnt term
    kept = _worth(H, bare, 30.0 + WORTH * samples)
    step[kept] += np.linalg.solve(H[np.ix_(kept, kept)], bare[kept])
    return _moved(nominal, directions, step)


def _worth(H: Array, g: Array, least: float) -> list[int]:
    """Directions worth learning: each must lower the weighted squares of the innovations by `least` when it joins."""
    kept: list[int] = []
    while True:
        rows = np.ix_(kept, kept)
        rest = [j for j in range(len(g)) if j not in kept]
        if not rest:
            return sorted(kept)
        solved = np.linalg.solve(H[rows], np.column_stack([g[kept], H[np.ix_(kept, rest)]])) if kept else None
        left = g[rest] - (H[np.ix_(rest, kept)] @ solved[:, 0] if solved is not None else 0.0)
        own = np.diag(H)[rest] - (
            np.einsum("rk,kr->r", H[np.ix_(rest, kept)], solved[:, 1:]) if solved is not None else 0.0
        )
        gain = np.where(own > 1e-6 * np.diag(H)[rest], left**2 / np.maximum(own, 1e-300), 0.0)
        if gain.max() < least:
            return sorted(kept)
        kept.append(rest[int(np.argmax(gain))])


PLANT_FIELD = {
    "motor_inertia_change": "motor_inertia",
    "output_inertia_change": "output_inertia",
    "stiffness_change": "stiffness",
}


def _gone(plant: Plant, start: Plant, one: Direction) -> float:
    """How far a parameter has gone from where it started, as a share."""
    name = PLANT_FIELD[one.fault]
    return float(np.log(getattr(plant, name) / getattr(start, name)))


def _moved(nominal: Nominal, directions: Sequence[Direction], step: Array) -> Nominal:
    plant, terms = nominal.plant, dict(nominal.terms)
    for one, change in zip(directions, step, strict=True):
        if one.enters == "exact":
            name = PLANT_FIELD[one.fault]
            factor = float(np.clip(1.0 + change, 0.5, 2.0))
            plant = replace(plant, **{name: getattr(plant, name) * factor})
        else:
            terms[one.key] = terms.get(one.key, 0.0) + float(change)
    terms["coulomb_friction:motor"] = max(terms.get("coulomb_friction:motor", 0.0), 0.0)
    return replace(nominal, plant=plant, terms=terms)


def _weighted(nominal: Nominal, parts: Sequence[Stretch]) -> Nominal:
    """Take the innovations' own covariance, robustly, as their weight."""
    run = observer(nominal)
    kept = []
    for part in parts:
        seen = filtered(nominal, run, part, BY_KEY)
        kept.append(seen.e[(seen.live * seen.used) > 0])
    e = np.concatenate(kept)
    if len(e) < 50:
        raise BaselineError("baseline", "too little usable telemetry to learn from", "give longer fault-free batches")
    size = np.abs(e) / (1.4826 * np.median(np.abs(e), axis=0) + 1e-300)
    e = e[(size < 8.0).all(axis=1)] if (size < 8.0).all(axis=1).sum() > 50 else e
    S = np.cov(e.T).reshape(e.shape[1], e.shape[1])
    W = np.linalg.inv(S + 1e-12 * np.diag(np.diag(S)) + 1e-300 * np.eye(len(S)))
    return replace(nominal, weight=tuple(tuple(float(w) for w in row) for row in W))
