"""Cases: a joint, what acts in it, a motion, and the two files a tool is given of it; the truth is kept apart."""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from gsfdi.proof import motions
from gsfdi.proof.joints import MUJOCO_SHAPE, Shape, known_friction, nominal_of, shape_for, varied
from gsfdi.proof.kinds import KINDS, NEARLY, PARAMETERS, Kind, equivalents
from gsfdi.proof.mujoco_world import run_mujoco
from gsfdi.proof.sizes import SIZES, Rng, Scales, faulty_controller
from gsfdi.proof.world import (
    Effect,
    Joint,
    Log,
    Motion,
    Telemetry,
    World,
    logged,
    model_file,
    run,
    write_recording,
)
from gsfdi.types import Array

Group = Literal["single", "null", "double", "triple", "unknown", "withheld", "little", "mujoco"]
EPOCH_NS = 1_767_225_600_000_000_000  # 2026-01-01, the same for every case
SMOOTHLY = 0.15
"""Share of the joints with known friction in which it turns round smoothly, which their models do not say."""


@dataclass(frozen=True, slots=True)
class Design:
    """What is asked of a case before anything is drawn: which kinds act together, how large, in what circumstances."""

    group: Group
    kinds: tuple[str, ...] = ()
    size: str = "plain"
    exact_nominal: bool = False

    @property
    def name(self) -> str:
        """What tables call it."""
        return "+".join(self.kinds) or self.group


@dataclass(frozen=True, slots=True)
class Case:
    """Everything about one case; `files` goes to the tool, `truth` into the seal."""

    design: Design
    seed: int
    world: World
    nominal: Joint
    nominal_known: tuple[Effect, ...]
    motions: tuple[Motion, ...]
    telemetry: Telemetry
    controller_told: bool
    scales: Scales
    withheld: tuple[str, ...] = ()
    wrong_gains: tuple[Effect, ...] = ()

    def runs(self, world: World | None = None, *, noisy: bool = True) -> list[Array]:
        """Traces of each motion, in this case's world or in another with the same noise."""
        world = self.world if world is None else world
        return [run(world, motion, self.seed * 10 + k, noisy=noisy) for k, motion in enumerate(self.motions)]

    def recorded(self, *, noisy: bool = True) -> list[Array]:
        """Traces of each motion as this case's engine makes them: MuJoCo's, or those of `runs`."""
        if self.design.group != "mujoco":
            return self.runs(noisy=noisy)
        seeds = [self.seed * 10 + k for k in range(len(self.motions))]
        return [run_mujoco(self.world, motion, s, noisy=noisy) for s, motion in zip(seeds, self.motions, strict=True)]

    def logs(self) -> Iterator[tuple[Motion, Log]]:
        """What each recording holds."""
        for k, (motion, traces) in enumerate(zip(self.motions, self.recorded(), strict=True)):
            yield motion, logged(motion, traces, self.telemetry, self.seed * 10 + k)


def scales_of(world: World, moved: tuple[Motion, ...]) -> Scales:
    """Measure what the world does on its motions without noise."""
    joint = world.joint
    traces = np.vstack([run(world, motion, 0, noisy=False) for motion in moved])
    effort = np.abs(traces[:, 2])
    torque = float(np.quantile(effort, 0.95)) * joint.torque_constant * joint.gear_ratio
    low, high = float(traces[:, 0].min()), float(traces[:, 0].max())
    return Scales(
        torque=torque,
        speed=float(np.quantile(np.abs(traces[:, 5]), 0.95)),
        effort=float(np.quantile(effort, 0.95)),
        reach=0.5 * (high - low),
        centre=0.5 * (high + low),
        windup=float(np.quantile(np.abs(traces[:, 3]), 0.95)) or 1.0,
        seconds=float(moved[0].t[-1]),
        peak_effort=float(effort.max()),
    )


