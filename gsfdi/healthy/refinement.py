"""Gauss-Newton steps on the plant and its terms, none of which joins unless it is worth it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsfdi.directions import Direction, library
from gsfdi.healthy.terms import BY_KEY
from gsfdi.healthy.tuning import weighted
from gsfdi.model import JointModel, Plant
from gsfdi.nominal import Nominal, entries, observer, score, watch
from gsfdi.stretches import Stretch
from gsfdi.types import Array

TRUST = 0.2
"""Spread of the prior on a model file's inertias and stiffness, as a share."""
WORTH = 0.01
"""Drop of the innovations' weighted squares, per sample, for which the nominal joint is changed.

Noise of the measured effort correlates with the loop's own wobble, and leans on weakly excited directions a little; a
joint that truly differs from its model file differs by far more than this."""
PLANT_FIELD = {
    "motor_inertia_change": "motor_inertia",
    "output_inertia_change": "output_inertia",
    "stiffness_change": "stiffness",
}


def refined(nominal: Nominal, parts: Sequence[Stretch], keys: Sequence[str], model: JointModel | None) -> Nominal:
    """One Gauss-Newton step on the terms and on the plant's inertias and stiffness, with priors."""
    exact = [d for d in library(nominal.flexible, bool(nominal.velocity), False) if d.enters == "exact"]
    exact = [d for d in exact if d.fault != "torque_constant_change"]
    directions = [*exact, *(BY_KEY[key] for key in keys)]
    nominal = weighted(nominal, parts)
    g, H, samples = scored(nominal, parts, directions)
    trust = TRUST if model is not None else 1.0
    prior = [1.0 / trust**2 if d.enters == "exact" else 1e-6 * H[j, j] + 1e-300 for j, d in enumerate(directions)]
    start = model.plant if model is not None else nominal.plant
    now = [drift(nominal.plant, start, d) if d.enters == "exact" else nominal.terms.get(d.key, 0.0) for d in directions]
    pull = np.array(prior) * np.array(now)
    H += np.diag(prior)
    step = np.array([0.0 if d.enters == "exact" else -nominal.terms.get(d.key, 0.0) for d in directions])
    bare = g - pull - H @ step  # the score of the joint without any learnt term
    kept = worth(H, bare, 30.0 + WORTH * samples)
    step[kept] += np.linalg.solve(H[np.ix_(kept, kept)], bare[kept])
    return moved(nominal, directions, step)


def scored(nominal: Nominal, parts: Sequence[Stretch], directions: Sequence[Direction]) -> tuple[Array, Array, float]:
    """Score and information of the directions over all stretches, and the samples that they were scored on."""
    run = observer(nominal)
    entry = entries(nominal, run, directions)
    g, H, samples = np.zeros(len(directions)), np.zeros((len(directions),) * 2), 0.0
    for part in parts:
        seen = watch(nominal, run, part, BY_KEY)
        found = score(run, entry, seen, directions, np.zeros(len(seen.u), dtype=np.int64), 1)
        g += found.g[0]
        H += found.H
        samples += float(found.energy[:, 1].sum())
    return g, H, samples


def worth(H: Array, g: Array, least: float) -> list[int]:
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


def drift(plant: Plant, start: Plant, one: Direction) -> float:
    """How far a parameter has gone from where it started, as a share."""
    name = PLANT_FIELD[one.fault]
    return float(np.log(getattr(plant, name) / getattr(start, name)))


def moved(nominal: Nominal, directions: Sequence[Direction], step: Array) -> Nominal:
    """Take the step: plant parameters by a factor, terms by what is added."""
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
