"""What the effort alone tells of a joint that a loop nobody knows holds at a crawl.

There innovations say nothing (see `gsfdi.reconcile.balance`), and the effort that each angle takes says it all. A
joint is taken to be so held where hardly any of its torque goes into inertia, and where what its motion makes of the
drive is lost in process noise as large as the drive itself; and to have told something where a wave of the motor's turn
is part of the answer, and the answer holds on the part that was kept for judging. Friction alone is better told by what
it does to a motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gsfdi.channels import CHANNELS
from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import evidence, locate, verify
from gsfdi.reconcile.balance import Balance, Part, balanced, least_seen
from gsfdi.reconcile.bench import Bench, drive_gain
from gsfdi.reconcile.calibrate import by_chance
from gsfdi.reconcile.crawl import WIDE, Rows, rows_of
from gsfdi.reconcile.gains import Opened
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.reconciliation import Outcome, Reconciliation
from gsfdi.reconcile.resistance import Law, laws
from gsfdi.reconcile.say import experiment, sentence, spelled, summary
from gsfdi.reconcile.surplus import merged, surplus
from gsfdi.reconcile.verdict import MATERIAL, PARTLY, REMAINS
from gsfdi.types import Array

LOUD = 0.5
"""Process noise, as a share of the drive's torque, from which the drive seems to move nothing."""
CRAWLING = 0.35
"""Share of the drive's torque that may go into inertia."""
WAVES = {"cogging", "torque_ripple"}


@dataclass(frozen=True, slots=True)
class Held:
    """A joint at a crawl.

    Parameters
    ----------
    stand : Bench
    nominal : JointModel
        As it was given.
    terms : mapping of str to PhysicsTerm
        The library.
    balance : Balance
        What was found.
    """

    stand: Bench
    nominal: JointModel
    terms: Mapping[str, PhysicsTerm]
    balance: Balance

    @property
    def parts(self) -> tuple[Part, ...]:
        """Laws that are worth a name: they hold on what was kept for judging."""
        return self.balance.parts if self._left(self.balance.parts) < PARTLY else ()

    @property
    def left(self) -> float:
        """Share of the missing torque that remains there."""
        return self._left(self.parts)

    def _left(self, parts: Sequence[Part]) -> float:
        return self.judged(self.missing(parts)) / self.judged(self.missing(()))

    def missing(self, parts: Sequence[Part]) -> list[Array]:
        """Torque that is missing beside some laws, by stretch, positive where it helps the motion [N m]."""
        return [sum((part.torque(crawl) for part in parts), -crawl.torque) for crawl in self.balance.rows.crawls]

    def judged(self, torque: Sequence[Array]) -> float:
        """Root mean square of a torque over what was kept for judging."""
        return rms([values[self.stand.kept(i)] for i, values in enumerate(torque)])

    @property
    def updated(self) -> JointModel:
        """The model with everything that was found in it."""
        uses = (part.law.use(part.coefficients) for part in self.parts)
        return merged(replace(self.nominal, physics=(*self.nominal.physics, *uses)))

    @property
    def verdict(self) -> Outcome:
        """What it comes to."""
        if self.parts:
            return "explained" if self.left <= REMAINS else "partly_explained"
        return "no_mismatch" if rms(self.missing(())) <= REMAINS * self.stand.scales.torque else "unexplained"

    @property
    def waves(self) -> bool:
        """Whether waves are at work, found or in the model already, and these slow enough to be seen."""
        known = [order <= self.balance.rows.top for order in orders_in(self.nominal)]
        return any(part.law.order > 0 for part in self.parts) or (bool(known) and all(known))


def told_by_effort(opened: Opened, nominal: JointModel, terms: Mapping[str, PhysicsTerm]) -> Reconciliation | None:
    """Reconcile a joint by the effort that its angles take; None where it is not held, or no waves are at work.

    Parameters
    ----------
    opened : Opened
        The recordings, and the model with its parameters fitted.
    nominal : JointModel
        As it was given.
    terms : mapping of str to PhysicsTerm
        The library.
    """
    if not may_be_held(opened):
        return None
    stand, model = opened.settled.stand, opened.settled.model
    least = MATERIAL * stand.scales.torque
    every = (rows_of(stand, model, wide) for wide in WIDE)
    balances = [balanced(rows, offered(rows, stand, model, terms), least) for rows in every if rows.told.any()]
    if not balances:
        return None
    balance = min(balances, key=lambda one: one.left)
    if rms([crawl.inertial for crawl in balance.rows.crawls]) > CRAWLING * stand.scales.torque:
        return None
    held = Held(stand, nominal, terms, balance)
    return answer(held) if held.waves else None


def may_be_held(opened: Opened) -> bool:
    """Whether nothing is known of a rigid joint's law, and it moves as if its drive did nothing, if not for waves."""
    settled = opened.settled
    unknown = settled.law is None and not settled.findings and settled.level == 0
    loud = bool(opened.first.torque[0] > LOUD * settled.stand.scales.torque)
    return unknown and settled.model.structure == "rigid" and (loud or bool(orders_in(settled.model)))


def orders_in(model: JointModel) -> list[float]:
    """Orders of the waves over a turn of the motor that a model holds."""
    return [use.values["order"] for use in model.physics if use.term in WAVES and "order" in use.values]