def draw(design: Design, seed: int) -> Case:
    """Draw a case of this design; the same design and seed give the same case."""
    rng = np.random.default_rng((seed, 0))
    kinds = [KINDS[name] for name in design.kinds]
    shape = MUJOCO_SHAPE if design.group == "mujoco" else shape_for(kinds, rng)
    joint = shape.joint if rng.random() < 0.5 else varied(shape.joint, rng)
    telemetry = _telemetry(kinds, rng)
    jitter = 0.15 if rng.random() < 0.1 and design.group != "mujoco" else 0.0
    if rng.random() < 0.1 and design.kinds != ("quantisation",):
        joint = replace(joint, position_resolution=8 * joint.position_noise)
    moved = _motions(design, shape, joint, jitter, rng)
    if any(kind.onset or kind.name == "torque_constant_drift" for kind in kinds):
        moved = moved[:1]  # what sets in does so once
    if rng.random() < 0.12:
        last = moved[0].t[-1]
        telemetry = replace(telemetry, gap=(0.45 * last, 0.5 * last))
    scales = scales_of(World(joint), moved)
    known = known_friction(kinds, shape, joint, scales, rng)
    scales = replace(scales, peak_effort=scales_of(World(joint, known), moved).peak_effort)
    dry = any(effect.term == "coulomb_friction" for effect in known)
    smooth = dry and design.group != "mujoco" and rng.random() < SMOOTHLY
    world, effects = _bearable(
        kinds, World(joint, known, smooth=smooth), moved, scales, SIZES[design.size], rng, design.group == "mujoco"
    )
    exact = design.exact_nominal or (bool(kinds) and all(kind.family == "parameter" for kind in kinds))
    nominal, nominal_known = (joint, known) if exact else nominal_of(joint, known, rng)
    told = any(kind.family in ("controller", "sensor") or kind.name == "current_limit" for kind in kinds)
    return Case(
        design=design,
        seed=seed,
        world=world,
        nominal=nominal,
        nominal_known=nominal_known,
        motions=moved,
        telemetry=telemetry,
        controller_told=told or rng.random() < 0.85,
        scales=scales,
        withheld=_unknown(effects, joint) if design.group == "withheld" else (),
        wrong_gains=tuple(effect for effect in effects if effect.term.startswith("controller_")),
    )


def _unknown(effects: list[Effect], joint: Joint) -> tuple[str, ...]:
    """Terms that the tool must do without, to know none of `effects`: theirs and what describes them as well."""
    told = {"controller": False}
    alike = ((e.term, *equivalents(joint, e, told), *NEARLY.get(e.term, ())) for e in effects)
    return tuple(dict.fromkeys(name for names in alike for name in names))


def _telemetry(kinds: list[Kind], rng: Rng) -> Telemetry:
    """Draw what the log holds and loses; what a kind cannot do without is there."""
    warm = any(kind.name.startswith("temperature_dependent_friction") for kind in kinds)
    senses = any(kind.name.startswith("velocity_") for kind in kinds)
    return Telemetry(
        motor_velocity=senses or rng.random() < 0.7,
        setpoint_rate=rng.random() < 0.8,
        temperature=warm or rng.random() < 0.3,
        lost=float(rng.uniform(0.005, 0.04)) if rng.random() < 0.15 else 0.0,
    )


def _motions(design: Design, shape: Shape, joint: Joint, jitter: float, rng: Rng) -> tuple[Motion, ...]:
    """Draw one motion, or two shorter ones; a rotary joint may begin anywhere."""
    calm = 0.04 if design.group == "little" else 1.0
    seconds = float(rng.uniform(*shape.seconds))
    several = 2 if rng.random() < 0.15 and design.group != "mujoco" else 1
    moved = []
    for _ in range(several):
        motion = motions.draw(
            rng, seconds / several**0.5, joint.sample_rate, calm * shape.reach, calm * shape.speed, jitter
        )
        start = rng.uniform(-0.4, 0.4) if joint.axis == "rotary" else 0.0
        moved.append(replace(motion, setpoint=motion.setpoint + start))
    return tuple(moved)


