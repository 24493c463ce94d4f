"""When maintenance is due: a ledger of every batch's estimates, and degradation fitted over it.

`row` makes one batch's entry from its findings, ready for a store's ledger; `due` reads the entries of a joint. A row
holds, under ``shares``, for every fault of the library the share of the joint's capability that it takes and the
standard error of that; so one limit serves them all. Each history is fitted as ``c + b (t - t0)₊`` (ramp) and
``c + b (t - t0)²₊`` (gradual) by maximum likelihood: the batches' own errors, a scatter from night to night estimated
beside them, the onset unknown. The interval of the due date comes from the whole likelihood, not from its peak.
"""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

import numpy as np

from gsfdi.types import Array, Due, Finding

FEWEST = 4
"""Batches below which no trend is spoken of."""
CLEAR = 16.0
"""Twice the gain in log-likelihood that a trend must show over no trend at all."""
HORIZON = 3650.0
"""Dates further ahead than this are not given [days]."""
SCHEMA = "gsfdi/ledger/1"


def row(findings: Sequence[Finding], when: float, level: str, fault: str | None) -> dict[str, object]:
    """Make a ledger entry of one batch.

    Parameters
    ----------
    findings : sequence of Finding
        What `gsfdi.diagnosis.assess` gave.
    when : float
        Time of the batch [s since the epoch].
    level, fault : str
        Its verdict.
    """
    matched = next((one for one in findings if one.detector == "innovations"), None)
    shares: dict[str, list[float]] = {}
    if matched is not None:
        names = matched.evidence["names"]
        values, errors = np.asarray(matched.evidence["share"]), np.asarray(matched.evidence["share_error"])
        assert isinstance(names, list)
        shares = {
            name: [float(v), float(e)]
            for name, v, e in zip(names, values, errors, strict=True)
            if np.isfinite(v) and np.isfinite(e)
        }
    return {"schema": SCHEMA, "when": when, "level": level, "fault": fault, "shares": shares}


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
    picks = rng.choice(len(cells), size=3000, p=weights / weights.sum())
    normal = rng.standard_normal((3000, 2))
    ahead, rates = np.full(3000, np.inf), np.zeros(3000)
    for i, k in enumerate(picks):
        cell = cells[k]
        c, b = cell.mean + cell.root @ normal[i]
        rates[i] = b
        room = (np.sign(b) * limit - c) / b if b != 0 else np.inf
        if room <= 0:
            ahead[i] = 0.0
        elif np.isfinite(room):
            ahead[i] = max(cell.onset + room ** (1.0 / cell.power), 0.0)
    low, middle, high = (float(np.quantile(ahead, q, method="nearest")) for q in (0.05, 0.5, 0.95))
    return Forecast(middle, low, high, clarity, float(np.median(rates)))


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
    span = float(np.ptp(t))
    onsets = np.concatenate([[-1.5 * span, -1.2 * span], np.linspace(-span, -0.1 * span, 24)])
    cells = []
    for scatter in _scatters(value, error):
        variance = error**2 + scatter**2
        for power in (1.0, 2.0):
            for onset in onsets:
                if np.sum(t > onset) < 3:
                    continue
                X = np.column_stack([np.ones_like(t), np.maximum(t - onset, 0.0) ** power])
                # The baseline was learnt at zero, so the offset is about as small as the entries' own scatter.
                precision = X.T @ (X / variance[:, None]) + np.diag([1.0 / np.median(variance), 0.0])
                mean = np.linalg.solve(precision, X.T @ (value / variance))
                left = value - X @ mean
                peak = float(-0.5 * np.sum(left**2 / variance + np.log(variance)))
                covariance = np.linalg.inv(precision)
                _, size = np.linalg.slogdet(covariance)
                root = np.asarray(np.linalg.cholesky(0.5 * (covariance + covariance.T)), dtype=np.float64)
                # The rate's own scale must not favour one form: flat in the size reached at the last entry.
                reach = np.log(max(-onset, 1e-9) ** power)
                cells.append(
                    _Cell(
                        power,
                        float(onset),
                        np.asarray(mean, dtype=np.float64),
                        root,
                        peak + 0.5 * float(size) + float(reach),
                        peak,
                    )
                )
    return cells


def due(history: Sequence[Mapping[str, object]], fault: str | None, limit: float) -> Due:
    """When maintenance of a joint is due, from its ledger.

    Parameters
    ----------
    history : sequence of mapping
        Rows of :func:`row`, in any order; the newest is the batch just judged.
    fault : str or None
        Fault that the newest batch shows; None looks for the clearest trend among all.
    limit : float
        Share of the joint's capability at which it must be maintained.
    """
    rows = sorted((one for one in history if one.get("schema") == SCHEMA), key=_when)
    if len(rows) < FEWEST:
        return Due(None, None, f"too short a history to foretell: {len(rows)} of at least {FEWEST} batches")
    best: tuple[str, Forecast, float] | None = None
    keys = sorted({key for one in rows for key in _shares(one)})
    for key in keys:
        if fault is not None and key.partition(":")[0] != fault.replace("_drift", "_change"):
            continue
        kept = [(_when(one) / 86400.0, *_shares(one)[key]) for one in rows if key in _shares(one)]
        t, value, error = np.array(kept, dtype=np.float64).T
        if fault is None and not _trending(t, value, error):
            continue
        found = forecast(t, value, np.maximum(error, 1e-12), limit)
        # A trend among many histories is only believed when it would stand out among that many.
        clear = found is not None and found.clarity - 2.0 * np.log(len(keys) if fault is None else 1) > CLEAR
        if found is not None and clear and (best is None or found.clarity > best[1].clarity):
            best = (key, found, t[-1])
    if best is None:
        return Due(None, None, "no degradation is under way")
    key, found, last = best
    name = key.partition(":")[0].replace("_", " ")
    if found.days > HORIZON:
        return Due(None, None, f"{name} grows, but its limit is more than {HORIZON / 365:.0f} years away")
    reason = f"{name} grows and takes {100 * limit:.0f} % of the joint's capability by then"
    interval = (_date(last + found.low), _date(last + min(found.high, 2.0 * HORIZON)))
    return Due(_date(last + found.days), interval, reason)


def _trending(t: Array, value: Array, error: Array) -> bool:
    """A quick look whether there is anything to fit."""
    if len(t) < FEWEST or not np.ptp(t) > 0:
        return False
    slope, offset = np.polyfit(t - t.mean(), value, 1)
    left = value - offset - slope * (t - t.mean())
    spread = np.sqrt(max(float(np.sum(left**2)) / max(len(t) - 2, 1), 1e-300) / np.sum((t - t.mean()) ** 2))
    return bool(abs(slope) > 3.0 * spread)


def _when(one: Mapping[str, object]) -> float:
    when = one["when"]
    assert isinstance(when, int | float)
    return float(when)


def _shares(one: Mapping[str, object]) -> Mapping[str, tuple[float, float]]:
    shares = one.get("shares")
    return shares if isinstance(shares, Mapping) else {}


def _date(days: float) -> str:
    return (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(days=float(days))).date().isoformat()
