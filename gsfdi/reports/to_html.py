"""``report.html``: the verdicts at a glance, worst first, and below them the plots that carry each."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from gsfdi.reports import Analysis, Judged, Report, judged
from gsfdi.reports.page import Figure, number, plotted, render, words
from gsfdi.reports.quantities import quantity
from gsfdi.reports.trend import trend_figures
from gsfdi.reports.verdict_plots import by_weight, evidence_figures, signal_plots
from gsfdi.types import Finding, JointRecord, Level, Verdict

WORST_FIRST: tuple[Level, ...] = (
    "critical",
    "distress",
    "warning",
    "invalid_data",
    "stale",
    "not_assessed",
    "normal",
)

TELLING = 2
"""Signals that stand beside the evidence: effort and tracking error."""


@dataclass(frozen=True, slots=True)
class JointPart:
    """What the page says of one joint."""

    anchor: str
    name: str
    verdict: Verdict
    leading: list[Figure]
    further: list[Figure]
    findings: list[Finding]
    quality: list[tuple[str, str]]


def part(index: int, name: str, one: Judged, columns: int, limit: float) -> JointPart:
    """Gather what the page says of one joint; the plots of a quiet joint wait behind a click."""
    verdict, record, ledger = one
    trend = list(trend_figures(verdict, ledger, limit))
    plots = signal_plots(record, verdict.onset_s) if record is not None else {}
    signals = [plotted(plot, columns) for plot in plots.values()]
    alarms, rest = (evidence_figures(verdict, columns, alarm) for alarm in (True, False))
    quiet = verdict.verdict == "normal"
    leading = trend + alarms + ([] if quiet else signals[:TELLING])
    return JointPart(
        anchor=f"joint-{index}",
        name=name,
        verdict=verdict,
        leading=leading,
        further=rest + (signals if quiet else signals[TELLING:]),
        findings=by_weight(verdict.findings),
        quality=quality_rows(record.quality if record is not None else {}),
    )


def quality_rows(quality: Mapping[str, Mapping[str, float]]) -> list[tuple[str, str]]:
    """Write what the reading found, channel by channel; channels without a fault share the last row."""
    rows, clean = [], []
    for channel, counts in quality.items():
        found = [" ".join((name, number(count, 4), unit)).strip() for name, unit, count in counted(counts)]
        if found:
            rows.append((words(channel), ", ".join(found)))
        else:
            clean.append(words(channel))
    return [*rows, (", ".join(clean), "nothing to report")] if clean else rows


def counted(counts: Mapping[str, float]) -> Iterator[tuple[str, str, float]]:
    """Give the name, unit and value of what was found at all."""
    return ((*quantity(kind), count) for kind, count in counts.items() if count)


def recorded(records: tuple[JointRecord, ...]) -> str:
    """Say when the telemetry was recorded."""
    spans = [(record.t0_ns, record.t0_ns + round(float(record.t[-1]) * 1e9)) for record in records if record.t.size]
    if not spans:
        return ""
    start, end = min(span[0] for span in spans), max(span[1] for span in spans)
    first, last = (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=ns // 1000) for ns in (start, end))
    same_day = first.date() == last.date()
    return (
        f"{first:%Y-%m-%d %H:%M:%S} to {last:%H:%M:%S} UTC"
        if same_day
        else f"{first:%Y-%m-%d %H:%M} to {last:%Y-%m-%d %H:%M} UTC"
    )


def listed(names: Sequence[str]) -> str:
    """Write names in a row.

    Examples
    --------
    >>> listed(["SH1", "SH2", "EL"])
    'SH1, SH2 and EL'
    """
    return " and ".join([*([", ".join(names[:-1])] if names[1:] else []), names[-1]])


def joint_names(joints: Sequence[Judged]) -> list[str]:
    """Name the joints, with their robots where there are several."""
    robots = {one.record.robot for one in joints if one.record is not None}
    several = len(robots) > 1
    return [
        f"{one.record.robot} {one.verdict.joint}" if several and one.record else one.verdict.joint for one in joints
    ]


def headline(verdicts: Sequence[Verdict], joints: Sequence[str]) -> str:
    """Say in one line whether anybody must act."""
    levels = [verdict.verdict for verdict in verdicts]
    acting = [name for name, level in zip(joints, levels, strict=True) if level in ("critical", "distress", "warning")]
    unsure = [level for level in levels if level in ("invalid_data", "stale", "not_assessed")]
    if not verdicts:
        return "No joint was found in this batch"
    if acting:
        names = acting if len(acting) <= 4 else [*acting[:3], f"{len(acting) - 3} more"]
        return f"{listed(names)} {'needs' if len(acting) == 1 else 'need'} attention"
    if unsure:
        return f"No joint alarms; {len(unsure)} of {len(verdicts)} could not be assessed"
    return f"All {len(verdicts)} joints are normal" if len(verdicts) > 1 else f"{joints[0]} is normal"


def write(analysis: Analysis) -> str:
    """Write `analysis` as one self-contained page."""
    joints = sorted(judged(analysis), key=lambda one: WORST_FIRST.index(one.verdict.verdict))
    verdicts = [one.verdict for one in joints]
    names = joint_names(joints)
    # A page stays under 2 MB however many joints it shows: the more there are, the fewer points each curve keeps.
    columns = max(60, min(260, 4000 // max(len(verdicts), 1)))
    counts = Counter(verdict.verdict for verdict in verdicts)
    return render(
        "verdicts.html",
        {
            "headline": headline(verdicts, names),
            "tally": [(level, counts[level]) for level in WORST_FIRST if counts[level]],
            "joints": [part(i, names[i], one, columns, analysis.limit) for i, one in enumerate(joints)],
            "robots": ", ".join(sorted({record.robot for record in analysis.records if record.robot})),
            "recorded": recorded(analysis.records),
            "problems": analysis.problems,
            "made": analysis.made,
            "batch_path": analysis.batch_path,
            "batch_sha256": analysis.batch_sha256,
            "baseline_name": analysis.baseline_name,
            "baseline_sha256": analysis.baseline_sha256,
        },
    )


REPORT = Report("html", "report.html", write)
