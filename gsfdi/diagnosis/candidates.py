"""Faults that could explain a batch: how probable each is, and how far its explanation goes."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gsfdi.baseline import JointBaseline
from gsfdi.detectors import Numbers
from gsfdi.detectors.innovations import cleaned
from gsfdi.directions import Direction, grouped, library
from gsfdi.types import Array, Finding

RARE: Mapping[str, float] = {
    "motor_inertia_change": 0.05, "magnetic_saturation": 0.1, "end_stop": 0.2,
    "quadratic_friction": 0.2, "stiffening": 0.2, "gearbox_damping": 0.1, "current_bias": 0.5, "gravity_unbalance": 0.5,
    "actuation_delay": 0.3, "position_dependent_friction": 0.5, "asymmetric_friction": 0.5, "cable_harness": 0.5,
    "torque_ripple": 0.5, "cogging": 0.5,
}  # fmt: skip
"""How much less often than the others a fault is met, where experience says so."""
SURE = 30.0
"""Independent pieces of evidence that a batch is taken to hold, however many its samples."""
ROUGH = 1e-3
"""Share of a fault's effect that its direction, true to first order, may get wrong."""


class Candidate(NamedTuple):
    """A fault that could explain the batch.

    `size` and `error` are in the unit of its direction (per second where it ramps), `onset` in seconds; `gain` is
    twice the log-likelihood that it adds, `cosine` how like the batch's fingerprint is to the fault's.
    """

    direction: Direction
    probability: float
    size: float
    error: float
    onset: float
    ramp: bool
    gain: float
    cosine: float

    @property
    def fault(self) -> str:
        """The contract's id; a torque constant that changes steadily is a drift."""
        drifts = self.ramp and self.direction.fault == "torque_constant_change"
        return "torque_constant_drift" if drifts else self.direction.fault


def candidates_of(found: Finding, numbers: Numbers, baseline: JointBaseline, payload_free: bool) -> list[Candidate]:
    """Faults that could explain the batch, most probable first.

    Parameters
    ----------
    found : Finding
        What the innovations lean towards.
    numbers : mapping of str to array
        The innovations' sums over the time judged.
    baseline : JointBaseline
        What the fault-free joint does.
    payload_free : bool
        Whether the output inertia may change without being a fault.
    """
    best: dict[str, Candidate] = {}
    for one in leaning(found, numbers, baseline):
        fault = one.direction.fault
        if payload_free and fault == "output_inertia_change":
            continue
        if fault not in best or one.gain > best[fault].gain:
            best[fault] = one
    ranked = sorted(best.values(), key=lambda one: -one.gain)
    weights = weights_of(ranked, numbers, baseline)
    weighed = [one._replace(probability=float(w)) for one, w in zip(ranked, weights, strict=True)]
    return sorted(weighed, key=lambda one: -one.probability)


def leaning(found: Finding, numbers: Numbers, baseline: JointBaseline) -> list[Candidate]:
    """One candidate per lean that was tried."""
    evidence, directions = found.evidence, directions_of(baseline)
    names = evidence["names"]
    assert isinstance(names, list)
    first = {name: members[0] for name, members in grouped(directions)}
    cosines = cosines_of(numbers, baseline)
    size, error, onset, ramp, gain = (np.asarray(evidence[key]) for key in ("size", "error", "onset", "ramp", "gain"))
    return [
        Candidate(
            directions[first[name]], 0.0, float(size[i]), float(error[i]), float(onset[i]), bool(ramp[i]),
            float(gain[i]), float(cosines[first[name]]),
        )
        for i, name in enumerate(names)
    ]  # fmt: skip


def weights_of(ranked: Sequence[Candidate], numbers: Numbers, baseline: JointBaseline) -> Array:
    """Probability of each candidate, the first being the one that explains most."""
    top = ranked[0].gain
    # What the best leaves unexplained says how far the model can be trusted; a gain below that decides little.
    left = max(excess(numbers, baseline) - top, 0.0) + ROUGH * top + SURE
    pooled = max(float(baseline.learnt["innovations"]["pooled"][0]), 1.0)
    short = np.array([top - one.gain for one in ranked])
    weights = np.exp(-np.minimum(0.5 * short / pooled, 0.5 * SURE * np.log1p(short / left)))
    weights *= np.array([RARE.get(one.direction.fault, 1.0) for one in ranked])
    weights /= weights.sum()
    return np.asarray(weights)


def directions_of(baseline: JointBaseline) -> tuple[Direction, ...]:
    """Faults of the library that such a joint can have."""
    return library(baseline.nominal.flexible, bool(baseline.nominal.velocity), temperature=False)


def cosines_of(numbers: Numbers, baseline: JointBaseline) -> Array:
    """Cosine of the batch's fingerprint with that of each known failure, as the model foretells it in this motion."""
    learnt, H = baseline.learnt["innovations"], numbers["H"]
    h = np.maximum(np.diag(H), 1e-300)
    g = cleaned(numbers, learnt["lean"], learnt["drift"]).sum(axis=0)
    batch, known = g / np.sqrt(h), H / np.sqrt(h)[:, None]
    return np.asarray(np.abs(batch @ known) / np.maximum(np.linalg.norm(batch) * np.linalg.norm(known, axis=0), 1e-300))


def excess(numbers: Numbers, baseline: JointBaseline) -> float:
    """Weighted squares of the innovations beyond those of a fault-free batch as long."""
    energy = numbers["energy"].sum(axis=0)
    return float(energy[0] - energy[1] * baseline.learnt["innovations"]["energy"][0])
