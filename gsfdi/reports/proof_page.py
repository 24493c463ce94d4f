"""The page of ``gsfdi prove``: what was promised before the first case, and how it came out.

It is drawn from ``proof.json`` (`gsfdi.proof.summary` has its figures). Keys that a proof may lack are left out of the
page: ``rivals`` (name -> figures of the same names), ``calibration`` (rows of `summary.calibration`), ``real`` (rows of
``recording``, ``withheld``, ``named``, ``right``), and ``showcase``, a mapping with ``title``, ``says``, ``truth`` and
``overlays`` as in `gsfdi.reports.reconcile_page`.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from gsfdi.reports.page import Figure, number, percent, plotted, render, words
from gsfdi.reports.quantities import quantity
from gsfdi.reports.reconcile_page import overlays
from gsfdi.svg import Bar, Plot, Points, draw_bars, draw_matrix

Fields = Mapping[str, Any]


class Goal(NamedTuple):
    """A figure that was asked for: its key, what it says, and the bounds it was to keep."""

    key: str
    says: str
    least: float = 0.0
    most: float = 1.0


GOALS = (
    Goal("first_name_right", "first name right", least=0.95),
    Goal(
        "first_name_right_hidden_from_tracking", "first name right where tracking changes by less than 1 %", least=0.95
    ),
    Goal("located_right", "component right", least=0.97),
    Goal("true_term_in_set", "true cause inside the stated set", least=0.99),
    Goal("false_discovery_in_nulls", "false discovery where nothing was wrong", most=0.01),
    Goal("parameter_drift_called_physics", "parameter drift called physics", most=0.0),
    Goal("several_all_named", "several effects at once: all named", least=0.85),
    Goal("several_nothing_besides", "several effects at once: and nothing besides", least=0.70),
    Goal("unknown_physics_admitted", "unknown physics admitted as such", least=0.90),
    Goal("parameter_error_median", "median parameter error", most=0.03),
    Goal("parameter_coverage", "95 % intervals that hold the true value", least=0.90, most=0.98),
    Goal("below_detection_silent_or_right", "below what can be seen: silent or right"),
)
"""The goals were set before the tool was written; what was missed is shown as missed."""


def asked(goal: Goal) -> str:
    """Say what was asked for.

    Examples
    --------
    >>> asked(Goal("x", "x", least=0.95)), asked(Goal("x", "x", most=0.01)), asked(Goal("x", "x", 0.9, 0.98))
    ('at least 95 %', 'at most 1 %', '90 % to 98 %')
    """
    if goal.least and goal.most < 1:
        return f"{percent(goal.least)} to {percent(goal.most)}"
    if goal.least:
        return f"at least {percent(goal.least)}"
    return f"at most {percent(goal.most)}" if goal.most < 1 else ""


def tiles(figures: Fields) -> Iterator[dict[str, Any]]:
    """Give each headline figure with its interval and whether it kept its goal."""
    for goal in GOALS:
        figure = figures.get(goal.key)
        detail = f"{figure['hits']} of {figure['of']}, {interval(figure)}" if isinstance(figure, Mapping) else ""
        value = figure["rate"] if isinstance(figure, Mapping) else figure
        if value is not None:
            met = goal.least <= value <= goal.most if asked(goal) else None
            yield {"says": goal.says, "value": percent(value), "asked": asked(goal), "met": met, "detail": detail}


def interval(figure: Fields) -> str:
    """Write the interval of a rate."""
    low, high = figure["ci95"]
    return f"95 % interval {percent(low)} to {percent(high)}"


def hiding(scores: Fields) -> Iterator[Figure]:
    """Draw how well each effect hides from tracking and shows in the current, and whether it was named."""
    found: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
    for score in scores.values():
        hidden = score.get("concealment") or {}
        if score.get("first_right") is not None and hidden.get("effort") and hidden.get("tracking"):
            found[bool(score["first_right"])].append((abs(hidden["tracking"]), hidden["effort"]))
    if not any(found.values()):
        return
    right, wrong = (np.array(found[named]).reshape(-1, 2) for named in (True, False))
    marks = (
        Points(right[:, 0], right[:, 1], f"named ({len(right)})", "after"),
        Points(wrong[:, 0], wrong[:, 1], f"not named first ({len(wrong)})", "before"),
    )
    caption = (
        "Each case by how much its effect changes the tracking error, and the drive's effort in units of its noise. "
        "The further left, the better the controller conceals it."
    )
    plot = Plot(
        "Concealment of every case",
        caption,
        marks,
        "relative change of the tracking error",
        "1",
        "change of effort, in noise",
        "1",
        log=True,
        log_x=True,
        height=300,
    )
    yield plotted(plot)


STRANGERS = ("unknown", "withheld")
"""Groups of cases whose cause is in no library: whoever calls it unexplained is right."""


def is_right(score: Fields) -> bool | None:
    """Whether the answer to a case is right; None where nothing was asked."""
    if not score["kinds"]:
        return not score["extra"]
    asked_of = "puzzled" if score["group"] in STRANGERS else "first_right"
    right = score.get(asked_of)
    # A fault of the controller has no term to be named by; there the place is what was asked.
    return score.get("located") if right is None else bool(right)


def confused(proof: Fields) -> Iterator[Figure]:
    """Draw the confusion matrix, its columns in the order of its rows so that most of what is right is the diagonal."""
    table: Mapping[str, Mapping[str, int]] = proof.get("confusion") or {}
    if not table:
        return
    said = {name for counts in table.values() for name in counts}
    columns = [name for name in table if name in said] + sorted(said - set(table))
    counts = np.array([[table[kind].get(name, 0) for name in columns] for kind in table], dtype=float)
    good = {first_words(score) for score in proof["scores"].values() if is_right(score)}
    right = np.array([[(kind, name) in good for name in columns] for kind in table])
    caption = (
        f"What acted (rows) against the first name given, or in brackets the verdict where none was (columns): "
        f"{counts[right].sum():.0f} of {counts.sum():.0f} right, in blue. Effects too faint to be seen are left out."
    )
    rows, names = list(map(words, table)), [words(name).replace("(None)", "(no answer)") for name in columns]
    yield Figure(caption, Markup(draw_matrix("Confusion matrix", caption, rows, names, counts, right)))


def first_words(score: Fields) -> tuple[str, str]:
    """Give what acted, and the first name given or else the verdict in brackets."""
    acted = score["kinds"][0] if score["kinds"] else "(nothing)"
    return acted, score["named"][0] if score["named"] else f"({score['verdict']})"


def rivals(proof: Fields) -> Iterator[Figure]:
    """Draw how often each rival's first name was right on the same cases."""
    others: Mapping[str, Fields] = proof.get("rivals") or {}
    for key, caption in (
        ("first_name_right", "First name right, on the same cases."),
        ("false_discovery_in_nulls", "Something named where nothing was wrong, on the same cases (less is better)."),
    ):
        rows = [("gsfdi reconcile", proof["figures"].get(key)), *((name, one.get(key)) for name, one in others.items())]
        known = [(name, one["rate"], one["ci95"]) for name, one in rows if one and one["rate"] is not None]
        bars = [
            Bar(name, share, low, high, tone="quiet" if i else "after", note=percent(share))
            for i, (name, share, (low, high)) in enumerate(known)
        ]
        if len(bars) > 1:
            spoken = "; ".join(f"{bar.label} {bar.note}" for bar in bars)
            yield Figure(caption, Markup(draw_bars(caption, spoken, bars, 1.0)))


