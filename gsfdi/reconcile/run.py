"""Reconcile one joint: settle the contract, let terms compete, name them, verify on held-out data, and say it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import locate, verify
from gsfdi.reconcile.calibrate import by_chance
from gsfdi.reconcile.case import Case
from gsfdi.reconcile.compete import DETAIL, MAIN, compete, resumed
from gsfdi.reconcile.contest import Contest, undecided
from gsfdi.reconcile.contract import Settled
from gsfdi.reconcile.enough import hardly_moves, nothing_told
from gsfdi.reconcile.entries import (
    groups_of,
    law_entries,
    nearly_alone,
    parameters_of,
    shift_entries,
    smallest_seen,
    term_entries,
)
from gsfdi.reconcile.evidence import evidence_of
from gsfdi.reconcile.finalists import merit
from gsfdi.reconcile.gains import settle_law
from gsfdi.reconcile.hand import Round, leaves_nothing
from gsfdi.reconcile.held import told_by_effort
from gsfdi.reconcile.judge import names
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.offering import all_offers
from gsfdi.reconcile.parameters import Shift
from gsfdi.reconcile.reconciliation import Outcome, Reconciliation
from gsfdi.reconcile.say import bent, rewritten, summary, timed, varying
from gsfdi.reconcile.screen import screen
from gsfdi.reconcile.sensing import as_shown
from gsfdi.reconcile.signs import bent_by_law, varies
from gsfdi.reconcile.ticks import shift_of
from gsfdi.reconcile.together import together
from gsfdi.reconcile.twin import gain_of_term, is_feigned
from gsfdi.reconcile.verdict import PARTLY, is_hopeless, left_of, verdict_of
from gsfdi.reconcile.verify import left_over
from gsfdi.registry import shelf
from gsfdi.types import Array, JointRecord

HELD_OUT = "held-out misfit"


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
    seen = as_shown(records, model)
    opened = settle_law(records, seen, terms, without)
    held = told_by_effort(opened, model, terms)
    if held is not None:
        return held
    settled = opened.settled
    first, hand, contests = compete(opened.first, opened.model, terms, settled.level)
    if is_noise(first, contests[0], settled, terms):
        offers = all_offers(first, terms, len(settled.model.physics))
        hand, contests = first, [undecided(first, screen(first, offers), contests[0].entries, terms)]
    case = Case(records[0].joint, model, settled, first, hand, contests, [], terms)
    given, left = len(settled.model.physics), left_of(case)
    told = () if is_hopeless(case, left) else contests  # of what is no name nobody asks what else it may be
    thorough = left <= DETAIL or len(hand.fitted.model.physics) < given + MAIN
    named, found = names(hand, given, told, terms, settled.findings, thorough)
    if told and is_renamed(hand, named, given):
        hand, contests = resumed(first, named, contests, terms, given)
        named, found = names(hand, given, contests, terms, settled.findings, thorough)
    return _told(replace(case, hand=named, contests=contests, found=found))


def is_renamed(hand: Round, named: Round, given: int) -> bool:
    """Whether a term has come into the place of another since, and something is left yet."""
    before, after = ({use.term for use in one.fitted.model.physics[given:]} for one in (hand, named))
    return not after <= before and not leaves_nothing(named, effort_floor(named.stand))


def is_noise(first: Round, contest: Contest, settled: Settled, terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether a faint winner may be the work of noise."""
    winner = contest.winner
    if winner is None:
        return False
    gain_of = partial(gain_of_term, term=terms[winner.offer.term])
    return is_feigned(merit(winner), first, settled, first.fitted.model.plant, gain_of)


