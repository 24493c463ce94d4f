"""Subspace identification: angles between observability matrices, then the step that compares B.

A finding reads: *the identified dynamics stand 0.021 rad off the baseline's (limit 0.013 rad).*

Blocks of a batch are identified in closed loop (PBSIDopt), the angles of their observability matrices to the baseline's
taken by sines, and held against the angles that fault-free blocks show. Angles are blind to B, and so to the torque
constant; where they are normal, the Markov parameters are compared, which no choice of basis changes. Where a batch
moves its inputs' window less than the baseline's blocks did, identification is noise and the detector stays silent.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg

from gsfdi import student
from gsfdi.detectors import Detector, Numbers
from gsfdi.nominal import Nominal, Watched
from gsfdi.subspace import StateSpace, angles, excitation, lagged_gram, markov, observability, pbsid
from gsfdi.types import Array, Finding

AGREED = 0.2
"""Angle below which a fault-free block has identified its joint [rad], and share by which its B may then be off."""
MOST = 48
"""Most blocks that are kept apart; beyond them neighbours are merged."""


class _Tally:
    """Lagged Gram of effort and outputs by block of time."""

    def __init__(self, nominal: Nominal, settings: Mapping[str, float]) -> None:
        self.lags, self.length = int(settings["past"]) + 1, settings["block_s"]
        self.drive = nominal.plant.gear_ratio * nominal.plant.torque_constant
        self.order = 4 if nominal.flexible else 2
        self.turns = nominal.plant.gear_ratio if nominal.velocity == "motor_velocity" else 1.0
        self.grams: list[Array] = []
        self.held: list[tuple[float, float]] = []  # seconds in the block, and its end

    def add(self, watched: Watched) -> None:
        step = watched.stretch.step
        effort = watched.acting - watched.torque[:, 0] / self.drive  # what the learnt terms leave to drive the joint
        outputs = watched.y / [1.0, self.turns][: watched.y.shape[1]]
        per = max(int(self.length / step), 4 * self.lags)
        for low in range(0, len(effort), per):
            part = slice(low, low + per)
            if len(effort[part]) < 2 * self.lags:
                continue
            w = np.column_stack([effort[part], outputs[part] - outputs[part].mean(axis=0)])
            gram = lagged_gram(w.T, self.lags)
            seconds, end = len(w) * step, float(watched.stretch.t[low]) + len(w) * step
            if self.held and self.held[-1][0] < 0.5 * self.length:
                self.grams[-1] = self.grams[-1] + gram
                self.held[-1] = (self.held[-1][0] + seconds, end)
            else:
                self.grams.append(gram)
                self.held.append((seconds, end))
        if len(self.grams) > MOST:
            pairs = range(0, len(self.grams) - 1, 2)
            self.grams = [self.grams[i] + self.grams[i + 1] for i in pairs]
            self.held = [(self.held[i][0] + self.held[i + 1][0], self.held[i + 1][1]) for i in pairs]
            self.length *= 2.0

    def numbers(self) -> dict[str, Array]:
        if not self.grams:
            return {}
        shape = np.array([self.order, len(self.grams[0]) // self.lags - 1, self.lags], dtype=np.float64)
        return {"grams": np.array(self.grams), "held": np.array(self.held), "shape": shape}


class _Block(NamedTuple):
    """What one block says: largest angle to the baseline, gain of its Markov parameters against it, excitation."""

    angle: float
    gain: float
    excitation: float


def _identified(gram: Array, scale: Array, shape: Array) -> StateSpace:
    order, outputs, lags = (int(value) for value in shape)
    tiled = np.tile(scale, lags)
    return pbsid(gram / np.outer(tiled, tiled), 1, outputs, max(order, int(0.6 * (lags - 1))), order)


def _block(gram: Array, windows: float, learnt: Numbers, shape: Array, rows: int, count: int) -> _Block | None:
    scale, order = learnt["scale"], int(shape[0])
    try:
        model = _identified(gram, scale, shape)
        basis = observability(model.A, model.C, rows)
        lean = markov(model, count).ravel()
    except (linalg.LinAlgError, ValueError):
        return None
    if not (np.isfinite(basis).all() and np.isfinite(lean).all()):
        return None
    usual = learnt["markov"]
    gain = float(lean @ usual / (usual @ usual))
    angle = float(angles(learnt["basis"].reshape(-1, order), basis)[0])
    return _Block(angle, gain, excitation(gram, 1 + int(shape[1]), windows))


def learn(gathered: Sequence[Numbers], settings: Mapping[str, float]) -> dict[str, Array]:
    """Identify the pooled fault-free joint, and see how its blocks scatter around it."""
    rows, count = int(settings["rows"]), int(settings["markov"])
    grams = np.concatenate([one["grams"] for one in gathered])
    shape = gathered[0]["shape"]
    lags = int(shape[2])
    pooled = grams.sum(axis=0)
    c = len(pooled) // lags
    scale = np.sqrt(np.maximum(np.diag(pooled)[:c], 1e-300))
    try:
        model = _identified(pooled, scale, shape)
    except (linalg.LinAlgError, ValueError):
        return {}
    learnt = {
        "scale": scale,
        "basis": observability(model.A, model.C, rows).ravel(),
        "markov": markov(model, count).ravel(),
    }
    seconds = np.concatenate([one["held"][:, 0] for one in gathered])
    blocks = [_block(gram, length, learnt, shape, rows, count) for gram, length in zip(grams, seconds, strict=True)]
    seen = [one for one in blocks if one is not None and one.angle > 0]
    least = _enough(np.array([one.excitation for one in seen]), np.array([one.angle for one in seen]))
    seen = [one for one in seen if one.excitation >= least]
    if len(seen) < 3:
        return {}
    logs = np.log([one.angle for one in seen])
    gains = np.array([one.gain for one in seen])
    learnt["angle"] = np.array([logs.mean(), max(float(logs.std(ddof=1)), 0.1), len(seen)])
    learnt["gain"] = np.array([gains.mean(), max(float(gains.std(ddof=1)), settings["tolerance"]), len(seen)])
    learnt["excitation"] = np.array([least])
    return learnt


def _enough(moved: Array, angle: Array) -> float:
    """Excitation from which fault-free blocks agree with their pool; infinite where none do."""
    order = np.argsort(-moved)
    good = angle[order] < AGREED
    share = np.cumsum(good) / (np.arange(len(good)) + 1.0)
    fine = np.flatnonzero(good & (share >= 0.9))
    if not len(fine):
        return np.inf
    rest = moved[order[fine[-1] + 1 :]]  # half-way to the block that did not agree
    return float(moved[order[fine[-1]]] * (np.sqrt(rest[0] / moved[order[fine[-1]]]) if len(rest) else 0.5))


def look(numbers: Numbers, learnt: Numbers, rate: float, settings: Mapping[str, float]) -> Finding | None:
    """Angles first, then B."""
    if "grams" not in numbers or "angle" not in learnt:
        return None
    rows, count = int(settings["rows"]), int(settings["markov"])
    held = numbers["held"]
    found = [_block(gram, seconds, learnt, numbers["shape"], rows, count)
             for gram, (seconds, _) in zip(numbers["grams"], held, strict=True)]  # fmt: skip
    least = float(learnt["excitation"][0])
    kept = [(end, one) for (_, end), one in zip(held, found, strict=True) if one and one.excitation >= least]
    if not kept:
        return None
    ends = np.array([end for end, _ in kept])
    logs = np.log(np.maximum([one.angle for _, one in kept], 1e-300))
    gains = np.array([one.gain for _, one in kept])
    share = 0.5 * rate
    angle = _test(logs, learnt["angle"], share, both_sides=False)
    gain = _test(gains, learnt["gain"], share, both_sides=True)
    if learnt["gain"][1] > AGREED:  # nor do fault-free blocks agree on it, as where a rigid joint stands for a flexible
        gain = gain._replace(p=1.0, alarm=False)
    mean, spread, _ = learnt["angle"]
    limit = float(np.exp(min(mean + angle.limit * spread * np.sqrt(1.0 / len(logs)), np.log(0.5 * np.pi))))
    alarm = angle.alarm or gain.alarm
    typical = float(np.exp(logs.mean()))
    sentence = f"the identified dynamics stand {typical:.3g} rad off the baseline's (limit {limit:.3g} rad)"
    if gain.alarm and not angle.alarm:
        times = float(np.median(gains))
        sentence = f"the dynamics are the baseline's, but the drive acts with {times:.3g} times its usual strength"
    over = np.abs((gains - learnt["gain"][0]) / learnt["gain"][1]) > 3.0 if gain.alarm else (logs - mean) / spread > 2.0
    onset = float(ends[int(np.argmax(over))] - numbers["held"][0][0]) if alarm and over.any() else None
    return Finding(
        "smi", "smi", "", alarm, float(min(1.0, 2.0 * min(angle.p, gain.p))), typical, limit, "rad", sentence,
        max(onset, 0.0) if onset is not None else None,
        {"t": ends, "angles": np.exp(logs), "threshold": limit,
         "markov": (gains - learnt["gain"][0]) / learnt["gain"][1],
         "markov_gain": gains, "markov_threshold": gain.limit},
    )  # fmt: skip


class _Outcome(NamedTuple):
    p: float
    limit: float
    alarm: bool


def _test(values: Array, usual: Array, rate: float, *, both_sides: bool) -> _Outcome:
    """Whether the mean of the blocks stands out; the baseline's own mean is as uncertain as its blocks are few."""
    mean, spread, count = (float(value) for value in usual)
    sides = 2.0 if both_sides else 1.0
    limit = student.limit(rate / sides, count - 1.0)
    root = np.sqrt(1.0 / max(len(values) - 1, 1) + 1.0 / count)
    if len(values) < 2:
        return _Outcome(1.0, limit * root * np.sqrt(len(values)), False)
    off = values - mean
    # One block alone may be one disturbance: what the others say without the strongest must stand out by itself.
    rest = np.delete(off, int(np.argmax(np.abs(off) if both_sides else off)))
    size = float(rest.mean()) / (spread * root)
    p = float(min(1.0, sides * student.beyond(abs(size) if both_sides else size, count - 1.0)))
    return _Outcome(p, limit * root * np.sqrt(len(values)), p < rate)


DETECTOR = Detector(
    name="smi",
    method="smi",
    needs=(),
    settings={"past": 20.0, "block_s": 10.0, "rows": 12.0, "markov": 12.0, "tolerance": 1e-3},
    tally=_Tally,
    learn=learn,
    look=look,
    false_alarm_rate=0.2,
    source="NLR predictive maintenance concept, section 2 (SMI); Verhaegen 1994; Chiuso 2007 (PBSIDopt)",
)
