"""What is settled before physics is blamed: the controller's law, the clock, and the resolution of the values."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np
from scipy.interpolate import CubicSpline

from gsfdi.model import JointModel, TermUse
from gsfdi.reconcile.bench import Bench, bench
from gsfdi.reconcile.driving import driven_by, with_effort_noise
from gsfdi.reconcile.law import COARSE, LawCheck, check_law
from gsfdi.reconcile.sensing import grain_of
from gsfdi.reconcile.sheet import LawFinding, joined
from gsfdi.reconcile.told import GAINS, is_telling
from gsfdi.types import Array, JointRecord, Mask

LATE = "timestamp_latency"
PART = 0.02
"""Part of a tick by which stamps may be late as if by whole ones."""
REVERSED = 0.1
"""Share of the misfit that remains where an effort of the wrong sign is turned round, at most."""


@dataclass(frozen=True, slots=True)
class Settled:
    """Records and model with what was found put right.

    Parameters
    ----------
    stand : Bench
        Set up for the records and the model below.
    logged : Bench
        Set up for the records as they came: what a simulation is judged by.
    model : JointModel
        With the faults of effort sensor, limit and gains in it; their terms come after the nominal's own.
    law : LawCheck or None
    shown : tuple of LawFinding
        What the values themselves show: a position sensor coarser than its model says, a drive that runs backwards.
    level : float
        Standard deviation of the constant that a recomputed effort begins with [N m]. Where it is not 0, the last terms
        of `model` are constant loads that stand for it, one for each stretch that begins with a constant of its own.
    """

    stand: Bench
    logged: Bench
    model: JointModel
    law: LawCheck | None
    shown: tuple[LawFinding, ...]
    level: float = 0.0

    def as_logged(self, model: JointModel) -> JointModel:
        """Give `model` with sensors as the log shows them; a told speed is noisier than the loop's."""
        return replace(model, sensors=self.logged.model.sensors)

    @property
    def findings(self) -> list[LawFinding]:
        """What the law check and the values themselves told, but for gains that are off by no more than a tick does.

        A tick makes no law that leaves nothing but noise then, nor does it scale the way that a told speed goes against
        that of the positions: so little of what was found first, or of the position's gain, has its name.
        """
        law = self.law.findings if self.law else ()
        exact = self.law is not None and self.law.is_exact and self.stand.sees_speed
        scaled = "position_gain" if self.stand.lever > 0 else None
        first, rest = (law[:1], law[1:]) if exact else ((), law)
        named = (f for f in rest if f.term == scaled or abs(f.values.get("ratio", np.inf) - 1.0) > COARSE)
        return [*first, *named, *self.shown]


@dataclass(frozen=True)
class Read:
    """What the log itself tells of the contract, before anything else is known to be wrong of the law.

    Parameters
    ----------
    records : sequence of JointRecord
        As they came.
    stand : Bench
        Set up for these, with the noise of the effort that the law leaves.
    without : sequence of str
        Terms that must not be found.
    coarse : LawFinding or None
        A position sensor coarser than its model says.
    law : LawCheck or None
    """

    records: Sequence[JointRecord]
    stand: Bench
    without: Sequence[str]
    coarse: LawFinding | None
    law: LawCheck | None

    @property
    def stamps(self) -> list[LawFinding]:
        """Late stamps that the law tells beside a logged speed."""
        if self.law is None or not self.stand.sees_speed:
            return []
        return [f for f in self.law.findings if f.term == LATE]

    @cached_property
    def unseen(self) -> "Read | None":
        """The same log without its speed, where the law tells more of that."""
        if self.law is None or not is_between_ticks(self.stamps, self.law, self.stand.model):
            return None
        return read_log([without_speed(r) for r in self.records], self.stand.model, self.without)


def read_log(records: Sequence[JointRecord], model: JointModel, without: Sequence[str]) -> Read:
    """Check the law and the values; for the arguments see `settle_contract`."""
    stand = bench(records, model)
    coarse = None if "quantisation" in without else coarseness(stand)
    # slopes of coarse positions are no speed to hold a law against
    law = None if coarse is not None and not stand.sees_speed else check_law(stand.records, model)
    if law is not None:
        law = replace(law, findings=tuple(f for f in law.findings if f.term not in without))
        stand = replace(stand, model=with_effort_noise(model, law, stand))
    return Read(records, stand, without, coarse, law)


def settle_contract(
    records: Sequence[JointRecord], model: JointModel, without: Sequence[str], beyond: Sequence[LawFinding] = ()
) -> Settled:
    """Check the law and the values, and set up the bench with what they say.

    Parameters
    ----------
    records : sequence of JointRecord
    model : JointModel
    without : sequence of str
        Terms that must not be found.
    beyond : sequence of LawFinding
        What else is known to be wrong of a law that tells the speed (see `gsfdi.reconcile.gains`).
    """
    return settled_by(read_log(records, model, without), beyond)


