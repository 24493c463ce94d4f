"""The page of ``gsfdi reconcile``: where simulation and recording differ, what was left out, and that it fits now.

A joint's evidence is a mapping; what it lacks is left out of the page. Its keys:

``overlays``
    sequence of mappings with ``name`` (a published column such as ``motor_current_a``), ``t`` [s], ``recorded``,
    ``before`` and ``after`` (arrays as long as ``t``; any may be missing). Held-out time, drawn with its residual.
``maps``
    sequence of mappings with ``title``, ``x``, ``y`` (published names of the covariates), ``x_edges``, ``y_edges``,
    ``before`` and ``after``: mean residual by cell, (ny, nx), NaN where the joint never was.
``profiles``
    sequence of mappings with ``covariate``, ``unknown`` (published name of the residual), ``at``, ``before`` and
    ``after``: mean residual along one covariate.
``ranking``
    sequence of mappings with ``term``, ``probability`` or ``score``, and ``why``: what decided for or against it.
``experiments``
    sequence of sentences: what would separate the terms that the data cannot tell apart.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from markupsafe import Markup

from gsfdi.reports.page import Figure, finished, likely, number, percent, plotted, render, words
from gsfdi.reports.quantities import quantity
from gsfdi.svg import Bar, Line, Plot, Tone, draw_bars, draw_map
from gsfdi.svg.scale import prefixed
from gsfdi.types import Array

Fields = Mapping[str, Any]
"""A JSON object whose fields the published format describes."""


@dataclass(frozen=True, slots=True)
class Story:
    """One joint: its object in ``reconcile.json``, the arrays behind it, and the text of its updated model."""

    joint: Fields
    evidence: Fields = field(default_factory=dict)
    updated_model: str = ""


HEADLINES = {
    "no_mismatch": "simulation and recording agree",
    "explained": "the mismatch is explained",
    "partly_explained": "the mismatch is partly explained",
    "unexplained": "the mismatch is located but not explained",
    "not_enough_data": "not enough data to tell",
}

LEVELS = {
    "no_mismatch": "normal",
    "explained": "warning",
    "partly_explained": "warning",
    "unexplained": "distress",
    "not_enough_data": "not_assessed",
}
"""Which of the pages' shapes and colours stands for which outcome."""

RUNS: dict[Tone, str] = {"before": "old simulation", "after": "new simulation"}


def named(term: Fields) -> str:
    """Name a term with its side, and a wave with its order.

    Examples
    --------
    >>> named({"term": "coulomb_friction", "side": "motor"})
    'coulomb friction (motor side)'
    >>> named({"term": "cogging", "parameters": {"order": {"value": 7.0}}})
    'cogging of order 7'
    """
    side, order = term.get("side"), (term.get("parameters") or {}).get("order")
    wave = f" of order {order['value']:.4g}" if order else ""
    return words(term.get("term", "?")) + wave + (f" ({side} side)" if side else "")


def sentence(joint: Fields) -> str:
    """Say the outcome of one joint in a line."""
    terms = [f"{named(term)}, {likely(term.get('probability'))}" for term in joint.get("omitted_physics", ())]
    outcome = HEADLINES.get(joint["verdict"], words(joint["verdict"]))
    return outcome + (": " + "; ".join(terms) if terms else "")


def overlays(joint: str, evidence: Fields, columns: int) -> Iterator[Figure]:
    """Draw the recording with the old and the new simulation, and what each leaves over."""
    for item in evidence.get("overlays", ()):
        name, unit = quantity(item["name"])
        t = np.asarray(item["t"], float)
        runs = [(tone, np.asarray(item[tone], float)) for tone in RUNS if item.get(tone) is not None]
        recorded = None if item.get("recorded") is None else np.asarray(item["recorded"], float)
        curves = [Line(t, values, RUNS[tone], tone) for tone, values in runs]
        if recorded is not None:
            curves.insert(0, Line(t, recorded, "recorded", "quiet"))
        caption = f"{name.capitalize()} on data that took no part" + (", not measured." if recorded is None else ".")
        plot = Plot(f"{joint}: {name}, held out", caption, tuple(curves), y_label=name, y_unit=unit)
        yield plotted(plot, columns)
        if recorded is not None:
            left = tuple(Line(t, recorded - values, RUNS[tone], tone) for tone, values in runs)
            caption = f"What each simulation leaves over in {name}."
            plot = Plot(f"{joint}: residual of {name}, held out", caption, left, y_label="residual", y_unit=unit)
            yield plotted(plot, columns)