def offered(rows: Rows, stand: Bench, model: JointModel, terms: Mapping[str, PhysicsTerm]) -> list[Law]:
    """Lay out the laws of the library's terms that these motions can show."""
    effort = stand.records[0].effort
    amplifier = None if effort == "drive_torque" else drive_gain(model, effort)
    first = 1 if model.plant.gear_ratio != 1.0 else 2  # where both turn as one, a wave as slow is a weight's
    spare = {name: surplus(model, term, None) for name, term in terms.items()}
    every = laws(range(first, rows.top + 1), amplifier, spare)
    return [law for law in every if law.term in terms and model.axis in terms[law.term].axes]


def rms(values: Sequence[Array]) -> float:
    """Root mean square over all stretches."""
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2)))


def answer(held: Held) -> Reconciliation:
    """Lay out what was found."""
    stand, entries = held.stand, [entry(held, part) for part in held.parts]
    before, after = held.missing(()), held.missing(held.parts)
    groups = [*{frozenset(g): g for g in ((part.law.term, *part.alike) for part in held.parts) if len(g) > 1}.values()]
    first: dict[str, Any] = entries[0] if entries else {"component": None, "term": None}
    return Reconciliation(
        joint=stand.records[0].joint,
        verdict=held.verdict,
        mismatch={
            "detected": held.verdict != "no_mismatch",
            "p_value": by_chance(held.balance.surest, 1.0, len(held.balance.laws)),
            "effect": 1.0 - min(1.0, float(effort_floor(stand)[0]) / rms(before)) ** 2,
            "remains": held.left,
            "smallest_seen": smallest_seen(held) if held.verdict == "no_mismatch" else [],
            **locate.shares(stand, before, after),
        },
        location=locate.location(stand, before, first["component"], first["term"]),
        omitted_physics=tuple(entries),
        indistinguishable=tuple(groups),
        parameters={},
        fit=fit(held),
        says=summary(held.verdict, entries, held.left)
        + " No law of the controller is known, and hardly any torque goes into inertia: this was told from the effort"
        " that each angle of the motor takes.",
        updated_model=held.updated if entries else None,
        evidence=shown(held, groups),
    )


def smallest_seen(held: Held) -> list[dict[str, Any]]:
    """Lay out the least of every term that would have been named."""
    axis = held.stand.model.axis
    return [
        {"term": term, "side": None, "parameters": {spelled(name, axis): value}}
        for term, (name, value) in least_seen(held.balance.rows, held.balance.laws).items()
    ]


def entry(held: Held, part: Part) -> dict[str, Any]:
    """Lay out one term."""
    law, axis, gains = part.law, held.stand.model.axis, [other.gain for other in held.parts]
    use, intervals, share = law.use(part.coefficients), part.intervals(), part.gain / sum(gains)
    return {
        "term": law.term,
        "component": held.terms[law.term].component,
        "side": None,
        "probability": probability(held, part),
        "parameters": {
            spelled(name, axis): {"value": value, "ci95": list(intervals[name]) if name in intervals else None}
            for name, value in use.values.items()
        },
        "onset_s": None,
        "share_of_misfit": share,
        "says": sentence(use, held.terms[law.term], share, axis, part.alike),
    }


def probability(held: Held, part: Part) -> float:
    """Probability of a term: where others do as well, theirs is as large."""
    return (1.0 - by_chance(part.gain, 1.0, len(held.balance.laws))) / (1 + len(part.alike))


def fit(held: Held) -> dict[str, Any]:
    """Held-out figures: the effort that the recorded motion takes, and the position that the recorded effort makes."""
    stand, (effort, gain) = held.stand, effort_of(held)
    before, after = verify.misfit(stand, held.nominal), verify.misfit(stand, held.updated)
    return {
        "held_out_seconds": list(stand.held_out),
        "before": {effort: held.judged(held.missing(())) / gain, **before},
        "after": {effort: held.judged(held.missing(held.parts)) / gain, **after},
        "noise_floor": dict(verify.noise_floor(stand, [effort, *before])),
    }


def effort_of(held: Held) -> tuple[str, float]:
    """Column of the drive's effort, and torque per unit of it."""
    channel = held.stand.records[0].effort
    return CHANNELS[channel].column(held.stand.model.axis), drive_gain(held.stand.model, channel)


def shown(held: Held, groups: Sequence[Sequence[str]]) -> dict[str, Any]:
    """Gather everything that the page draws."""
    stand, (effort, gain) = held.stand, effort_of(held)
    before, after = held.missing(()), held.missing(held.parts)
    first = next(i for i in range(len(stand.records)) if stand.kept(i).any())
    record, part = stand.records[first], stand.kept(first)
    seen = record[record.effort]
    overlay = {
        "name": effort,
        "t": record.t[part],
        "recorded": seen[part],
        "before": (seen + before[first] / gain)[part],
        "after": (seen + after[first] / gain)[part],
    }
    return {
        "overlays": [overlay, *evidence.overlays(stand, held.nominal, held.updated)],
        "profiles": evidence.profiles(stand, before, after),
        "maps": evidence.maps(stand, before, after),
        "ranking": ranking(held),
        "experiments": [experiment(group) for group in groups],
    }


def ranking(held: Held) -> list[dict[str, Any]]:
    """Hypotheses in order, each with what decided for or against it."""
    found = []
    for part in held.parts:
        chance = probability(held, part)
        why = f"joined the model: {part.gain:.0f} in log-likelihood goes without it"
        found.append({"term": part.law.term, "side": None, "probability": chance, "why": why})
        why = f"in the place of {part.law.term}: cannot be told apart on this motion"
        found += [{"term": term, "side": None, "probability": chance, "why": why} for term in part.alike]
    for law, gain in held.balance.lost:
        why = f"would gain {gain:.1f} in log-likelihood, or is too small to matter"
        found.append({"term": law.term, "side": None, "probability": 0.0, "why": why})
    return found
