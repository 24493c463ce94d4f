"""What was found, as the answer lists it: terms, parameters, faults of law and sensors, and what looks alike."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import exp, inf
from typing import Any

from gsfdi.model import TermUse
from gsfdi.reconcile.case import Case
from gsfdi.reconcile.hand import around
from gsfdi.reconcile.judge import UNLIKELY, Name
from gsfdi.reconcile.parameters import PINNED, SNUG, SOLE, TERM_OF, Lone, Other, Shift, all_kept, lone_changes, shifts
from gsfdi.reconcile.reconciliation import Outcome
from gsfdi.reconcile.say import sentence, spelled
from gsfdi.reconcile.screen import LEAST
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.reconcile.twin import is_feigned
from gsfdi.reconcile.verdict import REMAINS
from gsfdi.reconcile.verify import left_over

UNSEEN_SPEED = ("controller_derivative", "position_gain", "velocity_gain")
"""What makes the law's share of an unlogged speed seem too large or too small, unless the rate is fed forward, too."""
DELAYS = ("actuation_delay", "timestamp_latency")
"""What parts effort and motion in time: where no law ties a third to them, nobody knows which is late."""
SCALE = ("torque_constant_change", "output_inertia_change")
"""What makes a rigid joint answer more to the same effort."""
UNSEEN = 2 * LEAST
"""Log-likelihood that parameters must gain where neither a speed nor a law is known.

The noise of the effort is in what drives the model then, and fault-free joints gained up to 24.
"""
ONE_SIDED = ("coulomb_friction", "viscous_friction", "constant_load")
"""What friction that differs between the directions looks like in one of them."""
TRIFLE, NO_NEWS = 0.01, 0.001
"""Share of what parameters gain that one moved alone may leave, and where it is not off by more than it may be.

An inertia of 0.934 left 0.6 % on a joint of another simulator, and the next best 12 %, where four numbers that moved by
no more than they may left nothing. A torque constant of 0.948 left 0.03 %, the next best 23 %.
"""
APART, UNSEEN_APART = 3.0, 9.0
"""Log-likelihood by which one parameter moved alone must beat another to be told from it; and where neither a speed nor
a law is known: the right one fell 7 to 9 short of moving all there, where chance takes 2.5.
"""


def law_entries(case: Case) -> list[dict[str, Any]]:
    """Entries for what the law check found."""
    entries = []
    axis = case.nominal.axis
    for finding in case.findings:
        term = case.terms.get(finding.term)
        component = term.component if term is not None else "controller"
        first = next(iter(finding.values))
        numbers = {
            spelled(name, axis): {
                "value": value,
                "ci95": [value - 1.96 * finding.spread, value + 1.96 * finding.spread],
            }
            if name == first
            else {"value": value, "ci95": None}
            for name, value in finding.values.items()
        }
        use = TermUse(finding.term, dict(finding.values), None, finding.onset)
        entries.append(
            {
                "term": finding.term,
                "component": component,
                "side": None,
                "probability": probability_of(finding, case),
                "parameters": numbers,
                "onset_s": finding.onset,
                "says": sentence(use, term, finding.share, axis, ()),
            }
        )
    return entries


def ranked(found: Sequence[Name]) -> list[Name]:
    """Order names: the surest first, and among the sure ones the weightiest.

    A constant load that shared its probability with two exact twins came after a mode that explained 0 %.
    """
    return sorted(found, key=lambda name: -(round(name.certainty, 1) + 0.5 * name.share))


def term_entries(case: Case) -> list[dict[str, Any]]:
    """Entries for the terms that won."""
    entries = []
    axis = case.nominal.axis
    for name in ranked(case.found):
        says = sentence(name.use, case.terms[name.use.term], name.share, axis, name.close, name.is_on_either_side)
        entries.append(
            {
                "term": name.use.term,
                "component": case.terms[name.use.term].component,
                "side": name.use.side,
                "probability": name.probability,
                "parameters": {
                    spelled(key, axis): {"value": value, "ci95": list(name.ci[key]) if key in name.ci else None}
                    for key, value in name.use.values.items()
                },
                "onset_s": name.use.onset,
                "share_of_misfit": name.share,
                "says": says,
            }
        )
    return entries


def shift_entries(moved: Sequence[Shift]) -> list[dict[str, Any]]:
    """Entries for parameters of the linear model."""
    home = {"torque_constant_change": "motor", "motor_inertia_change": "motor", "stiffness_change": "gearbox"}
    return [
        {
            "term": s.term,
            "component": home.get(s.term, "link"),
            "side": None,
            "probability": s.probability,
            "parameters": {"ratio": {"value": s.ratio, "ci95": [s.low, s.high]}},
            "onset_s": None,
            "says": f"a number of the linear model is {100 * (s.ratio - 1):+.1f} % off; that is no missing physics.",
        }
        for s in moved
    ]


