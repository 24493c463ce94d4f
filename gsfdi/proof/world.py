"""A joint of the proof's own making: its truth, what its telemetry shows, and the files that a tool is given."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w
from scipy.interpolate import CubicSpline

from gsfdi.channels import CHANNELS, Axis
from gsfdi.proof.effects import SLOT, SLOTS, WIDTH
from gsfdi.proof.integrator import LAW, PLANT, integrate
from gsfdi.types import Array, Mask

LEAD_IN = 5.0  # [s] of dwell before the first row, so that a recording does not begin with an empty integrator


@dataclass(frozen=True, slots=True)
class Joint:
    """The linear joint, its controller and its sensors, as they truly are; fields as in the contract's model file."""

    structure: Literal["flexible", "rigid"] = "flexible"
    axis: Axis = "rotary"
    motor_inertia: float = 0.0011
    gear_ratio: float = 260.6
    output_inertia: float = 400.0
    stiffness: float = 130000.0
    damping: float = 0.4
    torque_constant: float = 0.6
    proportional: float = 28.0
    integral: float = 4.0
    derivative: float = 17.0
    rate_feedforward: float = 1.0
    limit: float = math.inf
    sample_rate: float = 100.0
    effort: Literal["motor_current", "drive_torque"] = "motor_current"
    position_resolution: float = 1e-6
    position_noise: float = 4e-6
    motor_velocity_resolution: float = 0.0
    motor_velocity_noise: float = 2e-3
    effort_resolution: float = 0.0
    effort_noise: float = 2e-4


def tuned(joint: Joint, numbers: Mapping[str, float]) -> Joint:
    """Give the joint other numbers."""
    return replace(joint, **numbers)  # type: ignore[arg-type]  # mypy cannot tell that these fields are floats


@dataclass(frozen=True, slots=True)
class Effect:
    """Something that acts in the world: a contract term (or an invention), its parameters, side and onset [s]."""

    term: str
    values: Mapping[str, float]
    side: Literal["motor", "output"] | None = None
    onset: float | None = None


@dataclass(frozen=True, slots=True)
class Motion:
    """What the joint is asked to do, tick by tick, and what surrounds it."""

    t: Array
    setpoint: Array
    rate: Array
    feedforward: Array
    temperature: Array


@dataclass(frozen=True, slots=True)
class Log:
    """What a recording of the motion holds: time, measured channels, and which rows reached the ground."""

    t: Array
    position: Array
    motor_velocity: Array
    effort: Array
    kept: Mask


@dataclass(frozen=True, slots=True)
class Telemetry:
    """How the recording is written: which optional columns, and what is lost on the way."""

    motor_velocity: bool = True
    setpoint_rate: bool = True
    temperature: bool = False
    feedforward: bool = False
    lost: float = 0.0
    gap: tuple[float, float] | None = None


SMOOTH = 3


@dataclass(frozen=True, slots=True)
class World:
    """A joint with effects that act in it and, in `known`, friction that its nominal model knows of."""

    joint: Joint
    known: tuple[Effect, ...] = ()
    effects: tuple[Effect, ...] = ()
    variant: int = 0
    """1: Lorentzian Stribeck curve, 2: lossy backlash flanks, 3: smooth friction, 4: Fröhlich's saturation, 5: a
    harness that hardens, 6: friction by the exponential of the temperature; 0: the laws as the contract reads."""
    smooth: bool = False
    """Whether its own dry friction turns round smoothly, of which the nominal model says nothing."""
    outside: Mapping[str, float] = field(default_factory=dict)

    def without(self) -> "World":
        """Give the same world where nothing is left out of its nominal model."""
        return replace(self, effects=(), variant=0, outside={})


def table_of(effects: Sequence[Effect]) -> tuple[Array, Array]:
    """Lay effects out as the integrator reads them: sizes (slots, 4) and onsets (slots,)."""
    sizes, onsets = np.zeros((len(SLOTS), WIDTH)), np.full(len(SLOTS), np.inf)
    for effect in effects:
        if effect.term in LOGGED or effect.term in OUTSIDE:
            continue
        row = SLOT[effect.term] if effect.term in SLOT else SLOT[f"{_family(effect.term)}_{effect.side or 'motor'}"]
        values = [value for name, value in effect.values.items() if name != "onset_s"]
        sizes[row, : len(values)] = values
        onsets[row] = -np.inf if effect.onset is None else effect.onset
    return sizes, onsets


def _family(term: str) -> str:
    return {
        "coulomb_friction": "coulomb",
        "viscous_friction": "viscous",
        "stribeck_friction": "stribeck",
        "presliding_friction": "presliding",
        "asymmetric_friction": "asymmetric",
    }[term]


def _vibration(t: Array, size: Mapping[str, float], _: np.random.Generator) -> Array:
    """Torque of a base that shakes at a frequency of its own, coming and going."""
    swell = 0.6 + 0.4 * np.sin(2 * np.pi * t / 37.0)
    return np.column_stack([size["torque_nm"] * swell * np.sin(2 * np.pi * size["frequency_hz"] * t), np.zeros(t.size)])


