"""``verdicts.prom``: gauges for the textfile collector of Prometheus' node exporter, so that an alert can be raised."""

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import get_args

from gsfdi.reports import Analysis, Report, judged, storable
from gsfdi.types import JointRecord, Level, Verdict


def label(value: object) -> str:
    r"""Write a label's value in quotes.

    Examples
    --------
    >>> label('a "b"\n')
    '"a \\"b\\"\\n"'
    """
    text = str(value).replace("\\", r"\\").replace('"', r"\"").replace("\n", r"\n")
    return f'"{text}"'


def joint_label(verdict: Verdict, record: JointRecord | None) -> str:
    """Name the robot and joint that a gauge speaks of."""
    return f"robot={label(record.robot if record is not None else '')},joint={label(verdict.joint)}"


def gauges(analysis: Analysis) -> Iterator[str]:
    """Give the lines of the file."""
    yield "# HELP gsfdi_joint_verdict Whether this is the joint's verdict."
    yield "# TYPE gsfdi_joint_verdict gauge"
    for verdict, record, _ in judged(analysis):
        for level in get_args(Level):
            names = f"{joint_label(verdict, record)},verdict={label(level)}"
            yield f"gsfdi_joint_verdict{{{names}}} {verdict.verdict == level:d}"
    yield "# HELP gsfdi_joint_fault_probability Probability of the fault that is named."
    yield "# TYPE gsfdi_joint_fault_probability gauge"
    for verdict, record, _ in judged(analysis):
        if verdict.fault is not None and verdict.fault_probability is not None:
            names = f"{joint_label(verdict, record)},fault={label(verdict.fault)}"
            yield f"gsfdi_joint_fault_probability{{{names}}} {verdict.fault_probability:.6g}"
    yield "# HELP gsfdi_joint_due_timestamp_seconds When maintenance is due."
    yield "# TYPE gsfdi_joint_due_timestamp_seconds gauge"
    for verdict, record, _ in judged(analysis):
        if verdict.due.when:
            yield f"gsfdi_joint_due_timestamp_seconds{{{joint_label(verdict, record)}}} {seconds(verdict.due.when):.0f}"
    yield "# HELP gsfdi_batch_problems Inputs that were damaged, cut short or left out."
    yield "# TYPE gsfdi_batch_problems gauge"
    yield f"gsfdi_batch_problems {sum(problem.kind != 'note' for problem in analysis.problems)}"
    yield "# HELP gsfdi_last_analysis_timestamp_seconds When the analysis ran."
    yield "# TYPE gsfdi_last_analysis_timestamp_seconds gauge"
    yield f"gsfdi_last_analysis_timestamp_seconds {seconds(analysis.made):.0f}"


def seconds(moment: str) -> float:
    """Turn an ISO date or time into seconds since the epoch; UTC where it names no zone.

    Examples
    --------
    >>> seconds("1970-01-02")
    86400.0
    """
    when = datetime.fromisoformat(moment)
    return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()


def write(analysis: Analysis) -> str:
    """Write `analysis` in Prometheus' text format."""
    return storable("\n".join(gauges(analysis)) + "\n")


REPORT = Report("prometheus", "verdicts.prom", write)
