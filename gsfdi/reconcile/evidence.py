"""Arrays for the page: overlays on held-out time, residual maps before and after, and the ranking of hypotheses."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from gsfdi.channels import CHANNELS
from gsfdi.model import JointModel
from gsfdi.reconcile import locate
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.case import Case
from gsfdi.reconcile.entries import probability_of
from gsfdi.reconcile.judge import CLOSE
from gsfdi.reconcile.parameters import Shift
from gsfdi.reconcile.say import experiment
from gsfdi.reconcile.verify import free_run
from gsfdi.types import Array

CELLS = 24
PROFILE = 40


def evidence_of(
    case: Case,
    model: JointModel,
    before: Sequence[Array],
    after: Sequence[Array],
    groups: Sequence[Sequence[str]],
    lone: Sequence[Shift],
) -> dict[str, Any]:
    """Gather everything that the page draws."""
    return {
        "overlays": overlays(case.logged, case.nominal, model),
        "profiles": profiles(case.stand, before, after),
        "maps": maps(case.stand, before, after),
        "ranking": [*of_law(case), *of_numbers(lone), *ranking(case)],
        "experiments": [experiment(group) for group in groups],
    }


def overlays(stand: Bench, nominal: JointModel, updated: JointModel) -> list[dict[str, Any]]:
    """Recording, nominal and updated simulation on the held-out part of the first stretch that has one."""
    olds, news = free_run(stand, nominal), free_run(stand, updated)
    found = []
    for i, (record, old, new) in enumerate(zip(stand.records, olds, news, strict=True)):
        part = stand.kept(i)
        if part.sum() < 20:
            continue
        rows = [(record.effort, old.effort, new.effort), ("position", old.position, new.position)]
        for name, was, now in rows:
            if name == record.effort and nominal.controller is None:
                continue
            found.append(
                {
                    "name": CHANNELS[name].column(stand.model.axis),
                    "t": record.t[part],
                    "recorded": record[name][part],
                    "before": was[part],
                    "after": now[part],
                }
            )
        if stand.model.structure == "flexible":
            found.append(
                {"name": "windup_rad", "t": record.t[part], "before": old.windup[part], "after": new.windup[part]}
            )
        return found
    return found


def profiles(stand: Bench, before: Sequence[Array], after: Sequence[Array]) -> list[dict[str, Any]]:
    """Mean missing torque along each covariate."""
    rows = locate.covariates(stand)
    unknown = "missing_torque_nm" if stand.model.axis == "rotary" else "missing_force_n"
    old, new = np.concatenate(before), np.concatenate(after)
    found = []
    for name in rows[0]:
        values = np.concatenate([row[name] for row in rows])
        edges = _edges(values, PROFILE)
        if not edges[-1] > edges[0]:
            continue
        cell = np.digitize(values, edges) - 1
        at = 0.5 * (edges[1:] + edges[:-1])
        found.append(
            {
                "covariate": name,
                "unknown": unknown,
                "at": at,
                "before": _means(old, cell, PROFILE),
                "after": _means(new, cell, PROFILE),
            }
        )
    return found


def maps(stand: Bench, before: Sequence[Array], after: Sequence[Array]) -> list[dict[str, Any]]:
    """Mean missing torque over position and speed."""
    rows = locate.covariates(stand)
    names = list(rows[0])[:2]
    x, y = (np.concatenate([row[name] for row in rows]) for name in (names[1], names[0]))
    x_edges, y_edges = (_edges(v, CELLS) for v in (x, y))
    if not (x_edges[-1] > x_edges[0] and y_edges[-1] > y_edges[0]):
        return []
    cx, cy = np.digitize(x, x_edges) - 1, np.digitize(y, y_edges) - 1
    cell = np.where((cx >= 0) & (cx < CELLS) & (cy >= 0) & (cy < CELLS), cy * CELLS + cx, -1)
    grids = [_means(np.concatenate(t), cell, CELLS * CELLS).reshape(CELLS, CELLS) for t in (before, after)]
    title = "missing torque by position and speed"
    return [
        {
            "title": title,
            "x": names[1],
            "y": names[0],
            "x_edges": x_edges,
            "y_edges": y_edges,
            "before": grids[0],
            "after": grids[1],
        }
    ]


def _edges(values: Array, count: int) -> Array:
    """Edges of `count` even cells over all but the outermost values."""
    low, high = np.quantile(values, [0.002, 0.998])
    return np.linspace(float(low), float(high), count + 1)


def _means(values: Array, cell: Array, count: int) -> Array:
    """Mean of `values` by cell, NaN where there are none."""
    inside = (cell >= 0) & (cell < count)
    number = np.bincount(cell[inside], minlength=count)
    total = np.bincount(cell[inside], values[inside], count)
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


def hypothesis(term: str, side: str | None, probability: float, why: str) -> dict[str, Any]:
    """Give one row of the ranking."""
    return {"term": term, "side": side, "probability": probability, "why": why}


def beside(place: str, is_close: bool, ahead: float) -> str:
    """Say how something else does in the place of a term, by the log-likelihood that it is ahead of that."""
    told = "cannot be told apart" if is_close else "lost"
    return f"in the place of {place}: {told}, log-likelihood {ahead:+.1f} beside it"


def of_law(case: Case) -> Iterator[dict[str, Any]]:
    """What the law or the values themselves told."""
    for finding in case.findings:
        why = f"takes {100 * finding.share:.0f} % off the misfit of the law; log-likelihood {finding.gain:+.1f}"
        yield hypothesis(finding.term, None, probability_of(finding, case), why)


def of_numbers(moved: Sequence[Shift]) -> Iterator[dict[str, Any]]:
    """Numbers of the plant that were named, and what might be off in the place of one."""
    for shift in moved:
        alone = "alone accounts for what is missing" if shift.others else "is off beside others"
        why = f"{alone}: all that are off gain {shift.gain:.1f} in log-likelihood"
        yield hypothesis(shift.term, None, shift.probability, why)
        for other in shift.others:
            why = beside(shift.term, other.is_alike, -other.cost)
            yield hypothesis(other.term, None, other.probability, why)


def ranking(case: Case) -> list[dict[str, Any]]:
    """Hypotheses in order, each with what decided for or against it."""
    found: list[dict[str, Any]] = []
    for name in case.found:
        why = f"joined the model: {100 * name.share:.0f} % of the gain in log-likelihood is its own"
        found.append(hypothesis(name.use.term, name.use.side, name.probability, why))
        for rival in name.rivals:
            why = beside(name.use.term, rival.probability > CLOSE * name.probability, rival.merit)
            found.append(hypothesis(rival.use.term, rival.use.side, rival.probability, why))
    last = case.contests[-1]
    for entry in last.entries[:6]:
        if last.winner is None and np.isfinite(entry.gain):
            why = f"would gain {entry.gain:.1f} in log-likelihood; chance alone may give it {entry.bar:.1f}"
            found.append(hypothesis(entry.offer.term, entry.offer.side, 0.0, why))
    return found
