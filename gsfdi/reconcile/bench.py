"""The recordings of one joint, set up so that any model of it can be held against them.

A bench knows what drives each recording, how noisy its sensors are, and in which sizes effects are worth trying here.
It turns models into innovations, and innovations into white ones under a noise model that all hypotheses share.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gsfdi.drive import Drive, drive_of, measured_velocity
from gsfdi.errors import UnusableInputError
from gsfdi.fit import Started
from gsfdi.model import JointModel
from gsfdi.reconcile.offer import Scales
from gsfdi.simulate import Trace, initial_state, replay_many
from gsfdi.types import Array, JointRecord, Mask
from gsfdi.whiten import LONGEST, Observed, Whitener, observed, respond, steady_gain, steps_of, whitener

Ints = npt.NDArray[np.int64]
AWAY = 1e4
"""Innovation of a model that ran away, in standard deviations of its sensor."""
FIRST = 8  # samples from which a replay takes its starting rates
WARM_UP = 0.5  # [s] after every start that decides nothing: the states of terms with memory are unknown there
HOLD_OUT = (0.70, 0.88)
"""Part of the time of every recording that is kept for judging, as shares."""
WINDOWS = (HOLD_OUT, (0.52, 0.70), (0.34, 0.52), (0.16, 0.34))
"""Parts that may be kept: the first whose misfit is like the rest's, so that what acts there acts elsewhere, too."""
USUAL = 0.4
"""Share of the misfit up to which a part of 0.18 of the time is like the rest."""
MOST = 0.05
"""Share of the drive's torque that the observer expects to be missing at most, however much is."""
LEAN = 0.5
"""Least share of the larger side's torque that the observer expects on the other.

An observer that expects everything on the output corrects the wind-up so hard that one whose spring stiffens runs away,
and so does one that expects too much.
"""
TRIFLE = 2e-4
"""Share of the drive's torque that no simulator gets right: sampling, holding, and how a contact is written."""
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
        Sampling periods between samples, and which samples were measured, by stretch.
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

    @property
    def critical(self) -> float:
        """Critical damping of the gearbox's own mode [N m s/rad]."""
        plant = self.model.plant
        motor = plant.gear_ratio**2 * plant.motor_inertia
        if not np.isfinite(plant.stiffness):
            return np.inf
        return float(2 * np.sqrt(plant.stiffness * motor * plant.output_inertia / (motor + plant.output_inertia)))

    def innovations(self, models: Sequence[JointModel]) -> list[Array]:
        """Innovations ``(m, n, 2)`` of each model, by record; NaN where a channel is missing."""
        found = []
        for i, drive in enumerate(self.drives):
            traces = replay_many(models, drive, mode="predict", gain=self.gain, x0=starts(models, drive, i))
            found.append(self._owned(np.stack([trace.innovation for trace in traces]), i))
        return found

    def _owned(self, innovations: Array, stretch: int) -> Array:
        """Make a model that ran away pay for it: what was measured but could not be predicted is missed by far."""
        rows = list(self.system.rows)
        lost = ~np.isfinite(innovations[..., rows]) & self.present[stretch][:, None]
        innovations[..., rows] = np.where(lost, AWAY * np.sqrt(self.system.R), innovations[..., rows])
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
                push = torque * rng.standard_normal((1, len(steps), len(torque)))
                tool = tool.coloured(respond(self.system, self.gain, push, self.grains[i][None], steps)[0])
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
        system = observed(model, self.scales.period, (variances[0], variances[1]))
        return replace(self, system=system, gain=steady_gain(system, spread), spread=spread)

    def white(self, innovations: Sequence[Array], whiteners: Sequence[Whitener]) -> Array:
        """White innovations ``(m, rows)`` over all records, 0 during warm-up."""
        return np.concatenate(
            [w(e) * self.awake(i) for i, (e, w) in enumerate(zip(innovations, whiteners, strict=True))], axis=1
        )

    def awake(self, record: int) -> Array:
        """1 for every row of a record that counts, 0 during warm-up and where it is kept for judging."""
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


def starts(models: Sequence[JointModel], drive: Drive, stretch: int) -> Array:
    """States ``(models, 5)`` in which a stretch begins."""
    found = np.array([initial_state(model, drive.start) for model in models])
    for row, model in zip(found, models, strict=True):
        if isinstance(model, Started) and model.windups:
            row[0] -= model.windups[stretch]
            row[2] += model.windups[stretch]
    return found


def bench(records: Sequence[JointRecord], model: JointModel) -> Bench:
    """Set up the bench for `records` of the joint that `model` describes."""
    usable = [r for r in records if {"position", r.effort} <= set(r.channels) and len(r.t) >= 50]
    if not usable:
        subject = records[0].source if records else model.name
        raise UnusableInputError(
            subject, "has no position or no drive effort", "map position and motor current or torque"
        )
    period = float(np.median(np.concatenate([np.diff(r.t) for r in usable])))
    variances = sensor_variances(usable, model)
    system = observed(model, period, variances)
    scales = scales_of(usable, model, period)
    spread = np.full(system.Bt.shape[1], 0.2 * scales.torque)
    gain = steady_gain(system, spread)
    whole = tuple(stretch for r in usable for stretch in stretches(r, period))
    drives = tuple(drive_of(r, model) for r in whole)
    steps = tuple(steps_of(r.t, period) for r in whole)
    seen = (np.column_stack([r["position"], measured_velocity(r, model)])[:, list(system.rows)] for r in whole)
    present: tuple[Mask, ...] = tuple(np.asarray(np.isfinite(values).all(axis=1)) for values in seen)
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
        shaken=tuple(shaken_of(r, scales) for r in whole),
        scales=scales,
    )
    return replace(stand, grains=grain_errors(stand))


