"""The verdict on a case, in the contract's fields and in one sentence for a person."""

from collections.abc import Callable, Mapping, Sequence

from gsfdi.diagnosis.candidates import Candidate
from gsfdi.diagnosis.case import Case
from gsfdi.types import Action, Due, Finding, Level, Verdict

NO_LEDGER = Due(None, None, "judged by itself; the ledger of earlier batches says when")
"""Until `gsfdi.prognosis.due` has read the ledger."""


TWINS: Mapping[str, tuple[str, ...]] = {
    "torque_constant_change": ("current_gain",),
    "torque_constant_drift": ("current_gain",),
    "constant_load": ("current_bias", "asymmetric_friction"),
    "current_bias": ("constant_load", "asymmetric_friction"),
    "coulomb_friction": ("presliding_friction",),
    "actuation_delay": ("timestamp_latency",),
}
"""Faults that leave the same trace in these channels, whatever the motion."""
ACTIONS: Mapping[Level, Action] = {"critical": "stop_using", "distress": "plan_maintenance", "warning": "inspect"}
"""What a fault of each level asks for."""
Explain = Callable[[], Mapping[str, object] | None]
"""Looks for physics that no fault of the library stands for: ``term``, ``component``, ``probability``, ``says``."""


def verdict_on(case: Case, explain: Explain | None) -> Verdict:
    """Decide; `explain` is called when no fault of the library explains an alarm."""
    alarmed = [one for one in case.findings if one.alarm]
    if not alarmed:
        return normal(case)
    if case.is_explained:
        return named(case)
    return unexplained(case, min(alarmed, key=lambda one: one.p_value), explain() if explain else None)


def normal(case: Case) -> Verdict:
    """No departure."""
    says, methods = f"{case.joint} behaves as its baseline does.", methods_of(case.findings)
    return Verdict(case.joint, "normal", "none", None, None, None, (), None, methods, NO_LEDGER, says, case.findings)


def unexplained(case: Case, first: Finding, found: Mapping[str, object] | None) -> Verdict:
    """A departure that no single fault of the library accounts for, with what a reconciliation made of it."""
    why, fault, component, probability = "no single known fault explains it", None, None, None
    if found is not None:
        why, fault, component = str(found["says"]).rstrip("."), str(found["term"]), found["component"]
        probability = found.get("probability")
    says = f"{case.joint} departs from its baseline: {first.sentence}; {why}."
    return Verdict(case.joint, "warning", "inspect", component, fault, probability, (), first.onset_s,  # type: ignore[arg-type]
                   methods_of(case.findings), NO_LEDGER, says, case.findings)  # fmt: skip


def named(case: Case) -> Verdict:
    """A departure that one fault of the library explains."""
    best, alternatives = case.candidates[0], alternatives_of(case.candidates)
    onset = best.onset if best.onset > 0.02 * case.span else 0.0
    return Verdict(
        case.joint, case.level, ACTIONS[case.level], best.direction.component, best.fault, best.probability,
        alternatives, onset, methods_of(case.findings), NO_LEDGER, sentence(case.joint, best, alternatives),
        (*case.findings, finding_of(case)),
    )  # fmt: skip


def alternatives_of(candidates: Sequence[Candidate]) -> tuple[Mapping[str, object], ...]:
    """What the data cannot exclude: the next most probable, and what no such data could tell apart."""
    best = candidates[0]
    near = [
        {"fault": one.fault, "component": one.direction.component, "probability": round(one.probability, 4)}
        for one in candidates[1:6]
        if one.probability > 0.02
    ]
    named = {best.fault, *(one["fault"] for one in near)}
    twins = [
        {"fault": twin, "component": None, "probability": None, "why": "leaves the same trace in these channels"}
        for twin in TWINS.get(best.fault, ())
        if twin not in named
    ]
    return (*near, *twins)


def methods_of(findings: Sequence[Finding]) -> dict[str, Mapping[str, object]]:
    """One entry per family: an alarm of any of its detectors, and their smallest p-value with its price."""
    methods: dict[str, Mapping[str, object]] = {}
    for family in ("signal", "parity", "smi"):
        some = [one for one in findings if one.method == family]
        if some:
            p = min(1.0, len(some) * min(one.p_value for one in some))
            methods[family] = {"alarm": any(one.alarm for one in some), "p_value": p}
        else:
            methods[family] = {"alarm": False, "p_value": None}
    return methods


def finding_of(case: Case) -> Finding:
    """The diagnosis itself as a finding, for a page to draw."""
    best, some = case.candidates[0], case.candidates[:8]
    return Finding(
        "diagnosis", "diagnosis", case.joint, True, 1.0 - best.probability, best.probability, 0.5, "probability",
        f"{best.fault} explains most", best.onset,
        {"names": [one.fault for one in some], "probabilities": [one.probability for one in some],
         "sizes": [one.size for one in some], "errors": [one.error for one in some],
         "units": [one.direction.unit for one in some], "cosines": [one.cosine for one in some],
         "severity": case.severity},
    )  # fmt: skip


def sentence(joint: str, best: Candidate, alternatives: Sequence[Mapping[str, object]]) -> str:
    """One sentence for a person."""
    one = best.direction
    if best.ramp and one.neutral == 1.0:
        what = f"{100 * best.size:+.3g} % per second"
    elif best.ramp:
        what = f"{best.size:.3g} {one.unit} per second"
    else:
        unit = f" {one.unit}" if one.unit else ""
        what = f"{one.parameter} {one.neutral + best.size:.4g} ± {2 * best.error:.2g}{unit}"
    since = f" since {best.onset:.1f} s" if best.onset > 1.0 else " throughout the batch"
    other = ", ".join(str(a["fault"]) for a in alternatives)
    tail = f"; cannot be told from {other}" if other else ""
    return f"{joint}: {best.fault.replace('_', ' ')} ({what}){since}{tail}."
