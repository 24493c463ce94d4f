"""Simulation against recording, free-running: held-out figures, and whether a closed loop is made worse by a term."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gsfdi.channels import CHANNELS
from gsfdi.drive import measured_velocity
from gsfdi.errors import UnusableInputError
from gsfdi.model import JointModel
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.sensing import effort_noise
from gsfdi.reconcile.shooting import imitated, shots
from gsfdi.simulate import Trace, replay, simulate_record
from gsfdi.types import Array

CLEARLY = 0.1
"""Power of a misfit beyond noise, over that of the noise, from which it shows in a column."""
STRAYS = 1.5
"""Times the misfit without it at which a term leads a simulation astray: a limit cycle out of step makes 1.4 of it."""
SILENCED, SILENCERS = 1.05, ("torque_constant", "output_inertia", "motor_inertia")
"""The same for a term that scales what drives the joint or what is driven, and the places of such."""
SEED = 1
RUNS_AWAY = 20.0
"""Times the recorded effort of which a misfit tells that the loop is not stable, where a hair decides."""


def free_run(stand: Bench, model: JointModel) -> list[Trace]:
    """Simulate every stretch: closed loop by the model's controller, or in shots where it has none."""
    found = []
    for record, drive in zip(stand.records, stand.drives, strict=True):
        if model.controller is not None and "setpoint" in record:
            found.append(replay(model, drive, "closed_loop"))
            continue
        found.append(shots(stand, model, record, drive))
    return found


def misfit(stand: Bench, model: JointModel, held_out: bool = True) -> dict[str, float]:
    """Root-mean-square difference of simulation and recording on the held-out part or the rest, by column name."""
    axis = stand.model.axis
    squares: dict[str, list[Array]] = {}
    for i, (record, trace) in enumerate(zip(stand.records, free_run(stand, model), strict=True)):
        part = stand.kept(i) == held_out
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


def strays(stand: Bench, before: JointModel, after: JointModel, held_out: bool = False, most: float = STRAYS) -> bool:
    """Whether a loop closed round `after` asks for efforts that are farther from the recorded ones by far, to no avail.

    A drive that moves nothing predicts best how a joint moves whose loop holds its speed, so that many times the
    inertia may stand for frictions that take most of the effort. It would ask for other efforts to move so, for
    misfits of more than `most` times those without it. Told by what is held out or by the rest; without a controller
    nothing is said.
    """
    if after.controller is None or "setpoint" not in stand.records[0]:
        return False
    first, last = (misfit(stand, model, held_out) for model in (before, after))
    effort, position = (CHANNELS[name].column(stand.model.axis) for name in (stand.records[0].effort, "position"))
    if {effort, position} - (first.keys() & last.keys()) or last[effort] > RUNS_AWAY * stand.scales.effort:
        return False
    return last[effort] > most * first[effort] and last[position] > first[position]


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


def felt_noise(stand: Bench, model: JointModel, columns: Sequence[str]) -> Mapping[str, float]:
    """What noise leaves of a simulation: no less than `noise_floor`, and what it moves the joint by.

    Under feedback a joint moves with its sensors' noise, which no simulation without it can follow: of fault-free
    joints the position was up to 16 times as far off as its sensor's noise. A simulation under the recorded effort
    moves with the noise of that.
    """
    own = noise_floor(stand, columns)
    try:
        shown = tuple(simulate_record(model, replay=record, seed=SEED) for record in stand.records)
        noisy = replace(stand, records=shown)
    except UnusableInputError:  # no controller, or no setpoint
        noisy = imitated(stand, model, SEED)
    moved = misfit(noisy, model)
    return {name: max(value, moved.get(name, 0.0)) for name, value in own.items()}


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
