"""What of a law that told the speed may be wrong: its gains, its clocks, the effort's own sensor.

A gain that is off puts its part of the law into the told speed and nowhere else, where physics moves the joint itself.
So one regression on everything that is seen knows gains to a part in ten thousand.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from gsfdi.drive import measured_velocity
from gsfdi.model import JointModel
from gsfdi.reconcile.bench import starts
from gsfdi.reconcile.drifting import beside, drift_of, gained, line_over, position_of
from gsfdi.reconcile.hand import Round, orthonormal
from gsfdi.reconcile.law import COARSE, SURE
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.sensing import setpoint_rate, shown_speed
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.reconcile.ticks import READ
from gsfdi.reconcile.waiting import suspect_limit
from gsfdi.simulate import Trace, replay, replay_many
from gsfdi.types import Array, JointRecord
from gsfdi.whiten import observed, respond, steady_gain

QUIET, CALM = 3.0, 1e-3
"""Torque that the observer of the speed expects to be missing: over that of the effort's noise, over the drive's."""
BENDS, PLAIN_BEND = 1000, 0.9
"""Places at which a drift is tried for a bend, and the share of it that a bend must explain."""
STEP_WITHIN, STANDS_OUT = 0.5, 5.0
"""Time [s] about a bend within which its step lies, and the spreads of a speed's changes that it must exceed."""
UNUSABLE = 1.0
"""Torque that seems to be missing, over the drive's, from which innovations tell nothing."""
CLOCKS = ("timestamp_latency", "derivative_delay")
"""What of the law is no gain but a time [s]."""


def suspects(first: Round, begun: str = "") -> list[LawFinding]:
    """Find what of a law that told the speed would account for most: an offset that sets in, and a gain or a clock.

    Each is there once, with the numbers that explain the larger share of what shows it. One that has `begun` to be put
    right comes before another that does the same: what 0.9 ms of lateness lacked of 4 µs was a gain off by 0.06 %, too.
    """
    if first.stand.lever == 0:
        return []
    seen_by = shadows(first)
    seen = [shown_speed(shadow, first.fitted.model) for shadow in seen_by]

    def rank(finding: LawFinding) -> float:
        # where all effort goes into inertia, a gain is as good as an age
        more = -SURE if finding.term == begun else SURE if finding.term in CLOCKS else 0.0
        return finding.gain - more

    sure = [f for f in regressed(first, seen) if f.gain > SURE and rank(f) > SURE and not is_trifle(f)]
    best = max(sure, key=rank, default=None)
    others = (suspect_limit(first, seen_by), suspect_step(first), best, suspect_drift(first, seen))
    found = [f for f in others if f is not None]
    found.sort(key=lambda f: -f.share)
    return [f for place, f in enumerate(found) if f.term not in {g.term for g in found[:place]}]


def regressed(first: Round, seen: Sequence[Array]) -> Iterator[LawFinding]:
    """Give what each part of the law would gain by being scaled or timed otherwise; for `seen` see `columns`."""
    J, residual = orthonormal(first), first.fitted.residual
    for term, column in columns(first, seen).items():
        bare = beside(J, column)
        info = float(bare @ bare)
        if info > 0:
            size = float(bare @ residual) / info
            gain = 0.5 * size**2 * info
            read = READ * first.stand.scales.period if term in CLOCKS else 0.0
            spread = float(np.hypot(info**-0.5, read))
            share = 2 * gain / float(residual @ residual)
            yield LawFinding(term, valued(term, size), None, gain, share, spread)


def is_trifle(finding: LawFinding) -> bool:
    """Whether a current's gain, a number of the model like others then, only loosens the scale of torque."""
    return finding.term == "current_gain" and abs(1.0 / finding.values["ratio"] - 1.0) < COARSE


def gain_by(first: Round, term: str) -> float:
    """Log-likelihood that a part of the law that told the speed promises by being scaled or timed otherwise."""
    if first.stand.lever == 0:
        return 0.0
    seen = [shown_speed(shadow, first.fitted.model) for shadow in shadows(first)]
    return max((f.gain for f in regressed(first, seen) if f.term == term), default=0.0)


def suspect_step(first: Round) -> LawFinding | None:
    """Find a bias of the current that sets in: the told speed then drifts away from that of the positions for good.

    Innovations blur it, for an observer that expects no such thing follows the told speed.
    """
    stand, law = first.stand, first.fitted.model.controller
    there = "current_bias" in {use.term for use in first.fitted.model.physics}
    found: LawFinding | None = None
    if law is None or there or stand.count > 1:
        return None
    for record in stand.records:
        kink, slope, share = bent(*drift_of(record, first))
        if share > PLAIN_BEND and (found is None or share > found.share):
            gain = gained(share, len(record.t))
            spread = 0.01 * abs(slope) * law.derivative
            kink = stepped_at(record.t, measured_velocity(record, stand.model), kink, slope * stand.scales.turns)
            found = LawFinding("current_bias", {"bias_a": -slope * law.derivative}, kink, gain, share, spread)
    return found


def suspect_drift(first: Round, seen: Sequence[Array]) -> LawFinding | None:
    """Find what of the law makes the told speed drift from that of the positions, where innovations are of no use."""
    if is_usable(first):
        return None
    there = {use.term for use in first.fitted.model.physics}
    found: LawFinding | None = None
    for record, speed in zip(first.stand.records, seen, strict=True):
        t, drift = drift_of(record, first)
        line = line_over(t)
        drift = beside(line, drift)
        parts = off_by(record, speed, first.fitted.model, first.stand.lever)
        parts["position_gain"] = np.column_stack([-position_of(record), 0 * record.t])
        for term, sensed in ((term, sensed) for term, sensed in parts.items() if term not in there):
            shown = cumulative_trapezoid(sensed[:, 1], record.t, initial=0) / first.stand.scales.turns - sensed[:, 0]
            column = beside(line, np.interp(t, record.t, shown))
            info = max(float(column @ column), 1e-300)
            size = float(column @ drift) / info
            share = size**2 * info / max(float(drift @ drift), 1e-300)
            if share > (found.share if found else PLAIN_BEND):
                found = LawFinding(term, valued(term, size), None, gained(share, len(t)), share, 0.01 * abs(size))
    return found


