"""How a joint's degradation grew over the nights, and when it reaches its limit."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from gsfdi.reports.page import Figure, percent, plotted, words
from gsfdi.svg import Level, Line, Mark, Plot, Ribbon, Span
from gsfdi.types import Verdict

Row = Mapping[str, Any]
DAY = 86400.0


def trend_figures(verdict: Verdict, ledger: Sequence[Row], limit: float) -> Iterator[Figure]:
    """Draw the share of the joint's capability that its fault takes, batch by batch, and the date foretold from it.

    Parameters
    ----------
    verdict : Verdict
        Says which fault, and when maintenance is due.
    ledger : sequence of mapping
        Rows of the joint's ledger, this batch's included.
    limit : float
        Share at which maintenance is due.
    """
    key = history_of(verdict, ledger)
    kept = [(float(row["when"]) / DAY, *row["shares"][key]) for row in ledger if key in (row.get("shares") or {})]
    if len(kept) < 2:
        return
    days, share, error = np.array(sorted(kept), dtype=float).T
    days -= days[-1]
    bound = float(np.copysign(limit, share[-1]))
    marks: list[Mark] = [
        Ribbon(days, 100 * (share - 2 * error), 100 * (share + 2 * error), "± 2 standard errors"),
        Line(days, 100 * share, "by batch"),
        Level(100 * bound, "limit"),
    ]
    if verdict.due.when is not None:
        marks += foretold(verdict, max(float(row["when"]) for row in ledger) / DAY, 100 * share[-1], 100 * bound)
    what = words(str(key).partition(":")[0])
    caption = f"What {what} takes of the joint's capability, batch by batch; {percent(limit)} is the limit."
    title = f"{verdict.joint}: {what} over time"
    yield plotted(Plot(title, caption, tuple(marks), "days from this batch", "", "share of capability", "%"))


def foretold(verdict: Verdict, now: float, last: float, bound: float) -> Iterator[Mark]:
    """Mark the due date and its interval, in days from `now`."""
    due = verdict.due
    if due.when is not None:
        yield Line([0.0, days_of(due.when) - now], [last, bound], "foretold", "before")
    if due.interval90 is not None:
        yield Span(days_of(due.interval90[0]) - now, days_of(due.interval90[1]) - now, "due")


def days_of(date: str) -> float:
    """Turn an ISO date into days since the epoch.

    Examples
    --------
    >>> days_of("1970-01-03")
    2.0
    """
    return datetime.fromisoformat(date).replace(tzinfo=UTC).timestamp() / DAY


def history_of(verdict: Verdict, ledger: Sequence[Row]) -> str | None:
    """Choose the history that belongs to the verdict: its fault's, else the one that its outlook speaks of."""
    names = dict.fromkeys(name for row in ledger for name in row.get("shares") or {})
    sizes = {
        name: max(abs(row["shares"][name][0]) for row in ledger if name in (row.get("shares") or {})) for name in names
    }
    if verdict.fault is not None:
        fits = [name for name in names if name.partition(":")[0] == verdict.fault.replace("_drift", "_change")]
    else:
        fits = [name for name in names if verdict.due.reason.startswith(words(name.partition(":")[0]) + " ")]
    return max(fits, key=lambda name: sizes[name], default=None)
