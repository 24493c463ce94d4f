"""Degradation fitted over a history: when a growing quantity reaches its limit, and how surely it grows."""

from typing import NamedTuple

import numpy as np

from gsfdi.types import Array

FEWEST = 4
"""Batches below which no trend is spoken of."""
DRAWS = 3000
"""Courses drawn from the likelihood."""


class Forecast(NamedTuple):
    """Days until a limit, with a 90 % interval, and how clearly the history shows a trend."""

    days: float
    low: float
    high: float
    clarity: float
    rate: float


def forecast(t: Array, value: Array, error: Array, limit: float, seed: int = 0) -> Forecast | None:
    """When a degrading quantity reaches its limit, counted from the last entry.

    Parameters
    ----------
    t : (n,) array
        Times of the entries [days].
    value, error : (n,) arrays
        Estimates and their standard errors.
    limit : float
        Size at which maintenance is due; the sign follows the trend.
    seed : int
        Of the draws that carry the likelihood to the due date.

    Returns
    -------
    Forecast or None
        None where there are too few entries.
    """
    if len(t) < FEWEST or not np.ptp(t) > 0:
        return None
    t = t - t[-1]
    cells = _cells(t, value, error)
    best_flat = max(_flat(value, error, scatter) for scatter in _scatters(value, error))
    weights = np.array([cell.weight for cell in cells])
    clarity = 2.0 * float(max(cell.peak for cell in cells) - best_flat)
    weights = np.exp(weights - weights.max())
    rng = np.random.default_rng(seed)
    picks = rng.choice(len(cells), size=DRAWS, p=weights / weights.sum())
    normal = rng.standard_normal((DRAWS, 2))
    drawn = [cells[k].mean + cells[k].root @ some for k, some in zip(picks, normal, strict=True)]
    ahead = [_days_ahead(cells[k], c, b, limit) for k, (c, b) in zip(picks, drawn, strict=True)]
    low, middle, high = (float(np.quantile(ahead, q, method="nearest")) for q in (0.05, 0.5, 0.95))
    return Forecast(middle, low, high, clarity, float(np.median([b for _, b in drawn])))


def is_trending(t: Array, value: Array) -> bool:
    """Whether there is anything to fit, by a straight line through the history."""
    if len(t) < FEWEST or not np.ptp(t) > 0:
        return False
    slope, offset = np.polyfit(t - t.mean(), value, 1)
    left = value - offset - slope * (t - t.mean())
    spread = np.sqrt(max(float(np.sum(left**2)) / max(len(t) - 2, 1), 1e-300) / np.sum((t - t.mean()) ** 2))
    return bool(abs(slope) > 3.0 * spread)


def _days_ahead(cell: "_Cell", offset: float, rate: float, limit: float) -> float:
    """Days until a course of the cell's form reaches the limit in the direction in which it grows."""
    room = (np.sign(rate) * limit - offset) / rate if rate != 0 else np.inf
    if room <= 0:
        return 0.0
    return float(max(cell.onset + room ** (1.0 / cell.power), 0.0)) if np.isfinite(room) else np.inf


class _Cell(NamedTuple):
    """One form, onset and scatter: the Gaussian of offset and rate that it leaves, and its weight."""

    power: float
    onset: float
    mean: Array
    root: Array
    weight: float
    peak: float


def _scatters(value: Array, error: Array) -> Array:
    usual = float(np.median(error))
    return np.concatenate([[0.0], usual * np.geomspace(0.3, 10.0, 6)])


def _flat(value: Array, error: Array, scatter: float) -> float:
    variance = error**2 + scatter**2
    mean = np.sum(value / variance) / np.sum(1.0 / variance)
    return float(-0.5 * np.sum((value - mean) ** 2 / variance + np.log(variance)))


def _cells(t: Array, value: Array, error: Array) -> list[_Cell]:
    """Every form, onset and scatter that leaves three entries to tell of a rate."""
    span = float(np.ptp(t))
    onsets = np.concatenate([[-1.5 * span, -1.2 * span], np.linspace(-span, -0.1 * span, 24)])
    return [
        _cell(t, value, error**2 + scatter**2, power, float(onset))
        for scatter in _scatters(value, error)
        for power in (1.0, 2.0)
        for onset in onsets
        if np.sum(t > onset) >= 3
    ]


def _cell(t: Array, value: Array, variance: Array, power: float, onset: float) -> _Cell:
    """Fit offset and rate of one form by weighted least squares."""
    X = np.column_stack([np.ones_like(t), np.maximum(t - onset, 0.0) ** power])
    # The baseline was learnt at zero, so the offset is about as small as the entries' own scatter.
    precision = X.T @ (X / variance[:, None]) + np.diag([1.0 / np.median(variance), 0.0])
    mean = np.asarray(np.linalg.solve(precision, X.T @ (value / variance)), dtype=np.float64)
    left = value - X @ mean
    peak = float(-0.5 * np.sum(left**2 / variance + np.log(variance)))
    covariance = np.linalg.inv(precision)
    _, size = np.linalg.slogdet(covariance)
    root = np.asarray(np.linalg.cholesky(0.5 * (covariance + covariance.T)), dtype=np.float64)
    # The rate's own scale must not favour one form: flat in the size reached at the last entry.
    reach = float(np.log(max(-onset, 1e-9) ** power))
    return _Cell(power, onset, mean, root, peak + 0.5 * float(size) + reach, peak)