def settled_by(read: Read, beyond: Sequence[LawFinding]) -> Settled:
    """Set up the bench with what the log told; for the rest see `settle_contract`."""
    if read.unseen is not None:
        unseen = settled_by(read.unseen, (*read.stamps, *beyond))
        if unseen.stand.lever > 0:
            return replace(unseen, logged=read.stand)
    records, stand, model, law = read.records, read.stand, read.stand.model, read.law
    telling = law is not None and not stand.sees_speed and is_telling(law, model)
    if law is not None and telling:
        kept = tuple(f for f in law.findings if f.term not in GAINS or f.values.get("ratio", 1.0) < 0)
        law = reduce(corrected_law, beyond, replace(law, findings=kept))
    backwards = None if law is not None or "current_gain" in read.without else reversal(stand)
    new = model if backwards is None else corrected(model, backwards)
    if law is not None and model.controller is not None:
        age = max(law.derivative_delay, model.controller.derivative_delay)
        heard = replace(model.controller, derivative_delay=age, integral_rule=law.integral_rule)
        new = model if heard == model.controller else replace(model, controller=heard)
    for finding in law.findings if law is not None else ():
        new = corrected(new, finding)
    late = sum(f.values["delay_s"] for f in law.findings if f.term == LATE) if law is not None else 0.0
    if late > 0:
        records = [advanced(record, late) for record in records]
        stand = bench(records, model)
    if read.coarse is not None:
        new = replace(new, sensors=replace(new.sensors, position_resolution=read.coarse.values["step_rad"]))
    driving = driven_by(stand, new, law, telling)
    if driving.records is not None or driving.model is not model:
        measured = bench(driving.records or records, driving.model, driving.lever)
        stand = replace(measured, count=stand.count)  # stretches are no recordings
    stand = replace(stand, learnt=driving.learnt, looped=driving.looped)
    shown = tuple(f for f in (backwards, read.coarse) if f is not None)
    return Settled(stand, read.stand, driving.model, law, shown, driving.level)


def is_between_ticks(stamps: Sequence[LawFinding], law: LawCheck, model: JointModel) -> bool:
    """Whether measurements are late by a part of a tick, so that what the log holds is not what the law had.

    A speed with the noise of another moment, and with kinks at the ticks that nothing can be drawn through, tells less
    than the law does: a motor that answers later, and has more inertia, took the place of its noise. A tick and 1/200
    is no whole one either; there the law leaves more than noise, and the motor's inertia came out 1.9 times itself.
    """
    if not stamps or model.controller is None:
        return False
    ticks = sum(f.values["delay_s"] for f in stamps) * model.controller.sample_rate
    return abs(ticks - round(ticks)) > PART or not law.is_exact


def without_speed(record: JointRecord) -> JointRecord:
    """Give a record as if no speed had been logged."""
    channels = {name: record[name] for name in record.channels if name not in ("motor_velocity", "joint_velocity")}
    return replace(record, channels=channels, valid={})


def corrected_law(law: LawCheck, finding: LawFinding) -> LawCheck:
    """Add to what was found of a law; the age of its speed is no fault but part of it."""
    if finding.term == "derivative_delay":
        return replace(law, derivative_delay=finding.values["delay_s"])
    return replace(law, findings=joined(law.findings, finding))


def corrected(model: JointModel, finding: LawFinding) -> JointModel:
    """Put what the law check found into `model`; a late stamp is put right in the records instead."""
    if finding.term.startswith("controller_"):
        assert model.controller is not None
        name = finding.term.removeprefix("controller_")
        value = getattr(model.controller, name) * finding.values["ratio"]
        return replace(model, controller=replace(model.controller, **{name: value}))
    if finding.term == LATE:
        return model
    if finding.term == "current_limit" and finding.windup != "goes_on" and model.controller is not None:
        limit = min(model.controller.limit, finding.values["limit_a"])
        model = replace(model, controller=replace(model.controller, limit=limit))
    return replace(model, physics=(*model.physics, TermUse(finding.term, dict(finding.values), None, finding.onset)))


def advanced(record: JointRecord, late: float) -> JointRecord:
    """Give a record whose measurements are moved to where they belong, `late` [s] before their stamp.

    There are none where a row is missing: a speed has kinks at the ticks that nothing can be drawn through.
    """
    keep = record.t + late <= record.t[-1]
    t, period = record.t[keep], float(np.median(np.diff(record.t)))
    channels = {}
    for name in record.channels:
        values = record[name]
        good = np.isfinite(values)
        if name in ("position", "motor_velocity", "joint_velocity") and good.sum() > 3:
            seen = is_between(t + late, record.t[good], period)
            channels[name] = np.where(seen, CubicSpline(record.t[good], values[good])(t + late), np.nan)
        else:
            channels[name] = values[keep]
    return replace(record, t=t, channels=channels, valid={})


def is_between(moments: Array, t: Array, period: float) -> Mask:
    """Whether moments [s] lie between two samples at `t` that follow one another, or next to one."""
    after = np.clip(np.searchsorted(t, moments), 1, len(t) - 1)
    before, behind = moments - t[after - 1], t[after] - moments
    return np.asarray((before + behind < 1.5 * period) | (np.minimum(abs(before), abs(behind)) < PART * period))


def reversal(stand: Bench) -> LawFinding | None:
    """Find a recorded effort of the wrong sign where no law tells: turned round, it drives the joint as it moved."""
    found = LawFinding("current_gain", {"ratio": -1.0}, None, 1e3, 1.0, 0.0)
    rows, models = list(stand.system.rows), [stand.model, corrected(stand.model, found)]
    missed = [np.nansum(e[..., rows] ** 2 / stand.system.R, axis=(1, 2)) for e in stand.innovations(models)]
    straight, turned = np.sum(missed, axis=0)
    return found if turned < REVERSED * straight else None


def coarseness(stand: Bench) -> LawFinding | None:
    """Find a position sensor whose values keep to a grid coarser than the model's resolution."""
    stated = max(stand.model.sensors.position_resolution, 1e-12)
    if stand.model.sensors.position_resolution <= 0:
        return None
    grain = max(grain_of(record["position"]) for record in stand.records)
    if grain < 1.5 * stated:
        return None
    return LawFinding("quantisation", {"step_rad": grain}, None, 1e3, 1.0, 0.01 * grain)