def parameters_of(case: Case, sole: float = SOLE) -> tuple[Case, list[Shift], list[Shift]]:
    """Parameters to name because they alone account for the mismatch, and where all parameters ended.

    Where one alone accounts for it, but for a log-likelihood of `sole`, the case is given back with that one moved, and
    no other; so it is where one leaves a trifle of all that parameters gain.
    """
    moved = shifts(case.hand)
    if case.found:
        return case, [s for s in moved if s.is_news and s.is_sure], moved
    plant = case.settled.model.plant
    doubted = case.settled.model.trust  # what the model itself calls uncertain is free to move
    names = {k.name for k in case.first.fitted.knobs if k.place == -1 and k.name in TERM_OF} - doubted.keys()
    nominal = {name: float(getattr(plant, name)) for name in sorted(names)}
    unseen = case.settled.law is None and not case.stand.sees_speed
    gain = all_kept(case.first, nominal) if nominal else 0.0
    gain_of = partial(all_kept, nominal=nominal)
    if gain < (UNSEEN if unseen else LEAST) or is_feigned(gain, case.first, case.settled, plant, gain_of):
        return case, [], moved
    news = [s for s in moved if s.is_news]
    apart = UNSEEN_APART if unseen else APART
    for leeway in (PINNED, SNUG) if news else (PINNED,):
        alone = lone_changes(case.first, nominal, leeway)
        lone, shift = alone[0], alone[0].shift
        needed = 0.003 if leeway == PINNED else shift.tolerance
        most = max(sole, (TRIFLE if shift.is_news else NO_NEWS) * gain)
        if lone.cost < most and not shift.low < 1 < shift.high and abs(shift.ratio - 1) > needed:
            others = others_than(lone, alone, likes_of(shift.term, case), apart)
            own = 1.0 - sum(other.probability for other in others)
            shift = replace(shift, probability=own, others=others, gain=gain)
            return replace(case, hand=around(case.first, lone.fitted)), [shift], [shift]
    return case, [replace(s, gain=gain) for s in news], moved


def others_than(lone: Lone, alone: Sequence[Lone], twins: Sequence[str], apart: float) -> tuple[Other, ...]:
    """What might account for everything in the place of one number: the other numbers, and what does the same.

    Parameters
    ----------
    lone : Lone
        The number that costs least.
    alone : sequence of Lone
        All of them.
    twins : sequence of str
        Sensors whose scale nothing tells from it.
    apart : float
        Log-likelihood by which another must fall behind to be told from it. Where that is more than `APART`, costs are
        larger than chance makes them, and count as much less.
    """
    costs = dict.fromkeys(twins, 0.0) | {one.shift.term: one.cost - lone.cost for one in alone if one is not lone}
    odds = {term: exp(-cost * APART / apart) for term, cost in costs.items()}
    odds |= dict.fromkeys(twins, UNLIKELY["sensor"])
    near, whole = max(apart, lone.cost), 1.0 + sum(odds.values())
    return tuple(Other(term, costs[term], odds[term] / whole, costs[term] < near) for term in costs)


def nearly_alone(case: Case) -> tuple[Case, list[Shift], float] | None:
    """One parameter that accounts for nearly all that the nominal simulation misses, where nothing else has a name.

    What is left may be how two simulators treat a joint that sticks: an inertia of 1.08 left 3 % of what the simulation
    had missed, and had no name for two terms that won and explained nothing.

    Returns
    -------
    Case
        With that one moved, and no other.
    list of Shift
        That one.
    float
        Share of the held-out misfit that is left.
    """
    bare = replace(case, hand=case.first, found=[])
    alone, lone, _ = parameters_of(bare, inf)
    if alone is bare or not lone:
        return None
    left = left_over(case.logged, case.nominal, alone.updated)
    return (alone, lone, left) if left <= REMAINS else None


def likes_of(term: str, case: Case) -> tuple[str, ...]:
    """Sensors whose scale does what a number of the plant does, where nothing but the model tells of either."""
    if term != SCALE[0] or case.settled.law is not None or case.stand.records[0].effort != "motor_current":
        return ()
    return ("current_gain",) if case.stand.sees_speed else ("current_gain", "position_gain")


def probability_of(finding: LawFinding, case: Case) -> float:
    """Probability of what was found of the law, shared with what the law cannot tell from it."""
    return finding.probability / (len(UNSEEN_SPEED) if is_speed_untold(finding, case) else 1)


def is_speed_untold(finding: LawFinding, case: Case) -> bool:
    """Whether nothing but the law tells of a speed whose share it found too large or too small, for whatever reason."""
    law = case.nominal.controller
    ahead = case.stand.lever > 0 and law is not None and law.rate_feedforward != 0
    return finding.term in UNSEEN_SPEED and not case.stand.sees_speed and not ahead


def groups_of(case: Case, lone: Sequence[Shift]) -> list[tuple[str, ...]]:
    """Sets of terms that the data cannot tell apart."""
    found = [(name.use.term, *name.close) for name in case.found if name.close]
    named = {name.use.term for name in case.found} | {finding.term for finding in case.findings}
    if any(is_speed_untold(finding, case) for finding in case.findings):
        found.append(UNSEEN_SPEED)
    elif case.stand.lever > 0 and "position_gain" in named:
        found.append(("position_gain", "velocity_gain"))  # a speed that the law told shows both
    found += [(shift.term, *shift.alike) for shift in lone if shift.alike]
    scaled = lone and case.nominal.structure == "rigid" and not case.nominal.physics
    if scaled and not any(set(SCALE) <= set(group) for group in found):
        found.append(SCALE)
    if case.settled.law is None and any(name.use.term == DELAYS[0] for name in case.found):
        found.append(DELAYS)
    if not case.stand.scales.returns and "asymmetric_friction" in case.terms:
        found += [(term, "asymmetric_friction") for term in ONE_SIDED if term in named]
    return found


def smallest_seen(case: Case, verdict: Outcome) -> list[dict[str, Any]]:
    """Lay out the least of every term that could have been named, where nothing was."""
    if verdict not in ("no_mismatch", "not_enough_data"):
        return []
    axis = case.nominal.axis
    return [
        {"term": s.term, "side": s.side, "parameters": {spelled(s.parameter, axis): s.value}}
        for s in case.contests[-1].smallest
    ]
