"""From findings to a verdict: which fault, how sure, how bad, since when, and what else it could be.

``assess(record, joint_baseline, ...)`` is the one entry. It takes a record, or successive pieces of a long one, and
gives a `Verdict` whose ``findings`` carry what a page draws. Their ``evidence``, by ``Finding.detector``:

``signals``
    ``t, setpoint, position, effort`` (and ``velocity``, ``tracking``) : arrays of at most 1500 points [s, SI];
    ``features`` : list of str; ``scores`` : array, deviations of each from the baseline; ``threshold`` : float;
    ``feature`` : str, the one that stands out most.
``parity``
    ``t, residual`` : arrays, running statistic of the long window; ``threshold`` : float; ``t3, residual3,
    threshold3`` : the same for the paper's three samples.
``innovations``
    ``t, residual`` : arrays, running lean towards the most likely fault in deviations; ``threshold`` : float;
    ``names`` : list of str; ``z, size, error, onset, ramp, gain, robust`` : arrays, one value per direction.
``smi``
    ``t, angles`` : arrays, largest principal angle to the baseline [rad] by block; ``threshold`` : float [rad];
    ``markov`` : array, deviations of the Markov parameters by block; ``markov_threshold`` : float.
``diagnosis``
    ``names, probabilities, sizes, errors, units, cosines`` : lists over the candidate faults, most probable first;
    ``severity`` : float, share of the joint's usual drive that the fault takes.

Every finding has ``onset_s`` where it saw one. Levels: a fault whose test alarms is a warning; it is distress, then
critical, when the share of the joint's capability that it takes reaches the limits in `Limits`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from gsfdi.baseline import JointBaseline, detectors, gather
from gsfdi.clock import LEFT_OUT
from gsfdi.detectors import Numbers
from gsfdi.detectors.innovations import cleaned, first_bins
from gsfdi.directions import Direction, grouped, library
from gsfdi.types import Action, Array, Due, Finding, JointRecord, Level, Verdict

NO_LEDGER = Due(None, None, "judged by itself; the ledger of earlier batches says when")
"""Until `gsfdi.prognosis.due` has read the ledger."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Where a fault becomes serious, and how often the whole battery may be wrong.

    Parameters
    ----------
    distress, critical : float
        Share of the joint's capability that a fault takes: the change of a ratio, else the effect in terms of torque.
    false_alarms_per_joint_year : float
        Promised rate of verdicts above ``normal`` on fault-free telemetry.
    batches_per_year : float
        How often a joint is judged.
    stale_after_s : float
        Age beyond which telemetry is called stale, when the caller says what time it is.
    payload_free : bool
        Whether the output inertia may change without being a fault (a payload was taken).
    """

    distress: float = 0.10
    critical: float = 0.30
    false_alarms_per_joint_year: float = 0.1
    batches_per_year: float = 365.0
    stale_after_s: float = 3.0 * 86400.0
    payload_free: bool = False
    shares: Mapping[str, float] = field(default_factory=dict)

    @property
    def per_batch(self) -> float:
        """False-alarm rate of one verdict."""
        return self.false_alarms_per_joint_year / self.batches_per_year


class Candidate(NamedTuple):
    """A fault that could explain the batch."""

    direction: Direction
    probability: float
    size: float
    error: float
    onset: float
    ramp: bool
    gain: float
    cosine: float


RARE: Mapping[str, float] = {
    "motor_inertia_change": 0.05, "magnetic_saturation": 0.1, "end_stop": 0.2,
    "quadratic_friction": 0.2, "stiffening": 0.2, "gearbox_damping": 0.1, "current_bias": 0.5, "gravity_unbalance": 0.5,
    "actuation_delay": 0.3, "position_dependent_friction": 0.5, "asymmetric_friction": 0.5, "cable_harness": 0.5,
    "torque_ripple": 0.5, "cogging": 0.5,
}  # fmt: skip
"""How much less often than the others a fault is met, where experience says so."""
TWINS: Mapping[str, tuple[str, ...]] = {
    "torque_constant_change": ("current_gain",),
    "torque_constant_drift": ("current_gain",),
    "constant_load": ("current_bias", "asymmetric_friction"),
    "current_bias": ("constant_load", "asymmetric_friction"),
    "coulomb_friction": ("presliding_friction",),
    "actuation_delay": ("timestamp_latency",),
}
"""Faults that leave the same trace in these channels, whatever the motion."""
SURE = 30.0
"""Independent pieces of evidence that a batch is taken to hold, however many its samples."""
ROUGH = 1e-3
"""Share of a fault's effect that its direction, true to first order, may get wrong."""
EXPLAINED = 0.3
"""Share of what the batch shows beyond its baseline that a single fault must explain to be named."""
LIKELY = 0.25
"""Probability below which a fault is not named."""