def calibrated(proof: Fields) -> Iterator[Figure]:
    """Draw how often names were right, by the probability that they were given."""
    bars = [
        Bar(
            f"said {percent(row['from'])} to {percent(row['to'])}, {percent(row['said'])} in the mean",
            row["rate"],
            low,
            high,
            tone="after",
            note=f"{row['hits']} of {row['of']}",
        )
        for row in proof.get("calibration") or ()
        for low, high in [row["ci95"]]
    ]
    if bars:
        caption = "Share of the names that are true ones, by the probability that the tool gave them."
        spoken = "; ".join(f"{bar.label}: {bar.note}" for bar in bars)
        yield Figure(caption, Markup(draw_bars(caption, spoken, bars, 1.0)))


def sizes(kinds: Sequence[Fields]) -> list[dict[str, object]]:
    """Give the rows by kind and size as the table prints them."""
    return [
        {
            **row,
            "tracking": percent(row.get("tracking")),
            "effort": number(row.get("effort")),
            "windup": number(row.get("windup")),
            "parameter_error": percent(row.get("parameter_error")),
        }
        for row in kinds
    ]


def told(name: str, score: Fields) -> dict[str, object]:
    """Give one case as the table prints it."""
    return {
        "name": name,
        "group": words(score["group"]),
        "kinds": ", ".join(map(words, score.get("kinds") or ())) or "nothing",
        "size": score.get("size") or "–",
        "visible": score.get("visible"),
        "tracking": (score.get("concealment") or {}).get("tracking"),
        "verdict": words(score.get("verdict") or "no answer"),
        "named": ", ".join(map(words, score.get("named") or ())) or "–",
        "right": is_right(score),
        "seconds": score.get("seconds"),
    }


def headline(figures: Fields) -> str:
    """Say in one line what was proved."""
    first = figures["first_name_right"]
    if first["rate"] is None:
        return f"{figures['cases']} sealed cases, reconciled without their answers"
    return f"{first['hits']} of {first['of']} concealed causes named right, their answers sealed beforehand"


def lines(proof: Fields) -> Iterator[str]:
    """Say the proof's figures in lines for a terminal.

    Parameters
    ----------
    proof : mapping
        What ``proof.json`` holds.
    """
    yield headline(proof["figures"])
    for tile in tiles(proof["figures"]):
        kept = {None: "", True: ", kept", False: ", missed"}[tile["met"]]
        goal = f"; goal {tile['asked']}{kept}" if tile["asked"] else ""
        yield f"{tile['value']:>9}  {tile['says']}" + (f" ({tile['detail']})" if tile["detail"] else "") + goal
    yield f"sealed as SHA-256 {proof['seal']['truth_sha256']}"


def write(proof: Fields) -> str:
    """Write the page of a proof.

    Parameters
    ----------
    proof : mapping
        What ``proof.json`` holds.
    """
    figures, showcase = proof["figures"], proof.get("showcase") or {}
    return render(
        "proof.html",
        {
            "headline": headline(figures),
            "seal": proof["seal"],
            "figures": figures,
            "tiles": list(tiles(figures)),
            "showcase": {**showcase, "plots": list(overlays(str(showcase.get("title", "")), showcase, 260))},
            "hiding": [*hiding(proof["scores"])],
            "confusion": [*confused(proof)],
            "rivals": [*rivals(proof)],
            "calibration": [*calibrated(proof)],
            "fits": [
                {"channel": "{} [{}]".format(*quantity(name)), **row}
                for name, row in (figures.get("fit") or {}).items()
            ],
            "kinds": sizes(proof["kinds"]),
            "real": list(proof.get("real") or ()),
            "cases": [told(name, score) for name, score in sorted(proof["scores"].items())],
        },
    )
