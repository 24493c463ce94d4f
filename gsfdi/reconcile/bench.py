"""The recordings of one joint, set up so that any model of it can be held against them.

A bench knows what drives each recording, how noisy its sensors are, and in which sizes effects are worth trying here.
It turns models into innovations, and innovations into white ones under a noise model that all hypotheses share.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gsfdi.drive import Drive, drive_of, is_thinned, measured_velocity
from gsfdi.errors import UnusableInputError
from gsfdi.fit import Started
from gsfdi.model import JointModel
from gsfdi.reconcile.gaps import beside_lost, stretches
from gsfdi.reconcile.scales import scales_of
from gsfdi.reconcile.sensing import effort_noise, grain_of, noise_of, sensor_variances
from gsfdi.reconcile.thinned import calmed, unseen_jumps
from gsfdi.scales import Scales
from gsfdi.simulate import Trace, initial_state, innovations_of, replay_many
from gsfdi.types import Array, JointRecord, Mask
from gsfdi.whiten import Observed, Whitener, observed, pushes, respond, steady_gain, steps_of, whitener

Ints = npt.NDArray[np.int64]
AWAY = 1e4
"""Innovation of a model that ran away, in standard deviations of its sensor."""
FIRST = 8  # samples from which a replay takes its starting rates
WARM_UP = 0.5  # [s] after every start that decides nothing: the states of terms with memory are unknown there
HOLD_OUT = (0.70, 0.88)
"""Part of the time of every recording that is kept for judging, as shares."""
MOST = 0.05
"""Share of the drive's torque that the observer expects to be missing at most, however much is."""
LEAN = 0.5
"""Least share of the larger side's torque that the observer expects on the other.

An observer that expects everything on the output corrects the wind-up so hard that one whose spring stiffens runs away,
and so does one that expects too much.
"""
NEAR = 8
"""Models that each is held against, to be replayed once where they are alike."""
BLOCK = 2.0  # [s] over which innovations may hang together


