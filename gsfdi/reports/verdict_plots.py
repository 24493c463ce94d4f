"""The plots that carry a verdict: the joint's signals, and what each detector left as evidence.

`gsfdi.diagnosis` documents the evidence by detector. What is not drawn here by name, such as the evidence of a detector
that somebody added, is drawn by its shape: arrays as long as ``t`` as curves, numbers by name as bars.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from gsfdi.channels import CHANNELS
from gsfdi.reports.page import Figure, finished, likely, number, plotted, words
from gsfdi.svg import Bar, Instant, Level, Line, Mark, Plot, draw_bars
from gsfdi.types import Array, Finding, JointRecord, Verdict

Evidence = Mapping[str, Any]


def onset(onset_s: float | None) -> tuple[Mark, ...]:
    """Mark the onset, where there is one within the batch."""
    return (Instant(onset_s, f"onset {onset_s:.4g} s"),) if onset_s else ()


def signal_plots(record: JointRecord, onset_s: float | None) -> dict[str, Plot]:
    """Plot what was commanded and measured, as far as it was recorded; what tells most comes first.

    Parameters
    ----------
    record : JointRecord
        The joint's telemetry.
    onset_s : float, optional
        When the fault set in [s].
    """
    t, plots = record.t, {}

    def add(name: str, caption: str, channel: str, *curves: Mark) -> None:
        unit = CHANNELS[channel].unit(record.axis)
        marks = (*curves, *onset(onset_s))
        plots[name] = Plot(f"{record.joint}: {name}", caption, marks, y_label=name, y_unit=unit)

    if record.effort in record:
        caption = "What the drive had to spend; under a controller faults show here first."
        add(words(record.effort), caption, record.effort, Line(t, record[record.effort], "measured"))
    if "position" in record and "setpoint" in record:
        error = Line(t, record["setpoint"] - record["position"], "setpoint − measured")
        add("tracking error", "Tracking error; the controller keeps most faults out of it.", "position", error)
    if "position" in record:
        command = (Line(t, record["setpoint"], "setpoint", "command"),) if "setpoint" in record else ()
        curves = (*command, Line(t, record["position"], "measured"))
        add("position", "Position, as commanded and as measured.", "position", *curves)
    for channel in ("motor_velocity", "joint_velocity", "temperature"):
        if channel in record:
            name = words(channel)
            add(name, f"{name.capitalize()}, as measured.", channel, Line(t, record[channel], "measured"))
    return plots


def evidence_figures(verdict: Verdict, columns: int, alarm: bool) -> list[Figure]:
    """Draw the evidence of every finding that alarmed, or of every other."""
    order = [finding for finding in by_weight(verdict.findings) if bool(finding.alarm) is alarm]
    return [figure for finding in order for figure in drawer(finding)(finding, columns)]


def by_weight(findings: Sequence[Finding]) -> list[Finding]:
    """Order findings by what they say: the diagnosis, then alarms, the least probable by chance first."""
    return sorted(findings, key=lambda one: (one.detector != "diagnosis", not one.alarm, one.p_value))


def watched(
    finding: Finding,
    columns: int,
    values: str = "residual",
    limit: str = "threshold",
    times: str = "t",
    *,
    name: str,
    caption: str,
    unit: str = "1",
) -> Iterator[Figure]:
    """Draw a statistic over time with its threshold and the onset.

    Parameters
    ----------
    finding : Finding
        What the detector saw.
    columns : int
        Resolution of the drawing.
    values, limit, times : str
        Keys of the statistic, its threshold and its times among the evidence.
    name, caption, unit : str
        What the statistic is called, what the drawing shows, and in which unit.
    """
    evidence: Evidence = finding.evidence
    if not np.size(evidence.get(values, ())):
        return
    statistic = np.asarray(evidence[values], float)
    marks: list[Mark] = [Line(evidence[times], statistic, name)]
    bound = evidence.get(limit)
    if bound is not None:
        marks.append(Level(float(bound), "threshold"))
        if np.nanmin(statistic, initial=0.0) < 0:
            marks.append(Level(-float(bound), ""))
    if finding.alarm:
        marks += onset(finding.onset_s)
    yield plotted(Plot(f"{finding.joint}: {name}", caption, tuple(marks), y_label=name, y_unit=unit), columns)


def ranked(finding: Finding, title: str, caption: str, bars: Sequence[Bar], limit: float = 0.0) -> Iterator[Figure]:
    """Draw a ranking."""
    if bars:
        spoken = "; ".join(f"{bar.label} {bar.note or number(bar.value)}" for bar in bars)
        yield Figure(caption, Markup(draw_bars(f"{finding.joint}: {title}", spoken, bars, limit)))


def diagnosis(finding: Finding, columns: int) -> Iterator[Figure]:
    """Draw the candidate faults by probability, with how alike the batch and each known failure are."""
    evidence: Evidence = finding.evidence
    rows = zip(evidence["names"], evidence["probabilities"], evidence["cosines"], strict=True)
    bars = [
        Bar(words(name), float(share), tone="quiet" if i else "alarm", note=f"{likely(share)}; cosine {cosine:.2f}")
        for i, (name, share, cosine) in enumerate(rows)
    ]
    caption = (
        "How probable each fault is; the cosine says how alike this batch and the known failure are (1: the same)."
    )
    yield from ranked(finding, "fault probabilities", caption, bars, 1.0)


def innovations(finding: Finding, columns: int) -> Iterator[Figure]:
    """Draw how far the innovations lean towards the most likely fault."""
    caption = "Innovations, summed along the most likely fault: how far the batch leans towards it."
    yield from watched(finding, columns, name="lean", caption=f"{caption} {finished(finding.sentence)}")


def parity(finding: Finding, columns: int) -> Iterator[Figure]:
    """Draw the parity residual of the long window and of the paper's three samples."""
    caption = f"Parity residual over the long window ({finding.unit})."
    yield from watched(finding, columns, name="parity residual", caption=caption)
    caption = "Parity residual over three samples, as in the paper: quick, and blind in noise."
    times = "t3" if "t3" in finding.evidence else "t"
    yield from watched(finding, columns, "residual3", "threshold3", times, name="parity residual", caption=caption)


