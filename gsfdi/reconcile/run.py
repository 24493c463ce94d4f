"""Reconcile one joint: settle the contract, let terms compete, name them, verify on held-out data, and say it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from gsfdi.fit import Started
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import locate, verify
from gsfdi.reconcile.bench import Bench, effort_floor
from gsfdi.reconcile.calibrate import by_chance
from gsfdi.reconcile.compete import Contest, compete
from gsfdi.reconcile.contract import Settled, settle_contract
from gsfdi.reconcile.enough import hardly_moves, is_blind, nothing_told
from gsfdi.reconcile.evidence import evidence_of
from gsfdi.reconcile.hand import Round, is_sensor
from gsfdi.reconcile.judge import CLOSE, Name, names, torque_left, white_left
from gsfdi.reconcile.parameters import Shift, all_kept, lone_changes, shifts
from gsfdi.reconcile.reconciliation import Outcome, Reconciliation
from gsfdi.reconcile.say import sentence, spelled
from gsfdi.reconcile.screen import LEAST
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.reconcile.surplus import merged
from gsfdi.reconcile.twin import left_by_twin
from gsfdi.registry import shelf
from gsfdi.types import Array, JointRecord

REMAINS = 0.12
"""Share of the missing torque (root mean square) that may remain when a mismatch is called explained."""
PARTLY = 0.6
"""Share of the mismatch that may remain when what was found is worth a name."""
MATERIAL = 0.01
"""Share of the drive's torque below which a mismatch without a name is not worth reporting."""


def reconcile(records: Sequence[JointRecord], model: JointModel, *, without: Sequence[str] = ()) -> Reconciliation:
    """Reconcile recordings of one joint with its model.

    Parameters
    ----------
    records : sequence of JointRecord
        Recordings of one joint, of like or unlike motion.
    model : JointModel
        The simulation that they are held against.
    without : sequence of str
        Terms that the library must do without.
    """
    if hardly_moves(records, model):
        says = "The joint stands still in these recordings: nothing can be told from them. Record a motion."
        return nothing_told(records[0].joint, says)
    terms = {name: term for name, term in shelf("gsfdi.terms", PhysicsTerm).items() if name not in without}
    settled = settle_contract(records, model, without)
    first, hand, contests = compete(settled.stand, settled.model, terms, settled.level)
    hand, found = names(hand, len(settled.model.physics), contests, terms)
    return _told(_Case(records[0].joint, model, settled, first, hand, contests, found, terms))


@dataclass(frozen=True, slots=True)
class _Case:
    """Everything that the answer is told from."""

    joint: str
    nominal: JointModel
    settled: Settled
    first: Round
    hand: Round
    contests: list[Contest]
    found: list[Name]
    terms: Mapping[str, PhysicsTerm]

    @property
    def stand(self) -> Bench:
        return replace(self.settled.stand, window=self.hand.stand.window)

    @property
    def logged(self) -> Bench:
        """The recordings as they came, with the part that took no part in choosing and fitting."""
        return replace(self.settled.logged, window=self.hand.stand.window)

    @property
    def floor(self) -> Array:
        return effort_floor(self.stand)


def _told(case: _Case) -> Reconciliation:
    """Draw the verdict and lay out the answer."""
    stand = case.stand
    lone, moved = _parameters(case)
    findings = [
        *(case.settled.law.findings if case.settled.law else ()),
        *([case.settled.coarse] if case.settled.coarse else []),
    ]
    entries = [*_law_entries(case, findings), *_term_entries(case), *_shift_entries(lone)]
    left = _left(case)
    remains = float(np.sqrt(np.sum(case.hand.torque**2))) / stand.scales.torque
    verdict = _verdict(case, entries, left, remains)
    if verdict == "unexplained":  # what only looked like the nearest is no name; it stays in the ranking
        entries = _law_entries(case, findings)
    model = final_model(case, lone)
    before = locate.torque_of(case.first.stand, [e[0] for e in case.first.stand.innovations([case.settled.model])])
    after = locate.torque_of(case.hand.stand, case.hand.innovations)
    groups = _groups(case, lone)
    moved_off = bool(entries) or verdict in ("unexplained", "partly_explained")
    fit = _fit(case, model)
    return Reconciliation(
        joint=case.joint,
        verdict=verdict,
        mismatch={
            "detected": moved_off,
            "p_value": _p_value(case, entries),
            "effect": max(0.0, 1.0 - noise_share_of(case)),
            "remains": left,
            "smallest_seen": _smallest_seen(case, verdict),
            **locate.shares(stand, before, after),
        },
        location=_location(case, entries, before),
        omitted_physics=tuple(entries),
        indistinguishable=tuple(groups),
        parameters={s.term: {"ratio": s.ratio, "ci95": [s.low, s.high]} for s in moved},
        fit=fit,
        says=_says(verdict, entries, case, left),
        updated_model=model if verdict in ("explained", "partly_explained") else None,
        evidence=evidence_of(case, model, before, after, groups),
    )


