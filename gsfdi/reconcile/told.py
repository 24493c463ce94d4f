"""The speed that nobody logged, told by the controller's law: what it must have read to ask for the recorded effort.

Where the law holds, every recorded effort is a measurement of the speed, with the noise of the controller's own speed
sensor and that of the effort's over the derivative gain. Only the constant with which the integral began is unknown.
And since the same noise of the effort is in what drives the model, it has to be told apart from process noise: a joint
driven by a noisy recording under feedback, seen by its position alone, seems to answer too weakly, and fits blame the
gearbox (a damping gained 10 in log-likelihood at the median of fault-free joints, and up to 24).

That holds sample by sample. With the speed told at 59 % of them, where a setpoint ran on smooth ramps and its rate was
not logged, a damping gained 31 to 51 on fault-free joints; told at all but jolts of the setpoint, 0 to 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np

from gsfdi.model import JointModel
from gsfdi.reconcile.law import LawCheck
from gsfdi.reconcile.sensing import effort_noise, seen_noise
from gsfdi.reconcile.sheet import Sheet, commanded, sheet_of
from gsfdi.types import Array, JointRecord


@dataclass(frozen=True, slots=True)
class Told:
    """Recordings with the speed that the law tells.

    Parameters
    ----------
    records : list of JointRecord
    model : JointModel
        With the noise that such a speed has.
    lever : float
        Speed [rad/s, as the sensor would show it] per unit of effort.
    """

    records: list[JointRecord]
    model: JointModel
    lever: float


GAINS = (
    "controller_proportional",
    "controller_integral",
    "controller_derivative",
    "current_gain",
    "current_bias",
    "position_gain",
)
"""Findings of the law check that the told speed decides better."""

FINE = 1.03
"""Misfit of a law with the slope of positions for a speed, over the effort's noise, up to which that is speed enough.

At 1.2 the effort that the law gave lacked a hysteresis and a delay, in a fault-free joint."""
FAR = 1.5
"""Times the stated noise of its sensors above which a told speed is taken to be as noisy as it looks.

The joint follows its sensors' noise, so that a speed looks noisier than it is."""
LEAST = 1.05
"""Noise of a told speed over what the effort's makes of it, at least: a little of it is the speed sensor's own."""


def is_telling(law: LawCheck, model: JointModel) -> bool:
    """Whether a law tells the speed that nobody logged: it brakes at once, and but for its gains it holds.

    Where positions are so fine that their slopes are speed enough, the law gives the effort itself (see `clean`).
    """
    brakes = model.controller is not None and model.controller.derivative > 0 and law.derivative_delay == 0
    return (
        brakes
        and 0 < FINE * effort_noise(model) < law.after
        and all(f.term in (*GAINS, "timestamp_latency") for f in law.findings)
    )


def told(records: Sequence[JointRecord], model: JointModel) -> Told | None:
    """Add the speed that the law of `model` tells to `records`; None where one of them cannot be laid out."""
    assert model.controller is not None
    flexible = model.structure == "flexible"
    turns = model.plant.gear_ratio if flexible else 1.0
    speeds = []
    scale = prod(use.values["ratio"] for use in model.physics if use.term == "position_gain")
    for record in records:
        sheet = sheet_of(record, model, model.controller)
        if sheet is None:
            return None
        speeds.append(turns * speed_of(record, sheet, model.controller.derivative, scale))
    lever = turns / model.controller.derivative
    ratio = model.plant.gear_ratio / turns  # of the motor's speed to the one that the model senses
    own, times = model.sensors.motor_velocity_noise / ratio, [record.t for record in records]
    noise = ratio * told_noise(times, speeds, own, lever * effort_noise(model))
    channel = "motor_velocity" if flexible else "joint_velocity"
    full = [
        replace(r, channels={**r.channels, channel: speed}, valid={}) for r, speed in zip(records, speeds, strict=True)
    ]
    sensors = replace(model.sensors, motor_velocity_noise=noise, motor_velocity_resolution=0.0)
    return Told(full, replace(model, sensors=sensors), lever)


def speed_of(record: JointRecord, sheet: Sheet, derivative: float, scale: float = 1.0) -> Array:
    """Speed of the joint's side of the gear [rad/s] that the law tells, on average that of the positions.

    Positions are `scale` times what they should be.
    """
    speed = (commanded(sheet, ()) - sheet.braking - sheet.effort) / derivative
    speed = np.where(sheet.unheld, np.nan, speed)
    whole = np.full(len(record.t), np.nan)
    whole[np.searchsorted(record.t, sheet.t)] = speed
    good = np.isfinite(record["position"])
    slope = np.gradient(np.interp(record.t, record.t[good], record["position"][good]), record.t) / scale
    return whole - float(np.nanmean(whole - slope))


def told_noise(times: Sequence[Array], speeds: Sequence[Array], own: float, through_effort: float) -> float:
    """Noise of told speeds: what the model states of both sensors, unless it states none or the values show far more.

    `own` is the speed sensor's, `through_effort` what the effort's makes of a told speed.
    """
    seen = seen_noise(list(zip(times, speeds, strict=True)))
    whole = float(np.hypot(own, through_effort))
    return whole if own > 0 and seen < FAR * whole else max(seen, LEAST * through_effort)