def typical_window(stand: Bench, innovations: Sequence[Array]) -> tuple[float, float]:
    """Choose the part to keep for judging: the first that holds no more than its share of the misfit.

    Parameters
    ----------
    stand : Bench
    innovations : sequence of (n, 2) arrays
        Of the nominal model with its numbers fitted.
    """
    power, when = [], []
    for i, (e, record) in enumerate(zip(innovations, stand.records, strict=True)):
        rows = np.nan_to_num(e[:, list(stand.system.rows)])
        power.append(np.sum(rows**2 / stand.system.R, axis=1))
        when.append(record.t / stand.seconds(i))
    energy, t = np.concatenate(power), np.concatenate(when)
    whole = float(energy[t > 0.02].sum()) or 1.0
    shares = [float(energy[(t >= low) & (t < high)].sum()) / whole for low, high in WINDOWS]
    return next((w for w, share in zip(WINDOWS, shares, strict=True) if share < USUAL), WINDOWS[int(np.argmin(shares))])


def grain_errors(stand: Bench) -> tuple[Array, ...]:
    """Errors of the sensors on this motion, by stretch; nothing where they are fine enough to be white."""
    sensors = stand.model.sensors
    ratio = 1.0 if stand.model.structure == "flexible" else stand.model.plant.gear_ratio
    noise = (sensors.position_noise, sensors.motor_velocity_noise / ratio)
    grain = [max(grain_of(r["position"]) for r in stand.records), 0.0]
    if 1 in stand.system.rows:
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


def stretches(record: JointRecord, period: float) -> list[JointRecord]:
    """Cut `record` at its gaps, and give each missing sample of a short gap a row without measurement.

    Effort and command run straight over such a row; a longer gap hides more than a line can bridge.
    """
    ends = np.flatnonzero(np.diff(record.t) > (LONGEST + 0.5) * period) + 1
    found = []
    for part in np.split(np.arange(len(record.t)), ends):
        if len(part) < 2 * WARM_UP / period + 20:
            continue
        t = record.t[part]
        missing = np.round(np.diff(t) / period).astype(np.int64) - 1
        rows = np.flatnonzero(missing > 0)
        extra = [t[k] + (t[k + 1] - t[k]) * (i + 1) / (missing[k] + 1) for k in rows for i in range(missing[k])]
        times = np.sort(np.concatenate([t, extra]))
        lost = ~np.isin(times, t)
        channels = {}
        for name in record.channels:
            values = record[name][part]
            good = np.isfinite(values)
            full = np.interp(times, t[good], values[good]) if good.any() else np.full(len(times), np.nan)
            bare = lost | (np.interp(times, t, good.astype(float)) < 1)
            channels[name] = np.where(bare, np.nan, full) if name in MEASURED else full
        found.append(replace(record, t=times, channels=channels, valid={}))
    return found


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


def shaken_of(record: JointRecord, scales: Scales) -> Array:
    """Torque by which the drive may have moved unseen over the step before each sample: its jump beside lost ones."""
    effort = record[record.effort] * scales.torque / scales.effort
    lost = ~np.isfinite(record["position"])
    beside = lost | np.roll(lost, 1) | np.roll(lost, -1)
    jump = np.maximum(np.abs(np.diff(effort, prepend=effort[0])), np.abs(np.diff(effort, append=effort[-1])))
    return np.where(beside, jump, 0.0)


MEASURED = ("position", "motor_velocity", "joint_velocity")


def sensor_variances(records: Sequence[JointRecord], model: JointModel) -> tuple[float, float]:
    """Variances of position and motor velocity: as stated by the model, else as the recordings show."""
    stated, found = model.sensors, []
    ratio = 1.0 if model.structure == "flexible" else model.plant.gear_ratio
    positions = [record["position"] for record in records]
    speeds = [measured_velocity(record, model) for record in records]
    for values, noise, resolution in (
        (positions, stated.position_noise, stated.position_resolution),
        (speeds, stated.motor_velocity_noise / ratio, stated.motor_velocity_resolution / ratio),
    ):
        if not all(np.isfinite(v).any() and np.ptp(v[np.isfinite(v)]) > 0 for v in values):
            found.append(np.inf)
            continue
        seen = float(np.median([noise_of(v) for v in values]))
        grain = max(grain_of(v) for v in values)
        believed = np.hypot(noise, max(resolution, grain) / np.sqrt(12.0)) if noise + resolution > 0 else seen
        found.append(max(believed, 1e-3 * seen, 1e-12) ** 2)
    return found[0], found[1]


