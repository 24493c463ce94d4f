"""What past batches say of a joint: this batch's estimates go into the ledger, and the due date comes out of it."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from gsfdi import prognosis
from gsfdi.diagnosis import Limits
from gsfdi.store import Store
from gsfdi.types import Due, Verdict


def foretold(verdict: Verdict, store: Store, robot: str, when: float, batch: str, baseline: str) -> Verdict:
    """Enter one joint's batch into the ledger, and say when its maintenance is due.

    Parameters
    ----------
    verdict : Verdict
        What was found; without findings there is nothing to enter.
    store : Store
        Keeps the ledger.
    robot : str
        Whose joint it is.
    when : float
        Time of the batch [s since the epoch].
    batch, baseline : str
        SHA-256 of the batch and of its baseline: the same pair is entered once, and only batches that were judged
        against the same baseline make one history.

    Returns
    -------
    Verdict
        The same, with its due date.
    """
    if not verdict.findings:
        return verdict
    row = prognosis.row(verdict.findings, when, verdict.verdict, verdict.fault)
    store.append_ledger(robot, verdict.joint, f"{batch}:{baseline}", {**row, "baseline": baseline})
    rows = past(store, robot, verdict.joint, when, baseline)
    if verdict.verdict in ("distress", "critical"):
        today = datetime.fromtimestamp(when, UTC).date().isoformat()
        return replace(verdict, due=Due(today, (today, today), "the limit at which maintenance is due has been passed"))
    return replace(verdict, due=prognosis.due(rows, verdict.fault, Limits().distress))


def past(store: Store, robot: str, joint: str, when: float, baseline: str) -> list[dict[str, Any]]:
    """Give the rows of one joint's ledger up to a batch, that batch's included.

    Parameters
    ----------
    store : Store
        Keeps the ledger.
    robot, joint : str
        Whose ledger.
    when : float
        Time of the batch [s since the epoch].
    baseline : str
        SHA-256 of the baseline that it was judged against.
    """
    return [one for one in store.ledger(robot, joint) if one["baseline"] == baseline and one["when"] <= when]