def _neighbour(t: Array, size: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Torque of a neighbouring joint that moves on a schedule of its own."""
    torque = np.zeros(t.size)
    for start in rng.uniform(0.0, t[-1], max(3, int(t[-1] / 12))):
        x = (t - start) / rng.uniform(2.0, 5.0)
        torque += rng.choice([-1.0, 1.0]) * np.where((x > 0) & (x < 1), np.sin(2 * np.pi * np.clip(x, 0, 1)), 0.0)
    return np.column_stack([size["torque_nm"] * torque, np.zeros(t.size)])


def _grab(t: Array, size: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Dry friction of a brake that now and then fails to release."""
    grip = np.zeros(t.size)
    for start in rng.uniform(0.0, t[-1], max(3, int(t[-1] / 9))):
        grip[(t >= start) & (t < start + rng.uniform(0.2, 1.5))] = 1.0
    return np.column_stack([np.zeros(t.size), size["torque_nm"] * grip])


OUTSIDE = {"base_vibration": _vibration, "neighbour_motion": _neighbour, "grabbing_brake": _grab}
"""Inventions that act from outside of the joint, as a torque and as dry friction over time."""


def run(world: World, motion: Motion, seed: int, *, noisy: bool = True, limit_step: float = 5e-4) -> Array:
    """Let the world move; one row per tick of the motion and the columns of `integrator.integrate`.

    The same seed gives the same sensor noise whatever acts in the world, so that two runs differ by the effect alone.
    """
    joint, rng = world.joint, np.random.default_rng((seed, 1))
    dt = 1.0 / joint.sample_rate
    lead = round(LEAD_IN / dt)
    t = np.concatenate([motion.t[0] + dt * np.arange(-lead, 0), motion.t])
    noise = rng.standard_normal((t.size, 3))
    noise *= [joint.position_noise, joint.motor_velocity_noise, joint.effort_noise] if noisy else [0.0, 0.0, 0.0]
    resolution = [joint.position_resolution, joint.motor_velocity_resolution, joint.effort_resolution]
    outside = np.zeros((t.size, 2))
    for effect in world.effects:
        if effect.term in OUTSIDE:
            outside[lead:] += OUTSIDE[effect.term](motion.t, effect.values, np.random.default_rng((seed, 2)))
    sizes, onsets = table_of((*world.known, *world.effects))

    def padded(values: Array, before: float) -> Array:
        return np.concatenate([np.full(lead, before), values])

    traces: Array = integrate(
        t,
        padded(motion.setpoint, motion.setpoint[0]),
        padded(motion.rate, 0.0),
        padded(motion.feedforward, 0.0),
        padded(motion.temperature, motion.temperature[0]),
        outside,
        noise,
        np.array(resolution if noisy else [0.0, 0.0, 0.0]),
        np.array([getattr(joint, name) for name in PLANT]),
        np.array([getattr(joint, name) for name in LAW]),
        sizes,
        onsets,
        world.variant,
        world.smooth or world.variant == SMOOTH,
        joint.structure == "rigid",
        min(limit_step, 0.25 * dt),
    )
    for effect in world.effects:
        if effect.term in LOGGED:
            begun = t >= (effect.onset if effect.onset is not None else -np.inf)
            traces = np.where(begun[:, None], LOGGED[effect.term](t, traces, noise, effect), traces)
    return traces[lead:]


def stamped_late(t: Array, traces: Array, noise: Array, late: Effect) -> Array:
    """Let measured position and motor speed in the log be `delay_s` older than their stamp."""
    out = traces.copy()
    when = t - late.values["delay_s"]
    for column in (0, 1):
        clean = traces[:, column] - noise[:, column]
        out[:, column] = CubicSpline(t, clean)(np.maximum(when, t[0])) + noise[:, column]
    return out


def filtered(t: Array, traces: Array, noise: Array, smooth: Effect) -> Array:
    """Let the motor speed in the log, noise aside, pass a filter of the first order whose time constant is `lag_s`.

    Exactly, for a cubic from sample to sample: of a cubic v the filter τ y' + y = v makes v - τ v' + τ² v'' - τ³ v''',
    beside which what it began with fades as exp(-t/τ). Steps that resolved a lag of 20 µs were a hundred million.
    """
    out, lag, h = traces.copy(), smooth.values["lag_s"], np.diff(t)
    third, second, first, speed = CubicSpline(t, traces[:, 1] - noise[:, 1]).c
    bend = 2 * second - lag * 6 * third
    begins = speed - lag * (first - lag * bend)
    ends = begins + h * (first - lag * bend + h * (0.5 * bend + h * third))
    slow = np.full(len(t), speed[0])
    for i, fades in enumerate(np.exp(-h / lag)):
        slow[i + 1] = ends[i] + (slow[i] - begins[i]) * fades
    out[:, 1] = slow + noise[:, 1]
    return out


LOGGED = {"timestamp_latency": stamped_late, "velocity_lag": filtered}
"""Effects on what is logged alone."""


def recorded(t: Array, telemetry: Telemetry) -> Mask:
    """Whether samples lie outside the gap of a recording."""
    first, last = telemetry.gap or (math.inf, math.inf)
    return np.asarray((t < first) | (t >= last))


def logged(motion: Motion, traces: Array, telemetry: Telemetry, seed: int) -> Log:
    """Choose the rows that reach the ground."""
    t = motion.t
    kept = (np.random.default_rng((seed, 3)).random(t.size) >= telemetry.lost) & recorded(t, telemetry)
    kept[[0, -1]] = True
    return Log(t, traces[:, 0], traces[:, 1], traces[:, 2], kept)


def write_recording(path: Path, joint: Joint, motion: Motion, log: Log, telemetry: Telemetry, start_ns: int) -> None:
    """Write a recording in the contract's columns."""
    keep = log.kept
    columns = {"setpoint": motion.setpoint, "position": log.position, joint.effort: log.effort}
    if telemetry.setpoint_rate:
        columns["setpoint_rate"] = motion.rate
    if telemetry.motor_velocity:
        columns["motor_velocity"] = log.motor_velocity
    if telemetry.temperature:
        columns["temperature"] = motion.temperature
    if telemetry.feedforward:
        columns[f"{joint.effort}_feedforward"] = motion.feedforward
    stamps = start_ns + np.round(log.t[keep] * 1e9).astype(np.int64)
    fields = [pa.field("timestamp", pa.timestamp("ns", tz="UTC"), metadata={"unit": "ns", "description": "time"})]
    arrays: list[pa.Array] = [pa.array(stamps, type=fields[0].type)]
    fields.append(pa.field("joint", pa.string(), metadata={"unit": "", "description": "joint name"}))
    arrays.append(pa.array(np.full(stamps.size, "J1"), type=pa.string()))
    for name, values in columns.items():
        channel = CHANNELS[name]
        meta = {"unit": channel.unit(joint.axis), "description": channel.meaning}
        fields.append(pa.field(channel.column(joint.axis), pa.float64(), metadata=meta))
        arrays.append(pa.array(values[keep], type=pa.float64()))
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), path, compression="zstd")