def noise_of(values: Array) -> float:
    """Standard deviation of a channel's white noise, from fifth differences, which motion hardly enters."""
    values = values[np.isfinite(values)]
    fifth = np.diff(values, 5)
    spread = float(1.4826 * np.median(np.abs(fifth)) / 252.0**0.5)
    return float(max(spread, grain_of(values) / 12.0**0.5))


def grain_of(values: Array) -> float:
    """Step between the values that a channel can take, 0 where it takes any.

    Examples
    --------
    >>> grain_of(np.round(np.sin(np.arange(500.0)) / 0.01) * 0.01)
    0.01
    """
    moves = np.abs(np.diff(values[np.isfinite(values)]))
    size = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    moves = moves[moves > 1e-9 * max(size, 1e-30)]
    if len(moves) < 20:
        return 0.0
    grain = float(moves.min())
    grain = float(np.mean(moves[moves < 1.5 * grain]))
    if np.quantile(moves, 0.9) > 1e4 * grain:
        return 0.0
    off = np.abs(moves / grain - np.round(moves / grain))
    return round(grain, 15) if np.quantile(off, 0.9) < 0.02 else 0.0


def scales_of(records: Sequence[JointRecord], model: JointModel, period: float) -> Scales:
    """Measure how the joint moves, to know in which sizes effects matter."""
    plant = model.plant
    drive: float = 1.0 if records[0].effort == "drive_torque" else plant.gear_ratio * plant.torque_constant
    effort = float(np.nanquantile(np.concatenate([np.abs(r[r.effort]) for r in records]), 0.95))
    position = np.concatenate([r["position"] for r in records])
    low, high = float(np.nanmin(position)), float(np.nanmax(position))
    width = max(1, round(0.1 / period))
    speeds = [np.abs(r["position"][width:] - r["position"][:-width]) / (r.t[width:] - r.t[:-width]) for r in records]
    speed = float(np.nanquantile(np.concatenate(speeds), 0.95))
    torque = max(drive * effort, 1e-12)
    warm = [np.ptp(r["temperature"]) if "temperature" in r else 0.0 for r in records]
    return Scales(
        torque=torque,
        effort=max(effort, 1e-12),
        speed=max(speed, 1e-12),
        reach=max(0.5 * (high - low), 1e-12),
        centre=0.5 * (high + low),
        windup=torque / plant.stiffness if np.isfinite(plant.stiffness) else 1.0,
        inertia=plant.output_inertia,
        period=period,
        seconds=max(float(r.t[-1]) for r in records),
        turns=plant.gear_ratio if np.isfinite(plant.stiffness) else 1.0,
        noise=float(np.sqrt(sensor_variances(records, model)[0])),
        warms=max(warm) > 1.0,
    )


def process_noise(stand: Bench, innovations: Sequence[Array], floor: Array, near: Array | None = None) -> Array:
    """Torque noise [N m] under which `innovations` are most likely, and no less than `floor`.

    Parameters
    ----------
    stand : Bench
        The recordings on their bench.
    innovations : sequence of (n, 2) arrays
        Of the model in hand, by record, under the base gain.
    floor : (k,) array
        What is known to be there: noise of the recorded effort.
    near : (k,) array, optional
        Where to look, each side by itself; without it, both sides alike and over all sizes.
    """

    def best(trials: Sequence[Array]) -> Array:
        return min((surprise(stand, innovations, trial), tuple(trial)) for trial in trials)[1]  # type: ignore[return-value]

    if near is None:
        size = np.array(best([np.maximum(floor, stand.scales.torque * f) for f in 10.0 ** np.arange(-4, 0.6, 0.5)]))
        return np.array(best([np.maximum(floor, size * f) for f in 10.0 ** np.arange(-0.25, 0.3, 0.25)]))
    size = np.maximum(near, floor)
    for side in range(len(floor)):
        moved = np.eye(len(floor))[side]
        size = np.array(best([np.maximum(floor, size * f**moved) for f in 10.0 ** np.arange(-1, 1.1, 0.25)]))
    return size


def surprise(stand: Bench, innovations: Sequence[Array], torque: Array) -> float:
    """Negative log-likelihood, up to a constant, of innovations under process noise of `torque` [N m]."""
    tools = stand.whiteners(torque)
    white = stand.white([e[None] for e in innovations], tools)[0]
    fade = np.concatenate([stand.awake(i)[:: len(stand.system.rows)] for i in range(len(tools))])
    return 0.5 * float(white @ white + np.concatenate([w.logdet for w in tools]) @ fade)


def effort_floor(stand: Bench) -> Array:
    """Torque noise [N m] that the noise of the recorded effort makes, by side; a trifle where none is stated."""
    model = stand.model
    drive = 1.0 if stand.records[0].effort == "drive_torque" else model.plant.gear_ratio * model.plant.torque_constant
    noise = drive * float(np.hypot(model.sensors.effort_noise, model.sensors.effort_resolution / np.sqrt(12.0)))
    trifle = TRIFLE * stand.scales.torque
    return np.array([max(noise, trifle), trifle][: len(stand.spread)])
