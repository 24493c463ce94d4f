"""The controller's gains where the law tells the speed: held against everything that physics could do instead.

A gain that is off puts its part of the law into the told speed and nowhere else, where physics moves the joint itself.
So gains known to a part in ten thousand compete with all terms in one regression. They come first where both could be.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gsfdi.drive import measured_velocity
from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import drive_gain, starts
from gsfdi.reconcile.compete import all_offers, opening, possible
from gsfdi.reconcile.contract import Settled, settle_contract
from gsfdi.reconcile.doubted import estimated
from gsfdi.reconcile.hand import NEARLY, Round, likelier, orthonormal, settle
from gsfdi.reconcile.law import SURE
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.screen import Entry, refit, screen
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.simulate import replay_many
from gsfdi.types import Array, JointRecord
from gsfdi.whiten import observed, respond, steady_gain

ALIKE = 0.98
"""Share of what the best term gains from which a gain could be it as well, and comes first."""
QUIET, CALM = 3.0, 1e-3
"""Torque that the observer of the speed expects to be missing: over that of the effort's noise, over the drive's."""
WORTH = 0.2
"""Share of what regression promises the best term that a gain must promise to be tried."""
BENDS, PLAIN_BEND = 1000, 0.9
"""Places at which a drift is tried for a bend, and the share of it that a bend must explain."""
MOST, FINER = 2, 3
"""Numbers of the law that may be wrong at once, and how often each is made more exact."""
CLOCKS = ("timestamp_latency", "derivative_delay")
"""What of the law is no gain but a time [s]; it must account for more than any term does."""


def settle_law(
    records: Sequence[JointRecord], model: JointModel, terms: Mapping[str, PhysicsTerm], without: Sequence[str]
) -> tuple[Settled, JointModel, Round]:
    """Settle the contract, gains that only a told speed shows included, and open with the model that this gives."""

    def attempt(beyond: Sequence[LawFinding]) -> tuple[Settled, JointModel, Round]:
        settled = settle_contract(records, model, without, beyond)
        opened = estimated(settled.stand, settled.model, effort_floor(settled.stand))
        return settled, opened, opening(settled.stand, opened, settled.level)

    beyond: list[LawFinding] = []
    settled, opened, first = attempt(beyond)
    for _ in range(MOST):
        for finding in suspects(first):
            rival = best_term(first, terms, len(settled.model.physics))
            if finding.term in without or (rival is not None and finding.gain < WORTH * rival.linear):
                continue
            # a clock comes alone: gains stood in for it
            anew = finding.term in CLOCKS and finding.term not in {f.term for f in beyond}
            tried = [finding] if anew else [*beyond, finding]
            other = attempt(tried)
            for _ in range(FINER):
                again = [f for f in suspects(other[2]) if f.term == finding.term]
                if not again:
                    break
                tried = [*tried, *again]
                other = attempt(tried)
            if is_better(finding, other[2], first, rival):
                beyond, (settled, opened, first) = tried, other
                break
        else:
            break
    return fitted_gains(settled, first), opened, first


def fitted_gains(settled: Settled, first: Round) -> Settled:
    """Read off the fit what it made of a gain that is in the model, too."""
    if settled.law is None or settled.stand.lever == 0:
        return settled
    fitted = {use.term: use.values for use in first.fitted.model.physics}
    findings = tuple(replace(f, values=fitted.get(f.term, f.values)) for f in settled.law.findings)
    return replace(settled, law=replace(settled.law, findings=findings))


def suspects(first: Round) -> list[LawFinding]:
    """Find what of a law that told the speed would account for most: an offset that sets in, and a gain or a clock."""
    best: LawFinding | None = None
    J, residual = orthonormal(first), first.fitted.residual
    for term, column in (columns(first) if first.stand.lever > 0 else {}).items():
        bare = column - J @ (J.T @ column)
        info = float(bare @ bare)
        if info <= 0:
            continue
        size = float(bare @ residual) / info
        gain = 0.5 * size**2 * info
        if gain > (best.gain if best else SURE):
            share = 2 * gain / float(residual @ residual)
            best = LawFinding(term, valued(term, size), None, gain, share, info**-0.5)
    return [f for f in (suspect_step(first), best) if f is not None]


def suspect_step(first: Round) -> LawFinding | None:
    """Find a bias of the current that sets in: the told speed then drifts away from that of the positions for good.

    Innovations blur it, for an observer that expects no such thing follows the told speed.
    """
    stand, law = first.stand, first.fitted.model.controller
    there = "current_bias" in {use.term for use in first.fitted.model.physics}
    found: LawFinding | None = None
    if law is None or there or stand.lever == 0 or stand.count > 1:
        return None
    for record in stand.records:
        kink, slope, share = bent(*drift_of(record, first))
        if share > PLAIN_BEND and (found is None or share > found.share):
            gain = 0.5 * len(record.t) * float(np.log(1.0 / max(1.0 - share, 1e-12)))
            spread = 0.01 * abs(slope) * law.derivative
            found = LawFinding("current_bias", {"bias_a": -slope * law.derivative}, kink, gain, share, spread)
    return found


def drift_of(record: JointRecord, first: Round) -> tuple[Array, Array]:
    """Time, and the way that the told speed would have covered less that of the positions."""
    position, speed = record["position"], measured_velocity(record, first.stand.model)
    good = np.isfinite(position) & np.isfinite(speed)
    t, speed = record.t[good], speed[good]
    turns = first.stand.model.plant.gear_ratio if first.stand.model.structure == "flexible" else 1.0
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))]) / turns
    return t, way - position[good]


def bent(t: Array, values: Array) -> tuple[float, float, float]:
    """Where a line with one bend fits best, how much its slope changes there, and the share that this explains."""
    straight = np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0]
    left = values - straight @ (straight.T @ values)
    best = (0.0, 0.0, float(t[0]))
    for step in range(10, len(t) - 10, max(1, len(t) // BENDS)):
        bend = np.maximum(t - t[step], 0.0)
        bend -= straight @ (straight.T @ bend)
        slope = float(bend @ left) / float(bend @ bend)
        best = max(best, (slope**2 * float(bend @ bend), slope, float(t[step])))
    return best[2], best[1], best[0] / max(float(left @ left), 1e-300)


def best_term(first: Round, terms: Mapping[str, PhysicsTerm], given: int) -> Entry | None:
    """Find the term that would account for most."""
    return next(iter(screen(first, all_offers(first, possible(first.stand, terms, 0.0), given)).entries), None)


def is_better(finding: LawFinding, other: Round, first: Round, rival: Entry | None) -> bool:
    """Whether what a finding makes of the opening is likelier than what the best term makes of it, or as likely."""
    if other.stand.lever == 0:  # the data are no longer the same
        return rival is None or finding.gain > rival.linear
    told = sum(float(first.stand.awake(i).sum()) / 2 for i in range(len(first.stand.records)))
    gain = likelier(other, first) + told * float(np.log(other.stand.lever / first.stand.lever))
    floor = effort_floor(first.stand)
    if gain < SURE or rival is None:
        return gain >= SURE
    if gain > rival.linear and np.all(other.torque < NEARLY * floor):
        return True
    fitted = refit(first, rival).fitted
    if fitted is None:
        return gain > rival.linear
    return gain > ALIKE * likelier(settle(first.stand, fitted.model, fitted.knobs, floor), first)


def valued(term: str, size: float) -> dict[str, float]:
    """Give the number of a finding from the size in which its column was found."""
    if term in CLOCKS:
        return {"delay_s": size}
    return {"ratio": 1 - size if term in ("controller_proportional", "controller_integral") else 1 / (1 + size)}


def columns(first: Round) -> dict[str, Array]:
    """White innovations that each part of the law leaves where it is off, by term, without the sensors' noise."""
    stand, model = first.stand, first.fitted.model
    drive = drive_gain(model, stand.records[0].effort)
    there = {use.term for use in model.physics}
    found: dict[str, list[Array]] = {}
    for i, (record, speed) in enumerate(zip(stand.records, speeds(first), strict=True)):
        for term, sensed in off_by(record, model, speed, stand.lever).items():
            torque = np.zeros((1, len(record.t), stand.system.Bt.shape[1]))
            if term == "current_gain":  # that sensor drives the model, too
                torque[0, :, 0] = sensed[:, 1] / stand.lever * drive
            shown = respond(
                stand.system, stand.gain, np.nan_to_num(torque), np.nan_to_num(sensed)[None], stand.steps[i]
            )
            shown[:, ~stand.present[i]] = np.nan
            found.setdefault(term, []).append(first.tools[i](shown)[0] * stand.awake(i))
    return {term: np.concatenate(parts) for term, parts in found.items() if term not in there}