def identified(finding: Finding, columns: int) -> Iterator[Figure]:
    """Draw the subspace angles and what the Markov parameters say of the input matrix."""
    caption = "Largest principal angle between the identified subspace and the baseline's, block by block."
    yield from watched(finding, columns, "angles", name="angle", unit="rad", caption=caption)
    caption = "Deviation of the Markov parameters, block by block: the second step, which sees what angles cannot."
    yield from watched(finding, columns, "markov", "markov_threshold", name="deviation", caption=caption)


def signals(finding: Finding, columns: int) -> Iterator[Figure]:
    """Draw which features of the signals stand out."""
    evidence: Evidence = finding.evidence
    scored = sorted(zip(evidence["features"], np.abs(evidence["scores"]), strict=True), key=lambda pair: -pair[1])
    bound = float(evidence["threshold"])
    bars = [Bar(words(name), float(score), tone="alarm" if score > bound else "quiet") for name, score in scored[:8]]
    caption = (
        f"Features of the signals by their deviation from the baseline's batches; more than {number(bound)} alarms."
    )
    yield from ranked(finding, "features", caption, bars, bound)


def by_shape(finding: Finding, columns: int) -> Iterator[Figure]:
    """Draw evidence that nothing is known of: arrays over ``t`` as curves, numbers by name as bars."""
    curves = curves_of(finding.evidence)
    if curves:
        marks = (*curves, Level(finding.threshold, "threshold"), *onset(finding.onset_s))
        title = f"{finding.joint}: {words(finding.detector)}"
        yield plotted(Plot(title, finding.sentence, marks, y_label="statistic", y_unit=finding.unit), columns)
    for key, value in finding.evidence.items():
        if isinstance(value, Mapping) and value and all(isinstance(item, int | float) for item in value.values()):
            rows = sorted(((words(name), float(item)) for name, item in value.items()), key=lambda pair: -pair[1])
            caption = f"{words(key).capitalize()} ({words(finding.detector)})."
            yield from ranked(finding, words(key), caption, [Bar(name, item) for name, item in rows[:8]])


def curves_of(evidence: Evidence) -> list[Line]:
    """Pick the numeric arrays that are as long as ``t``."""
    times = np.asarray(evidence.get("t", ()), float)
    found: dict[str, Array] = {}
    for key, value in evidence.items():
        if key != "t" and isinstance(value, np.ndarray | list | tuple) and np.shape(value) == times.shape:
            array = np.asarray(value)
            if array.dtype.kind in "fiub":
                found[key] = array.astype(np.float64)
    return [Line(times, array, words(key)) for key, array in found.items()]


Drawer = Callable[[Finding, int], Iterator[Figure]]

DRAWN: dict[str, tuple[Drawer, tuple[str, ...]]] = {
    "diagnosis": (diagnosis, ("names", "probabilities", "cosines")),
    "innovations": (innovations, ("t", "residual")),
    "parity": (parity, ("t", "residual")),
    "smi": (identified, ("t", "angles")),
    "signals": (signals, ("features", "scores", "threshold")),
}
"""How the evidence of each detector is drawn, and what it must hold for that."""


def drawer(finding: Finding) -> Drawer:
    """Choose how to draw a finding."""
    draw, needs = DRAWN.get(finding.detector, (by_shape, ()))
    return draw if all(key in finding.evidence for key in needs) else by_shape
