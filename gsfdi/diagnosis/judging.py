"""One joint's batch against its baseline: look at it, find what departs, decide."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from gsfdi.baseline import Gathering, JointBaseline, detectors
from gsfdi.detectors import Numbers
from gsfdi.diagnosis.case import case_of
from gsfdi.diagnosis.limits import Limits
from gsfdi.diagnosis.look import Look
from gsfdi.diagnosis.refusal import refusal, unjudged
from gsfdi.diagnosis.verdict import Explain, verdict_on
from gsfdi.types import Finding, JointRecord, Verdict

Settings = Mapping[str, Mapping[str, float]]
"""Changed knobs by detector."""


class Judging:
    """One joint's batch on its way to a verdict: pieces go in as they come, none is kept.

    Parameters
    ----------
    baseline : JointBaseline
        What the fault-free joint does.
    limits : Limits, optional
    settings : mapping, optional
        Changed knobs by detector.
    """

    def __init__(
        self, baseline: JointBaseline, *, limits: Limits | None = None, settings: Settings | None = None
    ) -> None:
        self._baseline, self._limits, self._settings = baseline, limits or Limits(), settings or {}
        self._seen = Look(baseline.nominal.channels)
        self._gathered = Gathering(baseline.nominal, settings, float(baseline.learnt["innovations"]["energy"][0]))

    def add(self, piece: JointRecord) -> None:
        """Take in one more piece.

        Parameters
        ----------
        piece : JointRecord
            Later than all before it.
        """
        if self._seen.take(piece):
            self._gathered.add(piece)

    def verdict(self, *, now_ns: int | None = None, explain: Explain | None = None) -> Verdict:
        """Judge what came.

        Parameters
        ----------
        now_ns, explain
            As for `assess`.
        """
        baseline, limits = self._baseline, self._limits
        numbers, joint = self._gathered.numbers(), self._seen.joint or baseline.joint
        why = refusal(self._seen, self._gathered.seconds, numbers, baseline, limits, now_ns)
        if why is not None:
            return unjudged(joint, *why)
        findings = findings_of(numbers, baseline, limits.per_batch, self._settings, joint)
        return verdict_on(case_of(joint, findings, numbers["innovations"], baseline, limits), explain)


def assess(
    record: JointRecord | Iterable[JointRecord],
    baseline: JointBaseline | None,
    *,
    limits: Limits | None = None,
    settings: Settings | None = None,
    now_ns: int | None = None,
    explain: Explain | None = None,
) -> Verdict:
    """Judge one joint's batch.

    Parameters
    ----------
    record : JointRecord or iterable of JointRecord
        The batch, or its successive pieces.
    baseline : JointBaseline or None
        What the fault-free joint does; None gives ``not_assessed``.
    limits : Limits, optional
    settings : mapping, optional
        Changed knobs by detector.
    now_ns : int, optional
        The time [ns, UTC]; telemetry much older than it is ``stale``.
    explain : callable, optional
        Called when no fault of the library explains an alarm; gives the ``omitted_physics`` entry of a
        reconciliation (``term``, ``component``, ``probability``, ``says``), or None.
    """
    pieces = [record] if isinstance(record, JointRecord) else record
    if baseline is None:
        joint = ""
        for piece in pieces:
            joint = piece.joint
        return unjudged(joint, "not_assessed", "no baseline was learnt for this joint; run gsfdi baseline first")
    judging = Judging(baseline, limits=limits, settings=settings)
    for piece in pieces:
        judging.add(piece)
    return judging.verdict(now_ns=now_ns, explain=explain)


def findings_of(
    numbers: Mapping[str, Numbers], baseline: JointBaseline, rate: float, settings: Settings, joint: str
) -> list[Finding]:
    """Look with every detector; the promised false-alarm `rate` is shared out among them."""
    found = []
    battery = detectors()
    whole = sum(one.false_alarm_rate for one in battery.values())
    for name, one in battery.items():
        if name not in baseline.learnt or not numbers.get(name):
            continue
        share = rate * one.false_alarm_rate / whole
        finding = one.look(numbers[name], baseline.learnt[name], share, {**one.settings, **(settings.get(name) or {})})
        if finding is not None:
            found.append(replace(finding, joint=joint))
    return found
