"""The effort that really acted: recomputed from the controller's law, where the law holds, without its sensor's noise.

Under feedback the recorded effort moves little more than its own noise while the joint rests or glides. An observer
driven by it sees a joint that answers too weakly, and blames damping or inertia. The law, fed with the recorded
measurements as the controller was, gives the effort exactly; where no law is known one is learnt, if the recording
keeps to one.

A speed that lags in the log is not what the controller was fed. Its slopes tell that one where noise came in after the
lag. Where the noise lags as well they do not, and the law leaves a few per cent more than its noise: believed all the
same, it gave each of six joints of which the speed lagged by a thirtieth to a twelfth of a tick a gearbox damping or a
mode that they do not have; driven by the recorded effort, none of them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsfdi.model import Controller, JointModel
from gsfdi.reconcile.answering import is_white
from gsfdi.reconcile.course import unrated
from gsfdi.reconcile.gaps import beside_lost, jumps
from gsfdi.reconcile.law import EXACT, LawCheck
from gsfdi.reconcile.sensing import believed_noise, effort_noise, logs_speed
from gsfdi.reconcile.sheet import LawFinding, commanded, hiss, level_of, sheet_of, unit_sheets
from gsfdi.types import Array, JointRecord, Mask

AGED = 0.25
"""Ticks by which a logged speed may lag; of one that lags by more, the lag came out low by a twentieth."""
SURE = 3.0
"""Standard deviations of a noise's own estimate by which a law may leave more beside a lag."""
SMOOTH = 2e-3
"""Misfit of a learnt law, as a share of the effort, that is a trifle where no noise is stated."""


def cleaned(records: Sequence[JointRecord], model: JointModel, law: LawCheck | None) -> list[JointRecord] | None:
    """Records with the law's effort in the place of the recorded one; None where no law is exact."""
    noise = effort_noise(model)
    if law is not None:
        if law.noise <= 0 or noise <= 0 or law.after > EXACT * noise or is_guess(law, model):
            return None
        # wrong gains are in the model's controller already, and a late stamp in the records
        left = [f for f in law.findings if f.term in ("current_gain", "current_bias", "current_limit", "position_gain")]
        if law.derivative_delay < 0 and model.controller is not None:
            model = replace(model, controller=replace(model.controller, derivative_delay=law.derivative_delay))
        return [_driven(r, model, left) for r in records]
    learnt = learn_law(records, model)
    if learnt is None:
        return None
    fake = replace(model, controller=learnt)
    return [_driven(r, fake, ()) for r in records]


def is_guess(law: LawCheck, model: JointModel) -> bool:
    """Whether a logged speed lags, and the one that the controller had is guessed: from afar, or not to the noise."""
    if model.controller is None or law.derivative_delay >= 0:
        return False
    sure = 1 + SURE / (2 * max(law.samples, 1)) ** 0.5
    return -law.derivative_delay * model.controller.sample_rate > AGED or law.after > sure * law.noise


def _driven(record: JointRecord, model: JointModel, findings: Sequence[LawFinding]) -> JointRecord:
    """Give `record` with the effort that its law asks for, as a noiseless sensor would log it."""
    assert model.controller is not None
    sheet = sheet_of(record, model, model.controller)
    if sheet is None:
        return record
    asked = commanded(sheet, findings)
    asked = asked + level_of(sheet, findings)
    limit = min([model.controller.limit, *(f.values["limit_a"] for f in findings if f.term == "current_limit")])
    effort = np.interp(record.t, sheet.t, np.clip(asked, -limit, limit))
    recorded = record[record.effort]
    effort = np.where(is_unsure(record, model) & np.isfinite(recorded), recorded, effort)
    return replace(record, channels={**record.channels, record.effort: effort}, valid={})


def is_unsure(record: JointRecord, model: JointModel) -> Mask:
    """Samples at which the law may err, for want of the setpoint's rate, by more than the recorded effort's noise."""
    law = model.controller
    assert law is not None
    bend = jumps(record["setpoint"], record.t) * float(np.median(np.diff(record.t)))
    errs = abs(law.derivative * law.rate_feedforward) * bend / 4  # see at_corners
    return unrated(record) & (beside_lost(record) | (errs >= effort_noise(model)))


def learn_law(records: Sequence[JointRecord], model: JointModel) -> Controller | None:
    """Find the law that the recorded effort keeps to, or None.

    It must leave no more than the noise that the effort's sensor is said to have, unless that is said to be far too
    small: told by recorded efforts, a joint with three times the noise stated was given a motor's inertia of 1.6 times
    itself. One read off positions alone leaves the noise of their slopes besides, white as well, and its effort is
    worse than the recorded one: of fault-free joints it made unexplained ones. What it leaves must be white, too: a
    cascade that filters its speed over four samples was a law but for 6 % of the noise, and the effort it gave lacked a
    delay of 0.4 ms and a mode.
    """
    found = rough_law(records, model) if model.controller is None else None
    if found is None:
        return None
    law, misfits, size = found
    stated, seen = effort_noise(model), hiss(misfits)
    noise = believed_noise(stated, seen) if logs_speed(records, model) else stated or seen
    trifle = 0.0 if stated > 0 else SMOOTH * size
    left = float(np.sqrt(np.mean(np.concatenate(misfits) ** 2)))
    return law if left <= trifle or (left <= EXACT * noise and is_white(misfits)) else None


def rough_law(records: Sequence[JointRecord], model: JointModel) -> tuple[Controller, list[Array], float] | None:
    """Fit a law to the recorded effort.

    Returns
    -------
    Controller
        The law; None where it would be none, or where no setpoint is logged.
    list of (n,) arrays
        By record, what it leaves of the effort [effort's unit].
    float
        Root mean square of the effort about its mean.
    """
    laid_out = unit_sheets(records, model)
    if laid_out is None:
        return None
    unit, sheets = laid_out
    rows, blocks = [], []
    for sheet in sheets:
        fast, held = sheet.rate, ~sheet.unheld
        columns = [sheet.parts["proportional"], sheet.parts["integral"], fast - sheet.parts["derivative"], fast]
        columns = [column[held] for column in columns]
        rows.append(np.column_stack([c - c.mean() for c in columns]))
        effort = (sheet.effort - sheet.parts["feedforward"])[held]
        blocks.append(effort - effort.mean())
    X, y = np.concatenate(rows), np.concatenate(blocks)
    scale = np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-300)
    gains = np.linalg.lstsq(X / scale, y, rcond=1e-9)[0] / scale
    kp, ki, kd, ahead = (float(g) for g in gains)
    if -kd <= 0 or kp <= 0:
        return None
    misfits = np.split(y - X @ gains, np.cumsum([len(b) for b in blocks])[:-1])
    return Controller(kp, ki, -kd, unit.sample_rate, ahead / -kd), misfits, float(np.sqrt(np.mean(y**2)))
