"""One form of report per file; each ends in a frozen `REPORT`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from gsfdi.types import JointRecord, Problem, Verdict


@dataclass(frozen=True, slots=True)
class Analysis:
    """What a report of verdicts is made from.

    Parameters
    ----------
    batch_path, batch_sha256 : str
        What was analysed; of several files their common folder, and the hash over all their hashes.
    baseline_name, baseline_sha256 : str or None
        What it was compared with; None where there was no baseline.
    made : str
        When the analysis ran (ISO 8601).
    verdicts : tuple of Verdict
        One for each joint.
    records : tuple of JointRecord
        The telemetry that each verdict speaks of, in the same order, for the plots; or none.
    problems : tuple of Problem
        What was damaged, cut short or left out.
    ledgers : tuple of sequence of mapping
        For each verdict, in the same order, the joint's ledger up to this batch, in rows of `gsfdi.prognosis`; or none.
    limit : float
        Share of a joint's capability at which its maintenance is due.
    """

    batch_path: str
    batch_sha256: str
    baseline_name: str | None
    baseline_sha256: str | None
    made: str
    verdicts: tuple[Verdict, ...]
    records: tuple[JointRecord, ...] = ()
    problems: tuple[Problem, ...] = ()
    ledgers: tuple[Sequence[Mapping[str, Any]], ...] = ()
    limit: float = 0.1


class Judged(NamedTuple):
    """A verdict with the telemetry that it speaks of and the joint's ledger, as far as they are there."""

    verdict: Verdict
    record: JointRecord | None
    ledger: Sequence[Mapping[str, Any]]


def judged(analysis: Analysis) -> list[Judged]:
    """Give each verdict with what belongs to it."""
    count = len(analysis.verdicts)
    ledgers = analysis.ledgers or ((),) * count
    rows = zip(analysis.verdicts, analysis.records or (None,) * count, ledgers, strict=True)
    return [Judged(*row) for row in rows]


def storable(text: str) -> str:
    r"""Escape what UTF-8 cannot hold: file names that are not text come with lone surrogates.

    Examples
    --------
    >>> storable("night\udcff.mcap")
    'night\\udcff.mcap'
    """
    return text.encode("utf-8", "backslashreplace").decode()


@dataclass(frozen=True, slots=True)
class Report:
    """A form that an analysis can be written in.

    Parameters
    ----------
    name : str
        What the configuration calls it.
    filename : str
        The file it is written to.
    write : callable
        Turns an `Analysis` into the file's text.
    """

    name: str
    filename: str
    write: Callable[[Analysis], str]
