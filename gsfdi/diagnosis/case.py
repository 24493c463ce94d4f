"""One joint's case: what was seen of it, what could explain it, and how much that weighs."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gsfdi.baseline import JointBaseline
from gsfdi.detectors import Numbers
from gsfdi.detectors.innovations import first_bins
from gsfdi.diagnosis.candidates import Candidate, candidates_of, directions_of, excess
from gsfdi.diagnosis.limits import Limits
from gsfdi.types import Finding, Level

EXPLAINED = 0.3
"""Share of what the batch shows beyond its baseline that a single fault must explain to be named."""
LIKELY = 0.25
"""Probability below which a fault is not named."""


class Case(NamedTuple):
    """Everything that a verdict on one joint is made of; `span` is the batch's length [s]."""

    joint: str
    findings: tuple[Finding, ...]
    candidates: Sequence[Candidate]
    innovations: Numbers
    span: float
    baseline: JointBaseline
    limits: Limits

    @property
    def lean(self) -> Finding | None:
        """What the innovations lean towards, where they were looked at."""
        return lean_of(self.findings)

    @property
    def is_explained(self) -> bool:
        """Whether one fault alarms, is likely enough, is more than its error, and accounts for enough of the batch."""
        lean = self.lean
        if lean is None or not lean.alarm:
            return False
        best = self.candidates[0]
        if abs(best.size) < 2.0 * best.error:  # what would be named "1 ± 2" is no name
            return False
        return best.probability >= LIKELY and best.gain >= EXPLAINED * excess(self.innovations, self.baseline)

    @property
    def severity(self) -> float:
        """Share of the joint's capability that the likeliest fault takes by the end of the batch."""
        best = self.candidates[0]
        if best.direction.neutral == 1.0:
            return abs(best.size) * (max(self.span - best.onset, 0.0) if best.ramp else 1.0)
        j = [one.key for one in directions_of(self.baseline)].index("torque_constant_change")
        return float(np.sqrt(best.gain / max(float(self.innovations["h"][:, j].sum()), 1e-300)))

    @property
    def level(self) -> Level:
        """How serious the likeliest fault is.

        Only what is as sure of its own size as an alarm must be is more than a warning: another lean may have alarmed.
        """
        best, lean = self.candidates[0], self.lean
        if abs(best.size) < (lean.threshold if lean else np.inf) * best.error:
            return "warning"
        if self.severity >= self.limits.critical:
            return "critical"
        return "distress" if self.severity >= self.limits.distress else "warning"


def case_of(
    joint: str, findings: Sequence[Finding], innovations: Numbers, baseline: JointBaseline, limits: Limits
) -> Case:
    """Look for what could explain the findings on a joint."""
    span = float(len(innovations["g"]) * innovations["width"][0])
    lean, candidates = lean_of(findings), list[Candidate]()
    if lean is not None:
        innovations = first_bins(innovations, int(lean.evidence["judged_bins"]))  # type: ignore[call-overload]
        candidates = candidates_of(lean, innovations, baseline, limits.payload_free)
    return Case(joint, tuple(findings), candidates, innovations, span, baseline, limits)


def lean_of(findings: Sequence[Finding]) -> Finding | None:
    """What the innovations lean towards, where they were looked at."""
    return next((one for one in findings if one.detector == "innovations"), None)
