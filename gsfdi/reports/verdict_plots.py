"""The plots that carry a verdict: the joint's signals, and what each detector left as evidence."""

from collections.abc import Iterator, Mapping

import numpy as np
from markupsafe import Markup

from gsfdi.channels import CHANNELS
from gsfdi.reports.page import Figure, plotted, words
from gsfdi.svg import Bar, Instant, Level, Line, Mark, Plot, draw_bars
from gsfdi.types import Array, Finding, JointRecord, Verdict

TIME_KEYS = ("t", "time", "time_s", "t_s")


def onset(onset_s: float | None) -> tuple[Mark, ...]:
    """Mark the onset, where there is one."""
    return () if onset_s is None else (Instant(onset_s, f"onset {onset_s:.4g} s"),)


def signal_figures(record: JointRecord, onset_s: float | None, columns: int) -> list[Figure]:
    """Draw what was commanded and measured."""
    return [plotted(plot, columns=columns) for plot in signal_plots(record, onset_s)]


def signal_plots(record: JointRecord, onset_s: float | None) -> Iterator[Plot]:
    """Give position and setpoint, tracking error, velocities and effort, as far as they were recorded."""
    t, marks, joint = record.t, onset(onset_s), record.joint

    def plot(title: str, description: str, channel: str, *curves: Mark) -> Plot:
        unit = CHANNELS[channel].unit(record.axis)
        return Plot(f"{joint}: {title}", description, (*curves, *marks), y_label=title, y_unit=unit)

    if "position" in record:
        position = Line(t, record["position"], "measured")
        command = (Line(t, record["setpoint"], "setpoint", "command"),) if "setpoint" in record else ()
        yield plot("position", "Position, as commanded and as measured.", "position", *command, position)
    if "position" in record and "setpoint" in record:
        error = Line(t, record["setpoint"] - record["position"], "setpoint − measured")
        yield plot("tracking error", "Tracking error: the controller hides most faults here.", "position", error)
    for channel in ("motor_velocity", "joint_velocity"):
        if channel in record:
            yield plot(
                words(channel),
                f"{words(channel).capitalize()}, measured.",
                channel,
                Line(t, record[channel], "measured"),
            )
    if record.effort in record:
        effort = Line(t, record[record.effort], "measured")
        yield plot(words(record.effort), "What the controller had to spend: faults show here.", record.effort, effort)
    if "temperature" in record:
        yield plot("temperature", "Joint temperature.", "temperature", Line(t, record["temperature"], "measured"))


def evidence_figures(verdict: Verdict, columns: int) -> list[Figure]:
    """Draw the evidence of every finding, alarms first."""
    findings = sorted(verdict.findings, key=lambda finding: (not finding.alarm, finding.p_value))
    return [figure for finding in findings for figure in finding_figures(finding, columns)]


def finding_figures(finding: Finding, columns: int) -> Iterator[Figure]:
    """Draw what one detector left: its arrays over time, its numbers by name as bars."""
    evidence = finding.evidence
    times = next((np.asarray(evidence[key], float) for key in TIME_KEYS if key in evidence), None)
    if times is not None:
        curves = {
            key: array for key, array in arrays(evidence).items() if array.size == times.size and key not in TIME_KEYS
        }
        marks: list[Mark] = [Line(times, array, words(key)) for key, array in curves.items()]
        if marks:
            yield plotted(
                Plot(
                    f"{finding.joint}: {words(finding.detector)}",
                    finding.sentence,
                    (*marks, Level(finding.threshold, "threshold"), *onset(finding.onset_s)),
                    y_label="statistic",
                    y_unit=finding.unit,
                ),
                columns=columns,
            )
    for key, value in evidence.items():
        if isinstance(value, Mapping) and value and all(isinstance(item, int | float) for item in value.values()):
            ranked = sorted(((str(name), float(item)) for name, item in value.items()), key=lambda pair: -pair[1])[:8]
            bars = [Bar(words(name), item) for name, item in ranked]
            title = f"{finding.joint}: {words(key)} ({words(finding.detector)})"
            drawing = draw_bars(title, ", ".join(f"{bar.label} {bar.value:.3g}" for bar in bars), bars)
            yield Figure(f"{words(key).capitalize()} ({words(finding.detector)}).", Markup(drawing))


def arrays(evidence: Mapping[str, object]) -> dict[str, Array]:
    """Pick the one-dimensional numeric arrays of a finding's evidence."""
    found = {}
    for key, value in evidence.items():
        if isinstance(value, np.ndarray | list | tuple):
            array = np.asarray(value)
            if array.ndim == 1 and array.dtype.kind in "fiub":
                found[key] = array.astype(np.float64)
    return found
