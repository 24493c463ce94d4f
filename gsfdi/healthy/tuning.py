"""Noise that no channel shows by itself: what drives the joint beside its effort, and the weight of innovations."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsfdi.errors import BaselineError
from gsfdi.healthy.samples import thinned
from gsfdi.healthy.terms import BY_KEY
from gsfdi.nominal import Nominal, filtered, observer
from gsfdi.stretches import Stretch


def tuned(nominal: Nominal, parts: Sequence[Stretch]) -> Nominal:
    """Choose the unrest of the drive and the hold of the effort that make the innovations most likely."""
    some = thinned(list(parts), 20_000)
    usual = float(np.std(np.concatenate([part.values[nominal.effort] for part in some]))) or 1.0
    for powers in (np.arange(-4.5, 1.1, 0.75), (-0.5, -0.25, 0.0, 0.25, 0.5)):
        middle = usual if len(powers) > 5 else nominal.unrest
        grid = [replace(nominal, unrest=float(middle * 10.0**power)) for power in powers]
        nominal = max(grid, key=lambda one: _likelihood(one, some))
    return max((replace(nominal, held=share) for share in (0.0, 0.5, 1.0)), key=lambda one: _likelihood(one, some))


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


def weighted(nominal: Nominal, parts: Sequence[Stretch]) -> Nominal:
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