def _bearable(
    kinds: list[Kind], clean: World, moved: tuple[Motion, ...], scales: Scales, size: float, rng: Rng, mujoco: bool
) -> tuple[World, list[Effect]]:
    """Draw the effects, smaller until the joint still follows its setpoint; a lost loop needs no tool to be seen."""
    usual = _tracking(clean, moved)
    while True:
        effects, variant, real = [], 0, clean.joint
        for kind in kinds:
            effect = kind.draw(scales, clean.joint, size, rng)
            if kind.onset and (rng.random() < 0.5 or kind.name == "position_bias"):
                effect = replace(effect, onset=float(rng.uniform(0.2, 0.7) * moved[0].t[-1]))
            if mujoco:
                effect = replace(effect, side="motor" if effect.side else None, onset=None)
            if kind.family == "controller":
                real = faulty_controller(real, effect)
            variant = max(variant, kind.variant)
            effects.append(effect)
        acting = tuple(effect for effect in effects if not effect.term.startswith("controller_"))
        world = replace(clean, joint=real, effects=acting, variant=variant)
        if _tracking(world, moved) < 1.5 * usual:
            return world, effects
        size *= 0.6


def _tracking(world: World, moved: tuple[Motion, ...]) -> float:
    """Peak of setpoint minus true position over all motions; infinite if the loop is lost."""
    error = np.concatenate([run(world, motion, 0, noisy=False)[:, 0] - motion.setpoint for motion in moved])
    with np.errstate(over="ignore", invalid="ignore"):
        peak = float(np.abs(error).max())
    return peak if np.isfinite(peak) else math.inf


def write_files(case: Case, folder: Path) -> list[str]:
    """Write what the tool may see: recordings and nominal model, under names that say nothing."""
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for k, (motion, log) in enumerate(case.logs()):
        name = "recording.parquet" if len(case.motions) == 1 else f"recording_{k + 1}.parquet"
        start = EPOCH_NS + k * 3600 * 1_000_000_000
        write_recording(folder / name, case.world.joint, motion, log, case.telemetry, start)
        names.append(name)
    (folder / "nominal.toml").write_text(model_file(case.nominal, case.nominal_known, controller=case.controller_told))
    return names


def truth_of(case: Case) -> dict[str, object]:
    """Give what the seal holds of a case: what acts and where, what is merely off, what no data could tell apart."""
    joint = case.world.joint
    given = {"controller": case.controller_told, "motor_velocity": case.telemetry.motor_velocity}
    kinds = [KINDS[name] for name in case.design.kinds]
    acting = (*case.world.effects, *case.wrong_gains)
    numbers = {term: (getattr(joint, name), getattr(case.nominal, name)) for term, name in PARAMETERS.items()}
    known_off = [a.term for a, b in zip(case.world.known, case.nominal_known, strict=True) if a.values != b.values]
    return {
        "group": case.design.group,
        "kinds": list(case.design.kinds),
        "size": case.design.size,
        "seed": case.seed,
        "structure": joint.structure,
        "axis": joint.axis,
        "effects": [
            {
                "term": effect.term,
                "component": kind.component,
                "family": kind.family,
                "variant": kind.variant,
                "side": effect.side,
                "parameters": {name: float(value) for name, value in effect.values.items()},
                "onset_s": effect.onset,
                "equivalents": list(equivalents(joint, effect, given)),
            }
            for kind, effect in zip(kinds, acting, strict=True)
        ],
        "known": [effect.term for effect in case.world.known],
        "known_off": known_off,
        "known_smooth": case.world.smooth,
        "nominal_off": {term: float(true / told) for term, (true, told) in numbers.items() if true != told},
        "withheld": list(case.withheld),
        "told": given,
        "seconds": case.scales.seconds,
        "scales": asdict(case.scales),
    }
