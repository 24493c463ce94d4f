"""Held-out figures: simulation against recording, free-running, on data that took no part in choosing or fitting."""

from collections.abc import Mapping, Sequence

import numpy as np

from gsfdi.channels import CHANNELS
from gsfdi.drive import measured_velocity
from gsfdi.model import JointModel
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.sensing import effort_noise
from gsfdi.simulate import Trace, replay
from gsfdi.types import Array

CLEARLY = 0.1
"""Power of a misfit beyond noise, over that of the noise, from which it shows in a column."""
SHOT = 2.0  # [s] between restarts where there is no controller to close the loop


def free_run(stand: Bench, model: JointModel) -> list[Trace]:
    """Simulate every stretch: closed loop by the model's controller, or restarted every `SHOT` where it has none."""
    found = []
    for record, drive in zip(stand.records, stand.drives, strict=True):
        if model.controller is not None and "setpoint" in record:
            found.append(replay(model, drive, "closed_loop"))
            continue
        watched = replay(model, drive, "predict", gain=stand.gain)
        rows = np.arange(0, len(record.t), max(2, round(SHOT / stand.scales.period)))[1:]
        found.append(replay(model, drive, "open_loop", restarts=rows.tolist(), states=watched.state[rows]))
    return found


def misfit(stand: Bench, model: JointModel) -> dict[str, float]:
    """Root-mean-square difference of simulation and recording on the held-out part, by column name."""
    axis = stand.model.axis
    squares: dict[str, list[Array]] = {}
    for i, (record, trace) in enumerate(zip(stand.records, free_run(stand, model), strict=True)):
        part = stand.kept(i)
        pairs: dict[str, tuple[Array, Array]] = {"position": (record["position"], trace.position)}
        if model.controller is not None and "setpoint" in record:
            pairs[record.effort] = (record[record.effort], trace.effort)
        if "motor_velocity" in record and np.isfinite(measured_velocity(record, model)).any():
            pairs["motor_velocity"] = (record["motor_velocity"], trace.motor_velocity)
        for name, (seen, said) in pairs.items():
            off = (seen - said)[part]
            squares.setdefault(CHANNELS[name].column(axis), []).append(off[np.isfinite(off)] ** 2)
    return {
        name: float(np.sqrt(np.mean(np.concatenate(parts))))
        for name, parts in squares.items()
        if sum(map(len, parts)) > 0
    }


def left_over(stand: Bench, before: JointModel, after: JointModel) -> float:
    """Share of the misfit beyond noise that `after` leaves of what `before` does where that is held out.

    In the column that gains least.

    Parameters
    ----------
    stand : Bench
        With the recordings as they came.
    before, after : JointModel
    """
    first, last = misfit(stand, before), misfit(stand, after)
    floor = noise_floor(stand, list(first))
    beyond = {  # a model that ran away throughout has no figure
        name: (first[name] ** 2 - floor[name] ** 2, last.get(name, np.inf) ** 2 - floor[name] ** 2) for name in first
    }
    shares = [max(b, 0.0) / a for name, (a, b) in beyond.items() if a > CLEARLY * floor[name] ** 2]
    return float(np.sqrt(max(shares, default=1.0)))


def noise_floor(stand: Bench, columns: Sequence[str]) -> Mapping[str, float]:
    """What noise alone leaves in each column: the sensors' own, and what the controller makes of theirs."""
    model, law = stand.model, stand.model.controller
    variance = dict(zip(stand.system.rows, stand.system.R, strict=True))
    position = variance.get(0, 0.0)
    speed = variance.get(1, 0.0)
    turns = stand.scales.turns
    effort = effort_noise(model) ** 2
    if law is not None:
        effort += law.proportional**2 * position + (law.derivative / turns) ** 2 * speed
    axis = model.axis
    ratio = 1.0 if model.structure == "flexible" else model.plant.gear_ratio
    floors = {"position": position, "motor_velocity": speed * ratio**2, stand.records[0].effort: effort}
    named = {CHANNELS[name].column(axis): float(np.sqrt(value)) for name, value in floors.items()}
    return {name: named[name] for name in columns}
