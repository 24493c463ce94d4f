"""From the scores of all cases to the figures that are published, each with its exact binomial interval."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import beta

Score = Mapping[str, Any]


def rate(hits: int, of: int) -> dict[str, Any]:
    """Give a rate with its exact (Clopper-Pearson) 95 % interval.

    Examples
    --------
    >>> rate(0, 100)["ci95"][1] < 0.037
    True
    """
    low = float(beta.ppf(0.025, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, of - hits)) if hits < of else 1.0
    return {"hits": hits, "of": of, "rate": hits / of if of else None, "ci95": [low, high]}


def _share(scores: Iterable[Score], question: Callable[[Score], bool | None]) -> dict[str, Any]:
    asked = [answer for answer in map(question, scores) if answer is not None]
    return rate(sum(asked), len(asked))


def _field(name: str) -> Callable[[Score], bool | None]:
    def read(score: Score) -> bool | None:
        value: bool | None = score[name]
        return value

    return read


def summarise(scores: Sequence[Score]) -> dict[str, Any]:
    """Give every published figure of a proof."""
    single = [s for s in scores if s["group"] in ("single", "mujoco") and s["visible"]]
    terms = [s for s in single if s["true"]]
    nulls = [s for s in scores if s["group"] == "null"]
    several = [s for s in scores if s["group"] in ("double", "triple") and s["visible"]]
    strangers = [s for s in scores if s["group"] in ("unknown", "withheld") and s["visible"]]
    faint = [s for s in scores if s["true"] and not s["visible"]]
    drift = [s for s in single if s["kinds"][0].endswith("_change")]
    hiding = [s for s in terms if abs((s["concealment"] or {}).get("tracking", 1.0)) < 0.01]
    return {
        "cases": len(scores),
        "answered": _share(scores, _field("answered")),
        "trespasses": sum(bool(s["trespassed"]) for s in scores),
        "first_name_right": _share(terms, _field("first_right")),
        "first_name_right_hidden_from_tracking": _share(hiding, _field("first_right")),
        "first_name_right_or_tied": _share(terms, _field("first_or_tied")),
        "first_name_right_or_equivalent": _share(terms, _field("first_equivalent")),
        "located_right": _share(single, _field("located")),
        "true_term_in_set": _share(terms, _field("covered")),
        "set_size_median": float(np.median([s["set_size"] for s in terms])) if terms else None,
        "onset_right": _share(single, _field("onset_right")),
        "onset_error_s_median": _median(s["onset_error_s"] for s in single),
        "false_discovery_in_nulls": _share(nulls, lambda s: bool(s["extra"])),
        "parameter_drift_called_physics": _share(drift, lambda s: any(not n.endswith("_change") for n in s["extra"])),
        "named_beside_the_truth": _share(terms, lambda s: bool(s["extra"])),
        "several_all_named": _share(several, _field("all_named")),
        "several_nothing_besides": _share(several, lambda s: bool(s["all_named"]) and not s["extra"]),
        "unknown_physics_admitted": _share(strangers, _field("puzzled")),
        "below_detection_silent_or_right": _share(faint, lambda s: s["silent"] or not s["extra"]),
        "parameter_error_median": _median(p["error"] for s in scores for p in s["parameters"]),
        "parameter_coverage": _share(
            [p for s in scores for p in s["parameters"]], lambda p: None if p["covered"] is None else bool(p["covered"])
        ),
        "fit": _fits(scores),
        "seconds_median": _median(s["seconds"] for s in scores),
        "seconds_most": max((s["seconds"] for s in scores), default=None),
    }


def rivals(scores: Sequence[Score]) -> dict[str, dict[str, Any]]:
    """Give the rivals' figures, by the same names, on the same cases."""
    found: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for score in scores:
        for name, said in score["rivals"].items():
            shown = score["group"] in ("single", "mujoco") and score["visible"]
            null = bool(said["named"]) if score["group"] == "null" else None
            found[name].append({"right": said["first_right"] if shown else None, "null": null})
    return {
        name: {
            "first_name_right": _share(rows, _field("right")),
            "false_discovery_in_nulls": _share(rows, _field("null")),
        }
        for name, rows in found.items()
    }


def _median(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def _fits(scores: Sequence[Score]) -> dict[str, Any]:
    """Median misfit before and after, over that of the true world itself, by channel, where an effect was named."""
    ratios: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for score in scores:
        if score["true"] and score["visible"] and score["named"]:
            for column, row in (score["fit"] or {}).items():
                ratios[column].append((row["before"] / row["oracle"], row["after"] / row["oracle"]))
    return {
        column: {
            "cases": len(rows),
            "before_over_oracle": float(np.median([before for before, _ in rows])),
            "after_over_oracle": float(np.median([after for _, after in rows])),
        }
        for column, rows in sorted(ratios.items())
    }


STEPS = (0.0, 0.5, 0.9, 0.99, 1.0)
"""Bounds between which probabilities are pooled."""


def calibration(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """How often names were right, by the probability that the tool gave them; one row per span of `STEPS` in use."""
    said = [one for score in scores for one in score["said"]]
    place = np.digitize([one["probability"] for one in said], STEPS[1:-1])
    pools = [[one for one, at in zip(said, place, strict=True) if at == span] for span in range(len(STEPS) - 1)]
    return [
        {
            "from": STEPS[span],
            "to": STEPS[span + 1],
            "said": float(np.mean([one["probability"] for one in pool])),
            **rate(sum(one["right"] for one in pool), len(pool)),
        }
        for span, pool in enumerate(pools)
        if pool
    ]


def by_kind(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """One row per kind and size: how often the first name was right, the set held it, the place was right."""
    rows: dict[tuple[str, str], list[Score]] = defaultdict(list)
    for score in scores:
        if len(score["kinds"]) == 1:
            name = score["kinds"][0] if score["group"] == "single" else f"{score['kinds'][0]} ({score['group']})"
            rows[name, score["size"]].append(score)
    return [
        {
            "kind": kind,
            "size": size,
            "cases": len(group),
            "visible": sum(bool(s["visible"]) for s in group),
            "first_right": sum(bool(s["first_right"]) for s in group),
            "covered": sum(bool(s["covered"]) for s in group),
            "located": sum(bool(s["located"]) for s in group),
            "puzzled": sum(bool(s["puzzled"]) for s in group),
            "silent": sum(bool(s["silent"]) for s in group),
            "tracking": _median((s["concealment"] or {}).get("tracking") for s in group),
            "effort": _median((s["concealment"] or {}).get("effort") for s in group),
            "windup": _median((s["concealment"] or {}).get("windup") for s in group),
            "parameter_error": _median(p["error"] for s in group for p in s["parameters"]),
        }
        for (kind, size), group in sorted(rows.items())
    ]


def confusion(scores: Sequence[Score]) -> dict[str, dict[str, int]]:
    """What was said of each kind: counts of the first name, or of the verdict where none was given."""
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for score in scores:
        if score["group"] in ("single", "mujoco", "null", "unknown", "withheld") and (
            score["visible"] or not score["kinds"]
        ):
            said = score["named"][0] if score["named"] else f"({score['verdict']})"
            table[score["kinds"][0] if score["kinds"] else "(nothing)"][said] += 1
    return {kind: dict(counts.most_common()) for kind, counts in sorted(table.items())}
