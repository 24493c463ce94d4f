"""What drives the model of a recorded joint: the effort as nearly as it can be told, and how noisy that still is."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gsfdi.model import JointModel, Side, TermUse
from gsfdi.reconcile.answering import answered, is_closer
from gsfdi.reconcile.bench import Bench, drive_gain, moves
from gsfdi.reconcile.clean import cleaned
from gsfdi.reconcile.hand import Round, likelier, surprise_of
from gsfdi.reconcile.hush import hushed
from gsfdi.reconcile.law import EXACT, LawCheck
from gsfdi.reconcile.noise import effort_floor, surprise
from gsfdi.reconcile.sensing import FAR, effort_noise, seen_noise
from gsfdi.reconcile.told import Told, told
from gsfdi.reconcile.unheld import plainest, unheld
from gsfdi.reconcile.waiting import between_stays
from gsfdi.types import JointRecord

HALF = 0.5**0.5
"""Share of an effort's hiss that is taken for its own sensor's, where nobody knows how noisy that is."""
LOOPED = 2.0
"""Times the hiss of an effort that goes round the loop, where nothing tells it from what was asked of the joint."""
PLAIN = 20.0
"""Log-likelihood by which efforts must be likelier to be as quiet as the joint shows."""


class Driving(NamedTuple):
    """Records with the effort that drives the model, and the model with what is known of its noise.

    `records` are None where they stay as they are. `level` doubts the constant of a recomputed effort [N m], whose
    terms are then the model's last; for `lever`, `learnt` and `looped` see `gsfdi.reconcile.bench.Bench`.
    """

    records: Sequence[JointRecord] | None
    model: JointModel
    level: float = 0.0
    lever: float = 0.0
    learnt: float = 0.0
    looped: float = 0.0


def driven_by(stand: Bench, model: JointModel, law: LawCheck | None, telling: bool) -> Driving:
    """Tell the effort by the law where it is exact, else what the effort tells: a speed, or its own noise.

    Where nobody says by which law it is made, it may also run on between its samples. And where nobody says how noisy
    it is, what a law that was read off positions leaves, which is the noise of their slopes and of the speed that the
    drive did answer to, looks like its sensor's: two sound torque joints were `unexplained`, their drive less likely by
    500 than the recorded one.

    Parameters
    ----------
    stand : Bench
        With the records as they are.
    model : JointModel
        With what is wrong of the law put right, and what it shows of the effort's noise stated.
    law : LawCheck or None
    telling : bool
        Whether the law tells a speed that nobody logged.
    """
    if law is None and model.controller is None:
        noisy = with_effort_noise(model, None, stand)
        if (running := unheld(stand, noisy)) is not None:
            return Driving(running, noisy)
    if law is not None and telling and law.derivative_delay == 0:
        heard = heard_by(stand, model, law)
        if heard is not None:
            return Driving(heard.records, heard.model, lever=heard.lever)
    exact, noise = cleaned(stand.records, model, law), 0.0
    if model.controller is None and stand.sees_speed:
        wide = answered(stand.records, model)
        if wide is not None and (exact is None or is_closer(wide, exact, stand.records)):
            exact, noise = wide.records, wide.noise
    recorded = plainest(stand, stand.records, model) if is_untold(stand, model) else None
    silent = replace(model, sensors=replace(model.sensors, effort_noise=noise, effort_resolution=0.0))
    if exact is not None and (recorded is None or likelier(plainest(stand, exact, silent), recorded) > 0):
        leveled = replace(silent, physics=(*model.physics, *levels(stand)))
        return Driving(exact, leveled, level=level_doubt(stand), learnt=noise / stand.scales.effort)
    if law is not None:
        return Driving(None, model)
    led = any(moves(record, "setpoint") for record in stand.records)
    noise = 0.0 if led else LOOPED * hiss_of(stand) / stand.scales.effort
    if stand.sees_speed and (quiet := hushed(stand.records, model)) is not None:
        return Driving(quiet.records, quiet.model, looped=noise)
    noisy = with_effort_noise(model, None, stand)
    return Driving(None, noisy if recorded is None else as_quiet_as_shown(noisy, recorded), looped=noise)


def as_quiet_as_shown(model: JointModel, hand: Round) -> JointModel:
    """State the noise of the effort's sensor, which `model` guesses, as `hand` shows it where that is plainly less.

    Half the power of its hiss was four times the noise of two sound torque joints, which the fit then answered by
    gains of position and current that the joints do not have. Quieter by a fifth, and no likelier, it gave a sound arm
    a gearbox damping.
    """
    unit = drive_gain(model, hand.stand.records[0].effort)
    loud = np.array([max(hand.torque[0], unit * effort_noise(model)), *hand.torque[1:]])
    if surprise(hand.stand, hand.innovations, loud) - surprise_of(hand) < PLAIN:
        return model
    return replace(model, sensors=replace(model.sensors, effort_noise=float(hand.torque[0]) / unit))


def is_untold(stand: Bench, model: JointModel) -> bool:
    """Whether neither law nor speed nor model tells how noisy the recorded efforts are."""
    return model.controller is None and not stand.sees_speed and effort_noise(model) == 0


def heard_by(stand: Bench, model: JointModel, law: LawCheck) -> Told | None:
    """Let the law tell the speed, from each time anew that its integral has waited at a limit."""
    limit = next((f.values["limit_a"] for f in law.findings if f.term == "current_limit"), None)
    if limit is None or model.controller is None:
        return told(stand.records, model)
    pieces = between_stays(stand.records, limit, stand.scales.period)
    if not pieces:
        return None
    heard = told(pieces, replace(model, controller=replace(model.controller, limit=np.inf)))
    return heard and replace(heard, model=replace(heard.model, controller=model.controller))


def levels(stand: Bench) -> list[TermUse]:
    """Lay out the constants of a recomputed effort: the first, and what each stretch after a gap has beyond it.

    Several recordings have clocks of their own, on which a load that sets in cannot stand for one of them.
    """
    side: Side | None = "output" if stand.model.structure == "flexible" else None
    later = [float(record.t[0]) for record in stand.records[1:]] if stand.count == 1 else []
    return [TermUse("constant_load", {"torque_nm": 0.0}, side, onset) for onset in (None, *later)]


def level_doubt(stand: Bench) -> float:
    """Standard deviation of a recomputed effort's constant, as torque: noise of the recorded one over all samples."""
    samples = min(len(record.t) for record in stand.records)
    return float(max(effort_floor(stand)[0] / samples**0.5, 1e-6 * stand.scales.torque))