def off_by(record: JointRecord, model: JointModel, speed: Array, lever: float) -> dict[str, Array]:
    """Errors ``(n, 2)`` of position and told speed by what is wrong of the law, per unit of it."""
    law, t, present = model.controller, record.t, np.isfinite(record["position"])
    assert law is not None
    position = np.interp(t, t[present], record["position"][present])
    rate = record["setpoint_rate"] if "setpoint_rate" in record else np.gradient(record["setpoint"], t)
    error = record["setpoint"] - position
    growth = 0.5 * (error[1:] + error[:-1]) * np.diff(t)
    parts = {
        "controller_proportional": law.proportional * error,
        "controller_integral": law.integral * np.concatenate([[0.0], np.cumsum(growth)]),
        "controller_derivative": law.derivative * (law.rate_feedforward * rate - speed),
    }
    parts["current_gain"] = np.sum(list(parts.values()), axis=0)
    parts["derivative_delay"] = -law.derivative * np.gradient(speed, t)
    parts["timestamp_latency"] = law.proportional * speed + law.integral * (position - position[0])
    before = {"timestamp_latency": -speed}
    return {term: np.column_stack([before.get(term, 0 * t), lever * part]) for term, part in parts.items()}


def speeds(first: Round) -> list[Array]:
    """Speed of the joint's side of the gear, by stretch, as an observer has it that sees the position alone."""
    stand, model = first.stand, first.fitted.model
    seen = observed(model, stand.scales.period, (float(stand.system.R[0]), float("inf")))
    spread = np.maximum(QUIET * effort_floor(stand), CALM * stand.scales.torque)
    gain = steady_gain(seen, spread)
    found = []
    for i, drive in enumerate(stand.drives):
        trace = replay_many([model], drive, "predict", gain=gain, x0=starts([model], drive, i))[0]
        turns = model.plant.gear_ratio if model.structure == "flexible" else 1.0
        found.append((trace.motor_velocity if model.structure == "flexible" else trace.joint_velocity) / turns)
    return found