def _left(case: _Case) -> float:
    """Share of the mismatch that remains.

    As torque where torque is missing; but its noise is known on a coarse scale only, on which a faint effect makes no
    step, so that white innovations have the last word on what is not explained.
    """
    if any(is_sensor(name.use.term) for name in case.found):
        return white_left(case.first, case.hand, case.floor)
    left = torque_left(case.first, case.hand, case.floor)
    if left <= REMAINS:
        return left
    return min(left, max(REMAINS + 0.01, white_left(case.first, case.hand, case.floor)))


def _smallest_seen(case: _Case, verdict: Outcome) -> list[dict[str, Any]]:
    """Lay out the least of every term that would have been named, where nothing was."""
    if verdict not in ("no_mismatch", "not_enough_data"):
        return []
    axis = case.nominal.axis
    return [
        {"term": s.term, "side": s.side, "parameters": {spelled(s.parameter, axis): s.value}}
        for s in case.contests[-1].smallest
    ]


def noise_share_of(case: _Case) -> float:
    """Share of the parameters-only residual that noise alone makes up."""
    first, floor = float(np.sum(case.first.torque**2)), float(np.sum(case.floor**2))
    return min(1.0, floor / first) if first > 0 else 1.0


def _parameters(case: _Case) -> tuple[list[Shift], list[Shift]]:
    """Parameters to name because they alone account for the mismatch, and where all parameters ended."""
    moved = shifts(case.hand)
    if case.found:
        return [s for s in moved if s.is_news and s.is_sure], moved
    plant = case.settled.model.plant
    doubted = case.settled.model.trust  # what the model itself calls uncertain is free to move
    names = {k.name for k in case.first.fitted.knobs if k.place == -1} - doubted.keys()
    nominal = {name: float(getattr(plant, name)) for name in sorted(names)}
    if not nominal or all_kept(case.first, nominal) < LEAST:
        return [], moved
    alone = lone_changes(case.first, nominal)
    cost, shift = alone[0]
    if cost < SOLE and not shift.low < 1 < shift.high and abs(shift.ratio - 1) > 0.003:
        return [shift], moved
    return [s for s in moved if s.is_news], moved


SOLE = 12.0
"""Log-likelihood that moving one parameter alone may fall short of moving all."""


def _law_entries(case: _Case, findings: Sequence[LawFinding]) -> list[dict[str, Any]]:
    """Entries for what the law check found."""
    entries = []
    axis = case.nominal.axis
    for finding in findings:
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
                "probability": 0.99,
                "parameters": numbers,
                "onset_s": finding.onset,
                "says": sentence(use, term, finding.share, axis, ()),
            }
        )
    return entries


def _term_entries(case: _Case) -> list[dict[str, Any]]:
    """Entries for the terms that won, most probable first and among the sure ones the weightiest."""
    entries = []
    axis = case.nominal.axis
    for name in sorted(case.found, key=lambda n: -(round(n.probability, 1) + 0.5 * n.share)):
        close = [r.use.term for r in name.rivals if r.probability > CLOSE * name.probability]
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
                "says": sentence(name.use, case.terms[name.use.term], name.share, axis, list(dict.fromkeys(close))),
            }
        )
    return entries


def _shift_entries(moved: Sequence[Shift]) -> list[dict[str, Any]]:
    """Entries for parameters of the linear model."""
    home = {"torque_constant_change": "motor", "motor_inertia_change": "motor", "stiffness_change": "gearbox"}
    return [
        {
            "term": s.term,
            "component": home.get(s.term, "link"),
            "side": None,
            "probability": 0.95,
            "parameters": {"ratio": {"value": s.ratio, "ci95": [s.low, s.high]}},
            "onset_s": None,
            "says": f"a number of the linear model is {100 * (s.ratio - 1):+.1f} % off; that is no missing physics.",
        }
        for s in moved
    ]


AS_MUCH = 2.0
"""What may remain, over what a simulated twin leaves, before a mismatch is seen in it."""
APART = 0.03
"""Share of the time by which two things set in apart from each other."""
CONSTANTS = ("torque_constant_change", "torque_constant_drift", "current_gain")
"""Terms that each say how much torque an ampere makes."""