def assess(
    record: JointRecord | Iterable[JointRecord],
    baseline: JointBaseline | None,
    *,
    limits: Limits | None = None,
    settings: Mapping[str, Mapping[str, float]] | None = None,
    now_ns: int | None = None,
    explain: Callable[[], Mapping[str, object] | None] | None = None,
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
    limits = limits or Limits()
    pieces = [record] if isinstance(record, JointRecord) else record
    seen = _Look(baseline.nominal.channels if baseline is not None else ())
    kept = list(seen.through(pieces)) if baseline is None else None
    joint = seen.joint if kept is not None else ""
    if baseline is None:
        return unjudged(joint, "not_assessed", "no baseline was learnt for this joint; run gsfdi baseline first")
    missing: list[str] = []

    def usable() -> Iterable[JointRecord]:
        for piece in seen.through(pieces):
            lacking = [name for name in baseline.nominal.channels if name not in piece]
            if lacking:
                missing.extend(name for name in lacking if name not in missing)
            else:
                yield piece

    numbers, seconds = gather(usable(), baseline.nominal, settings, float(baseline.learnt["innovations"]["energy"][0]))
    joint = seen.joint or baseline.joint
    refusal = _refusal(seen, missing, seconds, numbers, baseline, limits, now_ns)
    if refusal is not None:
        return replace(refusal, joint=joint)
    findings = _findings(numbers, baseline, limits, settings, joint)
    matched = next((one for one in findings if one.detector == "innovations"), None)
    bins: Numbers = numbers["innovations"]
    span = float(len(bins["g"]) * bins["width"][0])
    if matched is not None:
        bins = first_bins(bins, int(matched.evidence["judged_bins"]))  # type: ignore[call-overload]
    candidates = _candidates(matched, bins, baseline, limits) if matched is not None else []
    case = _Case(joint, findings, candidates, bins, span, baseline, limits)
    return _verdict(case, explain)


class _Look:
    """What passes by: names, time and how much of it may be believed."""

    def __init__(self, needs: Sequence[str] = ()) -> None:
        self.joint, self.t0_ns, self.end_ns = "", 0, 0
        self.samples, self.believed = Counter[str](), Counter[str]()
        self.needs = needs

    @property
    def share(self) -> float:
        """How much of the worst channel that a verdict needs may be believed, rows without a time counted in."""
        return min((self.believed[name] / rows for name, rows in self.samples.items() if rows), default=1.0)

    def through(self, pieces: Iterable[JointRecord]) -> Iterable[JointRecord]:
        for piece in pieces:
            self.joint = piece.joint
            self.t0_ns = self.t0_ns or piece.t0_ns
            if len(piece.t):
                self.end_ns = piece.t0_ns + round(float(piece.t[-1]) * 1e9)
            clock = piece.quality.get("time", {})
            lost = round(sum(clock.get(kind, 0.0) for kind in LEFT_OUT))
            for name in {"position", piece.effort, *self.needs} & set(piece.channels):
                self.samples[name] += _rows(piece.channels[name]) + lost
                self.believed[name] += int(np.isfinite(piece[name]).sum())
            yield piece


def _rows(values: Array) -> int:
    """How many samples a channel should have: a slower one leaves even holes, samples lost leave uneven ones."""
    steps = np.diff(np.flatnonzero(~np.isnan(values)))
    even = len(steps) > 0 and float(np.mean(steps == np.median(steps))) > 0.8
    return len(steps) + 1 if even else len(values)


def unjudged(joint: str, level: Level, says: str) -> Verdict:
    """A verdict for what could not be assessed, with the reason."""
    action: Action = "check_telemetry" if level in ("invalid_data", "stale") else "none"
    methods = {family: {"alarm": None, "p_value": None} for family in ("signal", "parity", "smi")}
    return Verdict(joint, level, action, None, None, None, (), None, methods, Due(None, None, says), says)


def _refusal(
    seen: _Look, missing: Sequence[str], seconds: float, numbers: Mapping[str, Mapping[str, Array]],
    baseline: JointBaseline, limits: Limits, now_ns: int | None,
) -> Verdict | None:  # fmt: skip
    """Why this batch cannot be judged, or None when it can."""
    if now_ns is not None and seen.end_ns and (now_ns - seen.end_ns) * 1e-9 > limits.stale_after_s:
        days = (now_ns - seen.end_ns) / 8.64e13
        return unjudged("", "stale", f"the telemetry ends {days:.1f} days ago; nothing newer to judge by")
    if missing:
        return unjudged("", "not_assessed", f"the batch lacks {', '.join(missing)}, which the baseline was learnt with")
    if seen.share < 0.5:
        lost = 100.0 * (1.0 - seen.share)
        return unjudged("", "invalid_data", f"{lost:.0f} % of the samples cannot be believed; check the telemetry")
    if seconds < 3.0:
        return unjudged("", "not_assessed", f"only {seconds:.1f} s of usable telemetry; at least 3 s are needed")
    h = numbers["innovations"]["h"].sum(axis=0)
    names = [one.key for one in _library(baseline)]
    key = "torque_constant_change"
    error = float(
        np.sqrt(baseline.learnt["innovations"]["within"][names.index(key)] / max(h[names.index(key)], 1e-300))
    )
    if error > 0.1:
        return unjudged(
            "", "not_assessed",
            "too little excitation: the joint hardly moved, and a loss of torque below "
            f"{min(100.0 * 4 * error, 999):.0f} % could not have been seen",
        )  # fmt: skip
    return None


def _library(baseline: JointBaseline) -> tuple[Direction, ...]:
    return library(baseline.nominal.flexible, bool(baseline.nominal.velocity), temperature=False)


def _findings(
    numbers: Mapping[str, Mapping[str, Array]], baseline: JointBaseline, limits: Limits,
    settings: Mapping[str, Mapping[str, float]] | None, joint: str,
) -> list[Finding]:  # fmt: skip
    """Look with every detector; the promised rate is shared out among them."""
    found = []
    battery = detectors()
    whole = sum(one.false_alarm_rate for one in battery.values())
    for name, one in battery.items():
        if name not in baseline.learnt or not numbers.get(name):
            continue
        rate = limits.per_batch * one.false_alarm_rate / whole
        finding = one.look(
            numbers[name], baseline.learnt[name], rate, {**one.settings, **((settings or {}).get(name) or {})}
        )
        if finding is not None:
            found.append(replace(finding, joint=joint))
    return found


def _candidates(
    found: Finding, numbers: Mapping[str, Array], baseline: JointBaseline, limits: Limits
) -> list[Candidate]:
    """Faults by how much of the innovations each explains."""
    evidence, directions = found.evidence, _library(baseline)
    names = evidence["names"]
    assert isinstance(names, list)
    columns = {key: np.asarray(evidence[key]) for key in ("gain", "size", "error", "onset", "ramp")}
    first = {name: members[0] for name, members in grouped(directions)}
    cosines = _cosines(numbers, baseline)
    best: dict[str, Candidate] = {}
    for i, name in enumerate(names):
        direction = directions[first[name]]
        if limits.payload_free and direction.fault == "output_inertia_change":
            continue
        gain, size, error, onset, ramp = (float(columns[key][i]) for key in ("gain", "size", "error", "onset", "ramp"))
        got = Candidate(direction, 0.0, size, error, onset, bool(ramp), gain, float(cosines[first[name]]))
        if direction.fault not in best or gain > best[direction.fault].gain:
            best[direction.fault] = got
    ranked = sorted(best.values(), key=lambda one: -one.gain)
    top = ranked[0].gain
    # What the best leaves unexplained says how far the model can be trusted; a gain below that decides little.
    left = max(_excess(numbers, baseline) - top, 0.0) + ROUGH * top + SURE
    pooled = max(float(baseline.learnt["innovations"]["pooled"][0]), 1.0)
    short = np.array([top - one.gain for one in ranked])
    weights = np.exp(-np.minimum(0.5 * short / pooled, 0.5 * SURE * np.log1p(short / left)))
    weights *= np.array([RARE.get(one.direction.fault, 1.0) for one in ranked])
    weights /= weights.sum()
    ranked = [one._replace(probability=float(w)) for one, w in zip(ranked, weights, strict=True)]
    return sorted(ranked, key=lambda one: -one.probability)


def _cosines(numbers: Mapping[str, Array], baseline: JointBaseline) -> Array:
    """Cosine of the batch's fingerprint with that of each known failure, as the model foretells it in this motion."""
    learnt, H = baseline.learnt["innovations"], numbers["H"]
    h = np.maximum(np.diag(H), 1e-300)
    g = cleaned(numbers, learnt["lean"], learnt["drift"]).sum(axis=0)
    batch, known = g / np.sqrt(h), H / np.sqrt(h)[:, None]
    return np.asarray(np.abs(batch @ known) / np.maximum(np.linalg.norm(batch) * np.linalg.norm(known, axis=0), 1e-300))


def _explains(best: Candidate, numbers: Mapping[str, Array], baseline: JointBaseline) -> bool:
    """Whether one fault is likely enough, and accounts for enough of what the batch shows beyond its baseline."""
    return best.probability >= LIKELY and best.gain >= EXPLAINED * _excess(numbers, baseline)


def _excess(numbers: Mapping[str, Array], baseline: JointBaseline) -> float:
    """Weighted squares of the innovations beyond those of a fault-free batch as long."""
    energy = numbers["energy"].sum(axis=0)
    return float(energy[0] - energy[1] * baseline.learnt["innovations"]["energy"][0])


def _severity(best: Candidate, baseline: JointBaseline, numbers: Mapping[str, Array], span: float) -> float:
    """Share of the joint's capability that the fault takes by the end of the batch."""
    if best.direction.neutral == 1.0:
        return abs(best.size) * (max(span - best.onset, 0.0) if best.ramp else 1.0)
    names = [one.key for one in _library(baseline)]
    j = names.index("torque_constant_change")
    return float(np.sqrt(best.gain / max(float(numbers["h"][:, j].sum()), 1e-300)))


def _stands(best: Candidate, findings: Sequence[Finding]) -> bool:
    """Whether the fault's own size is as sure as an alarm must be; what another lean alarmed is not serious for it."""
    limit = next((one.threshold for one in findings if one.detector == "innovations"), np.inf)
    return abs(best.size) >= limit * best.error


class _Case(NamedTuple):
    """Everything that a verdict on one joint is made of."""

    joint: str
    findings: list[Finding]
    candidates: list[Candidate]
    innovations: Mapping[str, Array]
    span: float
    baseline: JointBaseline
    limits: Limits


def _verdict(case: _Case, explain: Callable[[], Mapping[str, object] | None] | None) -> Verdict:
    methods = _methods(case.findings)
    alarmed = [one for one in case.findings if one.alarm]
    if not alarmed:
        says = f"{case.joint} behaves as its baseline does."
        return Verdict(
            case.joint, "normal", "none", None, None, None, (), None, methods, NO_LEDGER, says, tuple(case.findings)
        )
    matched = next((one for one in case.findings if one.detector == "innovations"), None)
    if matched is None or not matched.alarm or not _explains(case.candidates[0], case.innovations, case.baseline):
        return _unexplained(case, methods, min(alarmed, key=lambda one: one.p_value), explain() if explain else None)
    return _named(case, methods)


def _unexplained(
    case: _Case, methods: Mapping[str, Mapping[str, object]], first: Finding, found: Mapping[str, object] | None
) -> Verdict:
    """A departure that no single fault of the library accounts for, with what a reconciliation made of it."""
    why, fault, component, probability = "no single known fault explains it", None, None, None
    if found is not None:
        why, fault, component = str(found["says"]).rstrip("."), str(found["term"]), found["component"]
        probability = found.get("probability")
    says = f"{case.joint} departs from its baseline: {first.sentence}; {why}."
    return Verdict(case.joint, "warning", "inspect", component, fault, probability, (), first.onset_s,  # type: ignore[arg-type]
                   methods, NO_LEDGER, says, tuple(case.findings))  # fmt: skip


def _named(case: _Case, methods: Mapping[str, Mapping[str, object]]) -> Verdict:
    """A departure that one fault of the library explains."""
    best, limits = case.candidates[0], case.limits
    span = case.span
    severity = _severity(best, case.baseline, case.innovations, span)
    level: Level = (
        "critical" if severity >= limits.critical else "distress" if severity >= limits.distress else "warning"
    )
    if not _stands(best, case.findings):
        level = "warning"
    actions: dict[Level, Action] = {"critical": "stop_using", "distress": "plan_maintenance", "warning": "inspect"}
    fault, alternatives = fault_name(best), _alternatives(case.candidates)
    findings = (*case.findings, _diagnosed(case.joint, case.candidates, severity, best))
    onset = best.onset if best.onset > 0.02 * span else 0.0
    return Verdict(
        case.joint, level, actions[level], best.direction.component, fault, best.probability, alternatives, onset,
        methods, NO_LEDGER, _says(case.joint, best, fault, alternatives), findings,
    )  # fmt: skip


def fault_name(one: Candidate) -> str:
    """The contract's id; a torque constant that changes steadily is a drift."""
    return (
        "torque_constant_drift" if one.ramp and one.direction.fault == "torque_constant_change" else one.direction.fault
    )


def _alternatives(candidates: Sequence[Candidate]) -> tuple[Mapping[str, object], ...]:
    """What the data cannot exclude: the next most probable, and what no such data could tell apart."""
    best = candidates[0]
    near = [
        {"fault": fault_name(one), "component": one.direction.component, "probability": round(one.probability, 4)}
        for one in candidates[1:6] if one.probability > 0.02
    ]  # fmt: skip
    named = {fault_name(best), *(one["fault"] for one in near)}
    twins = [{"fault": twin, "component": None, "probability": None, "why": "leaves the same trace in these channels"}
             for twin in TWINS.get(fault_name(best), ()) if twin not in named]  # fmt: skip
    return (*near, *twins)


def _methods(findings: Sequence[Finding]) -> dict[str, Mapping[str, object]]:
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


def _diagnosed(joint: str, candidates: Sequence[Candidate], severity: float, best: Candidate) -> Finding:
    some = candidates[:8]
    return Finding(
        "diagnosis", "diagnosis", joint, True, 1.0 - best.probability, best.probability, 0.5, "probability",
        f"{fault_name(best)} explains most", best.onset,
        {"names": [fault_name(one) for one in some], "probabilities": [one.probability for one in some],
         "sizes": [one.size for one in some], "errors": [one.error for one in some],
         "units": [one.direction.unit for one in some], "cosines": [one.cosine for one in some], "severity": severity},
    )  # fmt: skip


def _says(joint: str, best: Candidate, fault: str, alternatives: Sequence[Mapping[str, object]]) -> str:
    """One sentence for a person."""
    one = best.direction
    value = one.neutral + best.size if not best.ramp else best.size
    what = f"{one.parameter} {value:.4g} ± {2 * best.error:.2g}{' ' + one.unit if one.unit else ''}"
    if best.ramp:
        what = (
            f"{100 * best.size:+.3g} % per second" if one.neutral == 1.0 else f"{best.size:.3g} {one.unit} per second"
        )
    since = f" since {best.onset:.1f} s" if best.onset > 1.0 else " throughout the batch"
    other = ", ".join(str(a["fault"]) for a in alternatives)
    tail = f"; cannot be told from {other}" if other else ""
    return f"{joint}: {fault.replace('_', ' ')} ({what}){since}{tail}."