def is_usable(first: Round) -> bool:
    """Whether innovations tell something: not where all of the drive's torque seems to be missing."""
    return bool(np.all(first.torque < UNUSABLE * first.stand.scales.torque))


def bent(t: Array, values: Array) -> tuple[float, float, float]:
    """Where a line with one bend fits best, how much its slope changes there, and the share that this explains."""
    line = line_over(t)
    left = beside(line, values)
    best = (0.0, 0.0, float(t[0]))
    for step in range(10, len(t) - 10, max(1, len(t) // BENDS)):
        bend = beside(line, np.maximum(t - t[step], 0.0))
        slope = float(bend @ left) / float(bend @ bend)
        best = max(best, (slope**2 * float(bend @ bend), slope, float(t[step])))
    return best[2], best[1], best[0] / max(float(left @ left), 1e-300)


def stepped_at(t: Array, speed: Array, near: float, size: float) -> float:
    """Find the moment near a bend of the way from which a speed is `size` higher, if that stands out of its noise.

    It lies between two samples, where rounding does not decide to which of them it belongs. A bend is found to within
    several samples; and in each that is put right wrongly the told speed is off by it all.
    """
    known = np.flatnonzero(np.isfinite(speed))
    jump = np.diff(speed[known]) * np.sign(size)
    close = np.abs(t[known][1:] - near) < STEP_WITHIN
    if not close.any() or abs(size) < STANDS_OUT * float(np.std(jump)):
        return near
    first = int(np.argmax(np.where(close, jump, -np.inf)))
    return 0.5 * float(t[known][first] + t[known][first + 1])


def valued(term: str, size: float) -> dict[str, float]:
    """Give the number of a finding from the size in which its column was found."""
    if term in CLOCKS:
        return {"delay_s": size}
    return {"ratio": 1 - size if term in ("controller_proportional", "controller_integral") else 1 / (1 + size)}


def columns(first: Round, seen: Sequence[Array]) -> dict[str, Array]:
    """White innovations that each part of the law leaves where it is off, by term, without the sensors' noise.

    `seen` is the speed by stretch that `shadows` show. That a current on a wrong scale drives the model, too, the
    torque constant takes over.
    """
    stand, model = first.stand, first.fitted.model
    there = {use.term for use in model.physics}
    found: dict[str, list[Array]] = {}
    for i, (record, speed) in enumerate(zip(stand.records, seen, strict=True)):
        still = np.zeros((1, len(record.t), stand.system.Bt.shape[1]))
        for term, sensed in off_by(*quiet(first, i, speed), model, stand.lever).items():
            shown = respond(stand.system, stand.gain, still, np.nan_to_num(sensed)[None], stand.steps[i])
            found.setdefault(term, []).append(first.tools[i](shown)[0] * stand.awake(i))
    return {term: np.concatenate(parts) for term, parts in found.items() if term not in there}


def off_by(record: JointRecord, speed: Array, model: JointModel, lever: float) -> dict[str, Array]:
    """Errors ``(n, 2)`` of position and told speed by what is wrong of the law, per unit of it."""
    law, t, position = model.controller, record.t, position_of(record)
    assert law is not None
    error = record["setpoint"] - position
    parts = {
        "controller_proportional": law.proportional * error,
        "controller_integral": law.integral * cumulative_trapezoid(error, t, initial=0),
        "controller_derivative": law.derivative * (law.rate_feedforward * setpoint_rate(record) - speed),
    }
    parts["current_gain"] = record[record.effort]  # with the constant that the integral began with
    parts["derivative_delay"] = -law.derivative * np.gradient(speed, t)
    parts["timestamp_latency"] = law.proportional * speed + law.integral * (position - position[0])
    before = {"timestamp_latency": -speed}
    return {term: np.column_stack([before.get(term, 0 * t), lever * part]) for term, part in parts.items()}


def quiet(first: Round, i: int, speed: Array) -> tuple[JointRecord, Array]:
    """Give a stretch and its `speed` as the fitted model shows them, without noise, unless it runs away.

    The told speed has the noise of position and effort itself, so that with theirs in the columns of a gain and of an
    age, which are alike, the difference of the two seems to account for some of it.
    """
    record, model = first.stand.records[i], first.fitted.model
    trace = replay(model, first.stand.drives[i])
    if not np.isfinite(trace.position).all():
        return record, speed
    shown = {"position": trace.position, record.effort: trace.effort}
    return replace(record, channels={**record.channels, **shown}), shown_speed(trace, model)


def shadows(first: Round) -> list[Trace]:
    """The joint, by stretch, as an observer has it that sees the position alone."""
    stand, model = first.stand, first.fitted.model
    seen = observed(model, stand.scales.period, (float(stand.system.R[0]), float("inf")))
    spread = np.maximum(QUIET * effort_floor(stand), CALM * stand.scales.torque)
    gain = steady_gain(seen, spread)
    return [
        replay_many([model], drive, "predict", gain=gain, x0=starts([model], drive, i))[0]
        for i, drive in enumerate(stand.drives)
    ]
