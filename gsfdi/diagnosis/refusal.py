"""Why a batch cannot be judged; what could not be assessed is never called normal."""

from collections.abc import Mapping

import numpy as np

from gsfdi.baseline import JointBaseline
from gsfdi.detectors import Numbers
from gsfdi.diagnosis.candidates import directions_of
from gsfdi.diagnosis.limits import Limits
from gsfdi.diagnosis.look import Look
from gsfdi.types import Action, Due, Level, Verdict

LEAST_SHARE = 0.5
"""Share of the samples that must be believed."""
LEAST_SECONDS = 3.0
"""Usable telemetry that a verdict needs [s]."""
LEAST_EXCITED = 0.1
"""Standard error of the torque constant's ratio beyond which the joint hardly moved."""


def unjudged(joint: str, level: Level, why: str) -> Verdict:
    """A verdict for what could not be assessed, with the reason."""
    action: Action = "check_telemetry" if level in ("invalid_data", "stale") else "none"
    methods = {family: {"alarm": None, "p_value": None} for family in ("signal", "parity", "smi")}
    says = f"{joint}: {why}" if joint else why
    return Verdict(joint, level, action, None, None, None, (), None, methods, Due(None, None, why), says)


def refusal(
    seen: Look, seconds: float, numbers: Mapping[str, Numbers], baseline: JointBaseline, limits: Limits,
    now_ns: int | None,
) -> tuple[Level, str] | None:  # fmt: skip
    """Why this batch cannot be judged, or None when it can."""
    if now_ns is not None and seen.end_ns and (now_ns - seen.end_ns) * 1e-9 > limits.stale_after_s:
        days = (now_ns - seen.end_ns) / 8.64e13
        return "stale", f"the telemetry ends {days:.1f} days ago; nothing newer to judge by"
    if seen.missing:
        return "not_assessed", f"the batch lacks {', '.join(seen.missing)}, which the baseline was learnt with"
    if seen.share < LEAST_SHARE:
        lost = 100.0 * (1.0 - seen.share)
        return "invalid_data", f"{lost:.0f} % of the samples cannot be believed; check the telemetry"
    if seconds < LEAST_SECONDS:
        return "not_assessed", f"only {seconds:.1f} s of usable telemetry; at least {LEAST_SECONDS:.0f} s are needed"
    error = loss_error(numbers["innovations"], baseline)
    if error > LEAST_EXCITED:
        unseen = f"a loss of torque below {min(100.0 * 4 * error, 999):.0f} % could not have been seen"
        return "not_assessed", f"too little excitation: the joint hardly moved, and {unseen}"
    return None


def loss_error(numbers: Numbers, baseline: JointBaseline) -> float:
    """Standard error with which this motion shows the torque constant's ratio."""
    j = [one.key for one in directions_of(baseline)].index("torque_constant_change")
    energy = numbers["h"].sum(axis=0)[j]
    return float(np.sqrt(baseline.learnt["innovations"]["within"][j] / max(energy, 1e-300)))