def profiles(joint: str, evidence: Fields) -> Iterator[Figure]:
    """Draw the mean residual along each covariate, before and after; the most uneven come first."""
    for item in sorted(evidence.get("profiles", ()), key=unevenness, reverse=True):
        (x_name, x_unit), (y_name, y_unit) = quantity(item["covariate"]), quantity(item["unknown"])
        lines = [Line(item["at"], item[tone], tone, tone) for tone in RUNS if item.get(tone) is not None]
        yield plotted(
            Plot(
                f"{joint}: {y_name} against {x_name}",
                f"Mean residual ({y_name}) against {x_name}.",
                tuple(lines),
                x_label=x_name,
                x_unit=x_unit,
                y_label=y_name,
                y_unit=y_unit,
            )
        )


def unevenness(profile: Fields) -> float:
    """How much the mean residual before differs along the covariate."""
    before = np.asarray(profile["before"], float)
    known = before[np.isfinite(before)]
    return float(np.std(known)) if known.size else 0.0


def maps(joint: str, evidence: Fields) -> Iterator[Figure]:
    """Draw each residual map before and after on one scale of colour."""
    for item in evidence.get("maps", ()):
        (x_name, x_unit), (y_name, y_unit) = quantity(item["x"]), quantity(item["y"])
        x_edges, x_shown = edges(item["x_edges"], x_unit)
        y_edges, y_shown = edges(item["y_edges"], y_unit)
        full = float(np.nanmax(np.abs(np.asarray(item["before"], float)), initial=0.0)) or 1.0
        scale = f"full colour at ±{full:.3g}; blue above zero, orange below"
        caption = finished(f"{item['title']}, before and after ({scale}).")
        drawings = [
            draw_map(
                f"{joint}: {item['title']}, {tone}",
                f"{item['title']}, {RUNS[tone]}.",
                np.asarray(item[tone], float),
                f"{x_name} [{x_shown}]",
                f"{y_name} [{y_shown}]",
                x_edges,
                y_edges,
                full,
            )
            for tone in RUNS
            if item.get(tone) is not None
        ]
        yield Figure(caption, Markup(f'<div class="pair">{"".join(drawings)}</div>'))


def edges(values: Any, unit: str) -> tuple[tuple[float, float], str]:
    """Give the ends of an axis in a readable unit."""
    array: Array = np.asarray(values, float)
    factor, name = prefixed(unit, float(np.max(np.abs(array))))
    return (float(array[0]) * factor, float(array[-1]) * factor), name


def ranking(joint: str, evidence: Fields) -> Iterator[Figure]:
    """Draw how the hypotheses compare."""
    rows = list(evidence.get("ranking", ()))[:10]
    key = "probability" if rows and rows[0].get("probability") is not None else "score"
    bars = [
        Bar(
            named(row),
            float(row.get(key) or 0.0),
            tone="after" if i == 0 or float(row.get("probability") or 0.0) > 0.5 else "quiet",
            note=likely(row.get(key)) if key == "probability" else "",
        )
        for i, row in enumerate(rows)
    ]
    if bars:
        caption = f"Hypotheses by {key}."
        spoken = "; ".join(f"{bar.label} {bar.value:.3g}" for bar in bars)
        drawing = draw_bars(f"{joint}: hypotheses by {key}", spoken, bars, 1.0 if key == "probability" else 0.0)
        yield Figure(caption, Markup(drawing))


def places(joint: Fields) -> Iterator[Figure]:
    """Draw in which conditions the misfit lies."""
    where = (joint.get("location") or {}).get("where") or ()
    bars = []
    for place in where:
        name, unit = quantity(place["covariate"])
        low, high = place.get("low"), place.get("high")
        span = "" if low is None or high is None else f" {number(low)} to {number(high)} {unit}"
        bars.append(Bar(name + span, float(place.get("share_of_misfit") or 0.0), tone="before"))
    if bars:
        spoken = "; ".join(f"{bar.label}: {percent(bar.value)}" for bar in bars)
        drawing = draw_bars(f"{joint['joint']}: shares of the misfit", spoken, bars, 1.0)
        yield Figure("Share of the misfit by condition.", Markup(drawing))