def model_file(joint: Joint, known: Sequence[Effect], *, controller: bool = True) -> str:
    """Spell a joint as a contract model file (TOML)."""
    linear = joint.axis == "linear"
    length, torque = ("m", "n") if linear else ("rad", "nm")
    plant: dict[str, float] = {}
    if linear:
        plant["moving_mass_kg"] = joint.output_inertia
        if joint.damping:
            plant["viscous_damping_ns_m"] = joint.damping
    else:
        plant["output_inertia_kg_m2"] = joint.output_inertia
        plant["viscous_damping_nms_rad"] = joint.damping
    if joint.structure == "flexible":
        plant |= {
            "motor_inertia_kg_m2": joint.motor_inertia,
            "gear_ratio": joint.gear_ratio,
            "gearbox_stiffness_nm_rad": joint.stiffness,
        }
    elif joint.gear_ratio != 1.0:
        plant["gear_ratio"] = joint.gear_ratio
    unit = "a" if joint.effort == "motor_current" else torque
    if joint.effort == "motor_current":
        plant["torque_constant_n_a" if linear else "torque_constant_nm_a"] = joint.torque_constant
    document: dict[str, object] = {
        "schema": "gsfdi/model/1",
        "name": "J1",
        "structure": joint.structure,
        "axis": joint.axis,
        "plant": plant,
    }
    if controller:
        law: dict[str, object] = {
            "type": "pid",
            f"proportional_{unit}_{length}": joint.proportional,
            f"integral_{unit}_{length}s" if unit == "n" else f"integral_{unit}_{length}_s": joint.integral,
            f"derivative_{unit}s_{length}": joint.derivative,
            "rate_feedforward": joint.rate_feedforward,
            "sample_rate_hz": joint.sample_rate,
        }
        if math.isfinite(joint.limit):
            law[f"limit_{unit}"] = joint.limit
        document["controller"] = law
    effort = "motor_current_noise_a" if unit == "a" else f"drive_{'force' if linear else 'torque'}_noise_{unit}"
    document["sensors"] = {
        f"position_resolution_{length}": joint.position_resolution,
        f"position_noise_{length}": joint.position_noise,
        f"motor_velocity_noise_{length}_s": joint.motor_velocity_noise,
        effort: joint.effort_noise,
    }
    physics: list[dict[str, object]] = []
    for effect in known:
        entry: dict[str, object] = {"term": effect.term}
        if effect.side is not None:
            entry["side"] = effect.side
        physics.append(entry | {spelled(name, joint.axis): value for name, value in effect.values.items()})
    if physics:
        document["physics"] = physics
    return tomli_w.dumps(document)


def spelled(parameter: str, axis: Axis) -> str:
    """Name a contract parameter for the axis: linear drives say ``_n`` and ``_m`` for ``_nm`` and ``_rad``."""
    if axis == "rotary":
        return parameter
    return parameter.replace("_nms2_rad2", "_ns2_m2").replace("_nms", "_ns").replace("_nm", "_n").replace("_rad", "_m")