@dataclass(frozen=True, slots=True)
class Bench:
    """Recordings of one joint and the observer that runs beside them.

    Parameters
    ----------
    model : JointModel
        The nominal model.
    records : tuple of JointRecord
        Stretches without gaps; time still counts from the start of the recording.
    count : int
        Recordings from which they were cut.
    drives : tuple of Drive
    system : Observed
        The nominal joint as its sensors see it.
    gain, spread : arrays
        Base gain of the observer and the torque noise [N m] for which it was designed.
    doubt : (n, n) array
        Covariance of the state with which a stretch begins.
    steps, present : tuple of int and bool arrays
        Sampling periods between samples, and which channels were measured there, by stretch.
    shaken : tuple of arrays
        Torque [N m] by which the drive may have moved unseen over the step before each sample, by stretch.
    scales : Scales
    """

    model: JointModel
    records: tuple[JointRecord, ...]
    count: int
    drives: tuple[Drive, ...]
    system: Observed
    gain: Array
    spread: Array
    doubt: Array
    steps: tuple[Ints, ...]
    present: tuple[Mask, ...]
    shaken: tuple[Array, ...]
    scales: Scales
    grains: tuple[Array, ...] = ()
    """Errors ``(n, 2)`` of sensors so coarse that their error is no white noise, as they would be on this motion."""
    window: tuple[float, float] = HOLD_OUT
    """Part of the time that is kept for judging, as shares."""
    counts: tuple[Array, ...] = ()
    """What `awake` gives, by stretch."""
    lever: float = 0.0
    """Speed per unit of effort, where the speed was told by the effort (see `told`)."""
    learnt: float = 0.0
    """Share of the effort by which it may be off where an unknown law was learnt for it (see `answering`)."""
    looped: float = 0.0
    """Share of the effort that is noise going round a loop of which neither law nor setpoint is known."""

    def innovations(self, models: Sequence[JointModel]) -> list[Array]:
        """Innovations ``(m, n, 2)`` of each model, by record; NaN where a channel is missing."""
        found = []
        for i, drive in enumerate(self.drives):
            begun = starts(models, drive, i)
            own, place = apart(models, begun)
            shown = innovations_of([models[k] for k in own], drive, self.gain, begun[own])
            found.append(self._owned(shown if own == place else shown[place], i))
        return found

    def _owned(self, innovations: Array, stretch: int) -> Array:
        """Make a model that ran away pay for it: what was measured but could not be predicted is missed by far."""
        for row, variance, seen in zip(self.system.rows, self.system.R, self.present[stretch].T, strict=True):
            channel = innovations[..., row]
            channel[~np.isfinite(channel) & seen] = AWAY * np.sqrt(variance)
        return innovations

    def traces(self, model: JointModel) -> list[Trace]:
        """Replay `model` beside each record."""
        return [
            replay_many([model], drive, "predict", gain=self.gain, x0=starts([model], drive, i))[0]
            for i, drive in enumerate(self.drives)
        ]

    def whiteners(self, torque: Array) -> list[Whitener]:
        """Set up a whitener for each record, for process noise of `torque` [N m]."""
        found = []
        for i, (steps, present) in enumerate(zip(self.steps, self.present, strict=True)):
            tool = whitener(self.system, self.gain, self.doubt, torque, steps, present, self.shaken[i])
            if self.grains:
                rng = np.random.default_rng(i)
                push = pushes(self.system, torque, self.grains[i], rng)
                tool = tool.coloured(respond(self.system, self.gain, push[None], self.grains[i][None], steps)[0])
            found.append(tool)
        return found

    def rebased(self, torque: Array, model: JointModel) -> "Bench":
        """Give the bench whose observer is designed for `model` and process noise of `torque` [N m].

        The nearer the model, the less its observer needs to lean on noisy measurements, which near standstill would
        shake a dry friction loose that really sticks.
        """
        spread = np.minimum(np.maximum(2.0 * torque, 1e-3 * self.scales.torque), MOST * self.scales.torque)
        spread = np.maximum(spread, LEAN * spread.max())
        variances = [float("inf")] * 2
        for row, variance in zip(self.system.rows, self.system.R, strict=True):
            variances[row] = float(variance)
        shared = shared_noise(model, self.records[0].effort, self.lever)
        system = observed(model, self.scales.period, (variances[0], variances[1]), shared)
        return replace(self, system=system, gain=steady_gain(system, spread), spread=spread)

    def white(self, innovations: Sequence[Array], whiteners: Sequence[Whitener]) -> Array:
        """White innovations ``(m, rows)`` over all records, 0 during warm-up."""
        parts = [w(e) for e, w in zip(innovations, whiteners, strict=True)]
        for i, part in enumerate(parts):
            part *= self.awake(i)
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def awake(self, record: int) -> Array:
        """1 for every row of a record that counts, 0 during warm-up and where it is kept for judging."""
        return self.counts[record]

    @property
    def told(self) -> float:
        """Number of values that count, over all records."""
        return float(sum(counts.sum() for counts in self.counts))

    def judged_in(self, window: tuple[float, float]) -> "Bench":
        """Give the bench that keeps another part of the time for judging, as shares."""
        moved = replace(self, window=window)
        return replace(moved, counts=tuple(moved._counting(i) for i in range(len(moved.records))))

    def _counting(self, record: int) -> Array:
        steps = self.steps[record]
        wait = round(WARM_UP / self.scales.period)
        starts = np.flatnonzero(steps == 0)
        since = np.arange(len(steps)) - starts[np.searchsorted(starts, np.arange(len(steps)), side="right") - 1]
        used = (since >= wait) & ~self.kept(record)
        return np.repeat(used.astype(np.float64), len(self.system.rows))

    def kept(self, record: int) -> Mask:
        """Rows of a stretch that are kept for judging: the same share of every recording, however long it is."""
        share = self.records[record].t / self.seconds(record)
        return np.asarray((share >= self.window[0]) & (share < self.window[1]))

    def seconds(self, record: int) -> float:
        """Length of the recording that a stretch was cut from [s]."""
        own = self.records[record]
        return max(float(r.t[-1]) for r in self.records if (r.source, r.t0_ns) == (own.source, own.t0_ns))

    @property
    def sees_speed(self) -> bool:
        """Whether a speed is logged beside the position."""
        return 1 in self.system.rows and self.lever == 0

    @property
    def held_out(self) -> tuple[float, float]:
        """First and last second of the part of the longest recording that takes no part in choosing or fitting."""
        return self.window[0] * self.scales.seconds, self.window[1] * self.scales.seconds

    def blocks(self) -> Ints:
        """Block of time of every white innovation."""
        found, first = [], 0
        for record in self.records:
            block = first + (record.t // BLOCK).astype(np.int64)
            first = int(block[-1]) + 1
            found.append(np.repeat(block, len(self.system.rows)))
        return np.concatenate(found)


def apart(models: Sequence[JointModel], begun: Array) -> tuple[list[int], list[int]]:
    """Models that differ in a stretch in which they begin with `begun` (models, 9), and the place of each among those.

    What another stretch begins with is nothing to it: of a recording with many gaps most replays are the same.
    """
    plain = [m.begun(()) if isinstance(m, Started) else m for m in models]
    own, place = list[int](), list[int]()
    for i, model in enumerate(plain):
        near = range(max(0, len(own) - NEAR), len(own))
        alike = (n for n in near if plain[own[n]] == model and np.array_equal(begun[own[n]], begun[i]))
        place.append(next(alike, len(own)))
        if place[-1] == len(own):
            own.append(i)
    return own, place


def starts(models: Sequence[JointModel], drive: Drive, stretch: int) -> Array:
    """States ``(models, 9)`` in which a stretch begins, with its bristles, its shift of time and its swing.

    A told speed is right on average, so that a bias of the effort that told it is in the integral's start already.
    """
    found = np.array([[*initial_state(model, drive.start), *[0.0] * 4] for model in models])
    for row, model in zip(found, models, strict=True):
        biases = (use for use in model.physics if use.term == "current_bias")
        row[4] -= sum(use.values["bias_a"] * float(np.mean(drive.t >= (use.onset or drive.t[0]))) for use in biases)
        if isinstance(model, Started) and model.windups:
            row[0] -= model.windups[stretch]
            row[2:4] += model.windups[stretch], model.windup_rates[stretch]
            row[4] += model.integrals[stretch]
            row[5:] = model.bristles[stretch], model.shift, model.swings[stretch], model.swing_rates[stretch]
    return found


def bench(records: Sequence[JointRecord], model: JointModel, lever: float = 0.0) -> Bench:
    """Set up the bench for `records` of the joint that `model` describes; for `lever` see `Bench`."""
    usable = [r for r in records if len(r.t) >= 50 and moves(r, "position") and moves(r, r.effort)]
    if not usable:
        subject = records[0].source if records else model.name
        raise UnusableInputError(
            subject, "has no position or no drive effort that moves", "map position and motor current or torque"
        )
    period = float(np.median(np.concatenate([np.diff(r.t) for r in usable])))
    variances = sensor_variances(usable, model)
    system = observed(model, period, variances, shared_noise(model, usable[0].effort, lever))
    scales = scales_of(usable, model, period)
    spread = np.full(system.Bt.shape[1], 0.2 * scales.torque)
    gain = steady_gain(system, spread)
    whole = tuple(stretch for r in usable for stretch in stretches(r, period, 2 * WARM_UP))
    if not whole:
        short = f"has no stretch of {2 * WARM_UP:g} s without a gap"
        raise UnusableInputError(usable[0].source or model.name, short, "record for longer")
    whole = tuple(calmed(r) if is_thinned(r.t, model.controller) else r for r in whole)
    drives = tuple(drive_of(r, model) for r in whole)
    if lever > 0:
        drives = tuple(d.told(lever) for d in drives)
    steps = tuple(steps_of(r.t, period) for r in whole)
    seen = (np.column_stack([r["position"], measured_velocity(r, model)])[:, list(system.rows)] for r in whole)
    present: tuple[Mask, ...] = tuple(np.isfinite(values) for values in seen)
    stand = Bench(
        model=model,
        records=whole,
        count=len(usable),
        drives=drives,
        system=system,
        gain=gain,
        spread=spread,
        doubt=start_doubt(system, scales),
        steps=steps,
        present=present,
        shaken=tuple(shaken_of(r, scales, model) for r in whole),
        scales=scales,
        lever=lever,
    )
    return replace(stand, grains=grain_errors(stand)).judged_in(HOLD_OUT)


def moves(record: JointRecord, channel: str) -> bool:
    """Whether a channel is there and its values are not one and the same."""
    values = record[channel] if channel in record else np.zeros(0)
    values = values[np.isfinite(values)]
    return values.size > 0 and bool(np.ptp(values) > 0)


def shared_noise(model: JointModel, effort: str, lever: float) -> float:
    """Covariance of the noise of a speed that the effort told with that of the drive's torque [N m rad/s].

    Of an effort that acts late, only the share counts for which it acts before the next one is told.
    """
    late = sum(use.values["delay_s"] for use in model.physics if use.term == "actuation_delay")
    share = max(0.0, 1.0 - late * (model.controller.sample_rate if model.controller else 0.0))
    return share * lever * drive_gain(model, effort) * effort_noise(model) ** 2


def drive_gain(model: JointModel, effort: str) -> float:
    """Torque at the output [N m] per unit of the drive's effort."""
    return 1.0 if effort == "drive_torque" else model.plant.gear_ratio * model.plant.torque_constant


def grain_errors(stand: Bench) -> tuple[Array, ...]:
    """Errors of the sensors on this motion, by stretch; nothing where they are fine enough to be white."""
    sensors = stand.model.sensors
    ratio = 1.0 if stand.model.structure == "flexible" else stand.model.plant.gear_ratio
    noise = (sensors.position_noise, sensors.motor_velocity_noise / ratio)
    grain = [max(grain_of(r["position"]) for r in stand.records), 0.0]
    if stand.sees_speed:
        grain[1] = max(grain_of(measured_velocity(r, stand.model)) for r in stand.records)
    if all(g < 1.5 * n for g, n in zip(grain, noise, strict=True)):
        return ()
    rng, found = np.random.default_rng(1), []
    for trace in stand.traces(stand.model):
        true = np.column_stack([trace.position, trace.motor_velocity / ratio])
        seen = true + np.array(noise) * rng.standard_normal(true.shape)
        for i, step in enumerate(grain):
            if step > 0:
                seen[:, i] = np.round(seen[:, i] / step) * step
        found.append(np.nan_to_num(seen - true))
    return tuple(found)


def start_doubt(system: Observed, scales: Scales) -> Array:
    """Covariance of a state that was read off the first few samples.

    Angles come from positions, rates from their slope over a few samples, the wind-up from nothing but the effort. A
    gearbox hardly damps its own mode, so that what is not doubted here would ring on as a mismatch.
    """
    angle = 3.0 * np.sqrt(system.R[0])
    rate = angle / (FIRST * scales.period)
    sizes = [angle, rate] if len(system.Ad) == 2 else [angle + scales.windup, rate, scales.windup, 2 * rate]
    doubt = np.diag(np.square(sizes))
    if len(system.Ad) == 4:  # the joint's angle is measured: what the wind-up has too much, the motor has too little
        doubt[0, 2] = doubt[2, 0] = -(scales.windup**2)
    return doubt


def shaken_of(record: JointRecord, scales: Scales, model: JointModel) -> Array:
    """Torque by which the drive may have moved unseen over the step before each sample: its jump beside lost ones.

    An effort acts until the next sample, so that the last that is in doubt acts over a step that follows both. A lost
    one is drawn on a line, off which it was as far as others are, however near its neighbours: from one on a sound arm
    was given a load. Where a log holds but some of a controller's efforts, any jump is in doubt.
    """
    effort = record[record.effort] * scales.torque / scales.effort
    jump = np.maximum(np.abs(np.diff(effort, prepend=effort[0])), np.abs(np.diff(effort, append=effort[-1])))
    off_line = 1.5**0.5 * noise_of(record.t, effort, 2)
    jump = np.maximum(jump, np.where(np.isfinite(record["position"]), 0.0, off_line))
    shaken = np.concatenate([[0.0], np.where(beside_lost(record), jump, 0.0)[:-1]])
    return np.maximum(shaken, unseen_jumps(effort)) if is_thinned(record.t, model.controller) else shaken
