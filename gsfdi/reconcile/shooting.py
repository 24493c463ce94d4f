"""Simulation where no controller is told: shots under the recorded effort, each begun as suits it best.

Where nothing closes the loop, what a shot begins with carries it away: an observer's speed that is off by 2 mrad/s
leaves 4 mrad after two seconds, whatever the model. So each shot is begun with the state that brings it nearest to what
it is held against, as in multiple shooting: two numbers, or four, for hundreds of samples.
"""

from dataclasses import dataclass, replace

import numpy as np

from gsfdi.drive import Drive, drive_of, measured_velocity
from gsfdi.model import JointModel
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.sensing import effort_noise
from gsfdi.reconcile.turning import Ints
from gsfdi.simulate import Trace, replay, replay_many
from gsfdi.types import Array, JointRecord

SHOT = 2.0
"""Time [s] between the beginnings of shots."""
TURNS = 3
"""Times that beginnings are put right: dry friction makes what comes of them other than linear."""
STEP = 1e-3
"""Change of a beginning by which its slopes are found, as a share of what is usual of the motion, the most it moves."""


@dataclass(frozen=True, slots=True)
class Range:
    """A stretch to be simulated in shots, which begin at `rows`."""

    stand: Bench
    model: JointModel
    record: JointRecord
    drive: Drive
    rows: Ints

    def fired(self, states: Array) -> list[Trace]:
        """Simulate with each of ``(m, shots, 5)`` beginnings."""
        return replay_many(
            [self.model] * len(states), self.drive, "open_loop", restarts=self.rows.tolist(), states=states
        )

    def missed(self, trace: Trace) -> Array:
        """Differences ``(n, 2)`` of position and speed, over their sensors' noise; 0 where nothing was measured."""
        speed = trace.motor_velocity if self.model.structure == "flexible" else trace.joint_velocity
        seen, said = (self.record["position"], measured_velocity(self.record, self.model)), (trace.position, speed)
        off = np.zeros((len(trace.t), 2))
        for row, variance in zip(self.stand.system.rows, self.stand.system.R, strict=True):
            off[:, row] = (seen[row] - said[row]) / np.sqrt(variance)
        return np.where(np.isfinite(np.column_stack(seen)), off, 0.0)

    def squares(self, missed: Array) -> Array:
        """Sum of squares by shot."""
        return np.asarray(np.add.reduceat(np.sum(missed**2, axis=1), self.rows))

    def nearer(self, states: Array, missed: Array) -> Array:
        """Give the beginnings that bring each shot nearest, as far as it is linear in them."""
        scales = self.stand.scales
        sizes = STEP * np.array([scales.reach, scales.speed, scales.windup, scales.speed])
        sizes = sizes[: 4 if self.model.structure == "flexible" else 2]
        tried = np.repeat(states[None], len(sizes), axis=0)
        tried[np.arange(len(sizes)), :, np.arange(len(sizes))] += sizes[:, None]
        slopes = np.stack([missed - self.missed(trace) for trace in self.fired(tried)], axis=-1)
        found = states.copy()
        for shot, part in enumerate(np.split(np.arange(len(missed)), self.rows[1:])):
            J = slopes[part].reshape(-1, len(sizes))
            if np.isfinite(J).all() and np.isfinite(missed[part]).all():
                off = np.linalg.lstsq(J, missed[part].ravel(), rcond=None)[0]
                found[shot, : len(sizes)] += sizes * np.clip(off, -1 / STEP, 1 / STEP)
        return found


def shots(stand: Bench, model: JointModel, record: JointRecord, drive: Drive) -> Trace:
    """Simulate a stretch in shots, each begun as brings it nearest to `record`."""
    rows = np.arange(0, len(record.t), max(2, round(SHOT / stand.scales.period)), dtype=np.int64)
    field = Range(stand, model, record, drive, rows)
    states = replay(model, drive, "predict", gain=stand.gain).state[rows]
    with np.errstate(over="ignore", invalid="ignore"):  # a model may run away
        for _ in range(TURNS):
            missed = field.missed(field.fired(states[None])[0])
            trial = field.nearer(states, missed)
            better = field.squares(field.missed(field.fired(trial[None])[0])) < field.squares(missed)
            if not better.any():
                break
            states = np.where(better[:, None], trial, states)
    return field.fired(states[None])[0]


def imitated(stand: Bench, model: JointModel, seed: int) -> Bench:
    """Give the bench with recordings of `model` itself in the shots' places, which only the sensors' noise parts."""
    rng, ratio = np.random.default_rng(seed), 1.0 if model.structure == "flexible" else model.plant.gear_ratio
    sizes = dict(zip(stand.system.rows, np.sqrt(stand.system.R), strict=True))
    found = []
    for record, drive in zip(stand.records, stand.drives, strict=True):
        trace = shots(stand, model, record, drive)
        shown = {
            "position": (trace.position, sizes.get(0, 0.0)),
            record.effort: (record[record.effort], effort_noise(model)),
        }
        if "motor_velocity" in record:
            shown["motor_velocity"] = trace.motor_velocity, ratio * sizes.get(1, 0.0)
        noisy = {name: values + size * rng.standard_normal(len(values)) for name, (values, size) in shown.items()}
        found.append(replace(record, channels={**record.channels, **noisy}, valid={}))
    return replace(stand, records=tuple(found), drives=tuple(drive_of(record, model) for record in found))