def fit_rows(joint: Fields) -> list[dict[str, object]]:
    """Tabulate the held-out misfit: before, after and the noise floor, channel by channel."""
    fit = joint.get("fit") or {}
    before, after, floor = (fit.get(key) or {} for key in ("before", "after", "noise_floor"))
    rows: list[dict[str, object]] = []
    for column in dict.fromkeys([*before, *after]):
        name, unit = quantity(column)
        old, new = before.get(column), after.get(column)
        share = None if not old or new is None else new / old
        rows.append(
            {"name": name, "unit": unit, "before": old, "after": new, "floor": floor.get(column), "left": share}
        )
    return rows


def parameters(term: Fields) -> list[dict[str, object]]:
    """Tabulate a term's parameters with their intervals."""
    rows: list[dict[str, object]] = []
    for key, item in (term.get("parameters") or {}).items():
        name, unit = quantity(key)
        rows.append({"name": name, "unit": unit, "value": item.get("value"), "ci95": item.get("ci95")})
    return rows


def unseen(joint: Fields) -> list[dict[str, object]]:
    """Tabulate the least of each term that could have been seen."""
    found = (joint.get("mismatch") or {}).get("smallest_seen") or ()
    return [{"name": named(item), "rows": [least(*pair) for pair in item["parameters"].items()]} for item in found]


def least(key: str, value: float) -> dict[str, object]:
    """Give a table's row for the least of a parameter: of a ratio to what is nominal, how far it is off."""
    name, unit = quantity(key)
    if key == "ratio" and value > 0.5:  # those that are no ratio to something nominal begin at 0
        return {"name": "change", "unit": "%", "value": 100 * (value - 1)}
    return {"name": name, "unit": unit, "value": value}


def part(index: int, story: Story, columns: int) -> dict[str, object]:
    """Gather what the page says of one joint."""
    joint, evidence, name = story.joint, story.evidence, str(story.joint["joint"])
    return {
        "anchor": f"joint-{index}",
        "name": name,
        "level": LEVELS.get(joint["verdict"], "not_assessed"),
        "outcome": words(joint["verdict"]),
        "sentence": sentence(joint),
        "joint": joint,
        "mismatch": joint.get("mismatch") or {},
        "location": joint.get("location") or {},
        "signals": ", ".join(quantity(name)[0] for name in (joint.get("location") or {}).get("signals") or ()),
        "terms": [{"term": term, "name": named(term), "rows": parameters(term)} for term in joint["omitted_physics"]],
        "together": joint.get("together") or (),
        "unseen": unseen(joint),
        "indistinguishable": [" · ".join(map(words, group)) for group in joint.get("indistinguishable") or ()],
        "experiments": list(evidence.get("experiments", ())),
        "fit": fit_rows(joint),
        "held_out": (joint.get("fit") or {}).get("held_out_seconds"),
        "overlays": list(overlays(name, evidence, columns)),
        "maps": list(maps(name, evidence)),
        "profiles": list(profiles(name, evidence)),
        "places": [*places(joint)],
        "ranking": [*ranking(name, evidence)],
        "hypotheses": [{**row, "name": named(row)} for row in evidence.get("ranking", ())],
        "updated_model": story.updated_model,
    }


def write(stories: Sequence[Story], recordings: Sequence[Fields], made: str) -> str:
    """Write the page of one `gsfdi reconcile`.

    Parameters
    ----------
    stories : sequence of Story
        One per joint.
    recordings : sequence of mapping
        ``path`` and ``sha256`` of each recording.
    made : str
        When it ran (ISO 8601).
    """
    columns = max(60, min(260, 2600 // max(len(stories), 1)))
    parts = [part(index, story, columns) for index, story in enumerate(stories)]
    title = f"{parts[0]['name']}: {parts[0]['sentence']}" if len(parts) == 1 else "Simulation against recording"
    return render("reconcile.html", {"title": title, "joints": parts, "recordings": recordings, "made": made})