def _verdict(case: _Case, entries: Sequence[Mapping[str, Any]], left: float, remains: float) -> Outcome:
    """Draw the verdict from what was named and what remains."""
    known = float(np.sqrt(np.sum(case.floor**2))) / case.stand.scales.torque
    material = remains > max(MATERIAL, 3 * known)
    if not entries:
        if material and remains > AS_MUCH * left_by_twin(case.first, case.nominal):
            return "unexplained"
        return "not_enough_data" if is_blind(case.first) else "no_mismatch"
    piled = [name.use.term for name in case.found if name.use.term in CONSTANTS]
    onsets = [name.use.onset for name in case.found if name.use.onset is not None]
    scattered = len(onsets) > 1 and max(onsets) - min(onsets) > APART * case.stand.scales.seconds
    if len(piled) > 1 or scattered:
        # a motor whose constant changes twice has another law than any of these, and so has a joint in which one
        # thing after another sets in within one recording
        return "partly_explained"
    if left <= REMAINS or remains <= 2 * known or not (case.found or material):
        return "explained"
    return "partly_explained" if left < PARTLY else "unexplained"


def final_model(case: _Case, lone: Sequence[Shift]) -> JointModel:
    """Give the model with everything that was found in it, as a plain model file holds it."""
    source: JointModel = case.hand.fitted.model
    if isinstance(source, Started):
        source = JointModel(**{f.name: getattr(source, f.name) for f in fields(JointModel)})
    given = len(case.settled.model.physics)
    if case.settled.level > 0:  # the constant of a recomputed effort belongs to the recording, not to the joint
        source = replace(source, physics=(*source.physics[: given - 1], *source.physics[given:]))
    late = [f for f in (case.settled.law.findings if case.settled.law else ()) if f.term == "timestamp_latency"]
    extra = [
        TermUse(f.term, dict(f.values), None, f.onset)
        for f in [*late, *([case.settled.coarse] if case.settled.coarse else [])]
    ]
    return merged(replace(source, sensors=case.nominal.sensors, physics=(*source.physics, *extra)))


def _groups(case: _Case, lone: Sequence[Shift]) -> list[tuple[str, ...]]:
    """Sets of terms that the data cannot tell apart."""
    found = []
    for name in case.found:
        close = [r.use.term for r in name.rivals if r.probability > CLOSE * name.probability]
        group = tuple(dict.fromkeys([name.use.term, *close]))
        if len(group) > 1:
            found.append(group)
    if lone and case.nominal.structure == "rigid" and not case.nominal.physics:
        found.append(("torque_constant_change", "output_inertia_change"))
    return found


def _p_value(case: _Case, entries: Sequence[Mapping[str, Any]]) -> float:
    """Probability that chance alone gains as much as the first winner did."""
    contest = case.contests[0]
    if not contest.entries or not np.isfinite(contest.entries[0].gain):
        return 1.0
    best = contest.entries[0]
    return by_chance(best.gain, best.inflation, contest.trials)


def _location(case: _Case, entries: Sequence[Mapping[str, Any]], torque: Sequence[Array]) -> dict[str, Any]:
    """Lay out where and when the mismatch lives."""
    stand = case.stand
    onset = next((e["onset_s"] for e in entries if e.get("onset_s") is not None), None)
    drift = next((e["parameters"]["onset_s"]["value"] for e in entries if "onset_s" in e["parameters"]), None)
    begins = onset if onset is not None else drift
    when = [(float(begins), float(stand.scales.seconds))] if begins is not None else locate.moments(stand, torque)
    component = entries[0]["component"] if entries else locate.component_of(case.contests, case.settled)
    return {
        "component": component,
        "signals": locate.signals_of(component, stand),
        "where": [
            {
                "covariate": p.covariate,
                "low": p.low,
                "high": p.high,
                "share_of_misfit": p.share,
                "share_of_time": p.time,
            }
            for p in locate.places(stand, torque)
        ],
        "when": [{"from_s": a, "to_s": b} for a, b in when],
        "bands_hz": [list(band) for band in locate.bands(stand, torque)],
    }


def _fit(case: _Case, model: JointModel) -> dict[str, Any]:
    """Held-out figures of the nominal and the updated model."""
    stand = case.logged
    before = verify.misfit(stand, case.nominal)
    after = verify.misfit(stand, model)
    return {
        "held_out_seconds": list(stand.held_out),
        "before": before,
        "after": after,
        "noise_floor": dict(verify.noise_floor(stand, list(after))),
    }


def _says(verdict: Outcome, entries: Sequence[Mapping[str, Any]], case: _Case, left: float) -> str:
    """One sentence for a person."""
    named = ", ".join(str(e["term"]).replace("_", " ") for e in entries)
    if verdict == "no_mismatch":
        return "Simulation and recording agree to within noise and the tolerance of the model's numbers."
    if verdict == "not_enough_data":
        return "The recordings hardly move the joint: not even its inertia shows in them, and nothing else would."
    if verdict == "unexplained" and not entries:
        return "Simulation and recording differ, and nothing in the library accounts for it; the location still stands."
    if verdict == "explained":
        return f"The mismatch is explained by {named}."
    return f"{named} account for part of the mismatch; {100 * left:.0f} % of the missing torque remains unexplained."
