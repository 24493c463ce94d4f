"""The ledger of a joint's batches: what a row holds, and what all rows say of the date."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from gsfdi.prognosis.trend import FEWEST, Forecast, forecast, is_trending
from gsfdi.types import Due, Finding

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
    best = _clearest(rows, fault, limit)
    if best is None:
        return Due(None, None, "no degradation is under way")
    key, found, last = best
    name = key.partition(":")[0].replace("_", " ")
    if found.days > HORIZON:
        return Due(None, None, f"{name} grows, but its limit is more than {HORIZON / 365:.0f} years away")
    reason = f"{name} grows and takes {100 * limit:.0f} % of the joint's capability by then"
    interval = (_date(last + found.low), _date(last + min(found.high, 2.0 * HORIZON)))
    return Due(_date(last + found.days), interval, reason)


def _clearest(
    rows: Sequence[Mapping[str, object]], fault: str | None, limit: float
) -> tuple[str, Forecast, float] | None:
    """The clearest trend: its name in the ledger, the forecast, and the day of its last entry."""
    best: tuple[str, Forecast, float] | None = None
    keys = sorted({key for one in rows for key in _shares(one)})
    for key in keys:
        if fault is not None and key.partition(":")[0] != fault.replace("_drift", "_change"):
            continue
        kept = [(_when(one) / 86400.0, *_shares(one)[key]) for one in rows if key in _shares(one)]
        t, value, error = np.array(kept, dtype=np.float64).T
        if fault is None and not is_trending(t, value):
            continue
        found = forecast(t, value, np.maximum(error, 1e-12), limit)
        # A trend among many histories is only believed when it would stand out among that many.
        clear = found is not None and found.clarity - 2.0 * np.log(len(keys) if fault is None else 1) > CLEAR
        if found is not None and clear and (best is None or found.clarity > best[1].clarity):
            best = (key, found, t[-1])
    return best


def _when(one: Mapping[str, object]) -> float:
    when = one["when"]
    assert isinstance(when, int | float)
    return float(when)


def _shares(one: Mapping[str, object]) -> Mapping[str, tuple[float, float]]:
    shares = one.get("shares")
    return shares if isinstance(shares, Mapping) else {}


def _date(days: float) -> str:
    return (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(days=float(days))).date().isoformat()