def _told(case: Case) -> Reconciliation:
    """Draw the verdict and lay out the answer."""
    case, lone, moved = parameters_of(case)
    stand = case.stand
    entries = [*law_entries(case), *term_entries(case), *shift_entries(lone)]
    left = left_of(case)
    verdict = verdict_of(case, entries, left)
    said = told_of(case, verdict, left)
    if verdict == "unexplained":  # what only looked like the nearest is no name; it stays in the ranking
        entries = law_entries(case)
        if (number := None if entries else nearly_alone(case)) is not None:
            case, lone, left = number
            entries, moved, verdict, said = shift_entries(lone), lone, "partly_explained", (left, HELD_OUT)
    model = case.updated
    before = locate.torque_of(case.first.stand, [e[0] for e in case.first.stand.innovations([case.settled.model])])
    after = locate.torque_of(case.hand.stand, case.hand.innovations)
    groups = groups_of(case, lone)
    moved_off = bool(entries) or verdict in ("unexplained", "partly_explained")
    fit = _fit(case, model)
    anew = rewritten(case.settled.model.physics, case.hand.fitted.model.physics, case.nominal.axis)
    says = summary(verdict, entries, *said) + bent(bent_by_law(case) if entries else []) + anew
    says += varying(varies(case) if entries and verdict == "partly_explained" else [])
    return Reconciliation(
        joint=case.joint,
        verdict=verdict,
        mismatch={
            "detected": moved_off,
            "p_value": _p_value(case, lone),
            "effect": _effect(case, lone, before, after),
            "remains": left,
            "smallest_seen": smallest_seen(case, verdict),
            **locate.shares(stand, before, after),
        },
        location=_location(case, entries, before),
        omitted_physics=tuple(entries),
        indistinguishable=tuple(groups),
        parameters={s.term: {"ratio": s.ratio, "ci95": [s.low, s.high]} for s in moved},
        fit=fit,
        says=says + timed(shift_of(case.hand.fitted.model)),
        updated_model=model if verdict in ("explained", "partly_explained") or anew else None,
        together=tuple(together(case.hand, len(case.settled.model.physics))) if entries else (),
        evidence=evidence_of(case, model, before, after, groups, lone),
    )


def told_of(case: Case, verdict: Outcome, left: float) -> tuple[float, str]:
    """Share that remains, and of what: held-out misfits, where these alone say that part is explained."""
    if verdict == "partly_explained" and left >= PARTLY:
        return left_over(case.logged, case.refitted, case.updated), HELD_OUT
    return left, "missing torque"


def _effect(case: Case, lone: Sequence[Shift], before: Sequence[Array], after: Sequence[Array]) -> float:
    """Share of the mismatch above its noise: beside parameters, or what those that are named take off the whole."""
    was, remains = (float(sum(part @ part for part in parts)) for parts in (before, after))
    taken = max(1.0 - remains / was, 0.0) if lone and was > 0 else 0.0
    return max([1.0 - case.noise_share, taken, *(f.share for f in case.findings)])


def _p_value(case: Case, lone: Sequence[Shift]) -> float:
    """Probability that chance alone gains as much as the first winner did, or what is wrong of law, values or plant."""
    surest = max([0.0, *(f.gain for f in case.findings), *(s.gain for s in lone)])
    if surest > 0.0:
        return float(np.exp(-surest))
    contest = case.contests[0]
    if not contest.entries or not np.isfinite(contest.entries[0].gain):
        return 1.0
    best = contest.entries[0]
    return by_chance(best.gain, best.inflation, contest.trials)


def _location(case: Case, entries: Sequence[Mapping[str, Any]], torque: Sequence[Array]) -> dict[str, Any]:
    """Lay out where and when the mismatch lives."""
    onset = next((e["onset_s"] for e in entries if e.get("onset_s") is not None), None)
    drift = next((e["parameters"]["onset_s"]["value"] for e in entries if "onset_s" in e["parameters"]), None)
    begins = onset if onset is not None else drift
    if begins is None and entries and entries[0]["term"] in {f.term for f in case.findings}:
        begins = 0.0  # a law or a sensor that is wrong is so throughout
    component = entries[0]["component"] if entries else locate.component_of(case.contests, case.settled)
    return locate.location(case.stand, torque, component, entries[0]["term"] if entries else None, begins)


def _fit(case: Case, model: JointModel) -> dict[str, Any]:
    """Held-out figures of the nominal and the updated model."""
    stand = case.logged
    before = verify.misfit(stand, case.nominal)
    after = verify.misfit(stand, model)
    return {
        "held_out_seconds": list(stand.held_out),
        "before": before,
        "after": after,
        "noise_floor": dict(verify.felt_noise(stand, model, list(after))),
    }