def with_effort_noise(model: JointModel, law: LawCheck | None, stand: Bench) -> JointModel:
    """State the noise of the effort's sensor as law or effort show it, where `model` states none, or far too little.

    A law that is fed with a logged speed leaves it. Where none is, the effort hisses with its own noise and with what
    the law makes of that of its speed: if nothing is stated, half of its power from either is as good a guess as any.
    """
    noise = effort_noise(model)
    if law is not None and stand.sees_speed:
        noise = max(noise, law.noise) if law.after < EXACT * law.noise else noise or law.noise
    else:
        seen = hiss_of(stand)
        known = float(np.hypot(noise, reaction(model)))
        noise = HALF * seen if noise == 0 else noise * seen / known if seen > FAR * known else noise
    if noise == effort_noise(model):
        return model
    return replace(model, sensors=replace(model.sensors, effort_noise=noise, effort_resolution=0.0))


def hiss_of(stand: Bench) -> float:
    """Noise of the recorded effort: its sensor's, and what the loop makes of those of others."""
    return seen_noise([(r.t, r[r.effort]) for r in stand.records], order=9)


def reaction(model: JointModel) -> float:
    """Effort that a law makes of the noise of a speed that nobody logged; infinite where either is unknown."""
    law, sensors = model.controller, model.sensors
    if law is None or sensors.motor_velocity_noise == 0:
        return float("inf")
    position = float(np.hypot(sensors.position_noise, sensors.position_resolution / np.sqrt(12.0)))
    return float(
        np.hypot(law.derivative * sensors.motor_velocity_noise / model.plant.gear_ratio, law.proportional * position)
    )
