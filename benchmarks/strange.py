"""Joints that the proof's plan does not draw: of other scales, or with a model that says nothing, too little or wrong.

``python benchmarks/strange.py [FAMILY...] [--first 100] [--jobs 2]`` prints one line a case: what was left out, what
was named, and how long that took; at the end how many first names were right and how many sound joints stayed unnamed.
The joints and what acts in them are those of the proof's own world, which shares no code with gsfdi's simulator.
"""

import argparse
import time
import tomllib
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import pyarrow.parquet as pq
import tomli_w

from gsfdi import ingest
from gsfdi.modelfile import load_models
from gsfdi.proof.cases import Design, draw, write_files
from gsfdi.proof.joints import CURRENT, FLEXIBLE, LINEAR, TORQUE, Shape
from gsfdi.reconcile import reconcile

COBOT = replace(
    FLEXIBLE,
    motor_inertia=1e-4,
    gear_ratio=100.0,
    output_inertia=1.2,
    stiffness=2e4,
    damping=0.5,
    torque_constant=0.1,
    proportional=550.0,
    integral=1000.0,
    derivative=17.6,
    sample_rate=500.0,
    position_noise=3e-6,
    motor_velocity_noise=0.02,
    effort_noise=0.005,
)
DIRECT = replace(
    CURRENT,
    sample_rate=400.0,
    output_inertia=0.05,
    torque_constant=0.5,
    proportional=40.0,
    integral=60.0,
    derivative=2.5,
    position_noise=2e-5,
    motor_velocity_noise=5e-3,
    effort_noise=0.01,
)
ROUNDED = replace(FLEXIBLE, effort_resolution=1e-3, motor_velocity_resolution=5e-3)
NOISY = replace(FLEXIBLE, position_noise=4e-5, motor_velocity_noise=2e-2, effort_noise=2e-3)


@dataclass(frozen=True, slots=True)
class Family:
    """Joints of a shape; what their model does not say; by what its noise is off; what nobody logged.

    Known friction that is `smooth` turns round over a range of speed, of which the model says nothing.
    """

    shape: Shape
    silent: tuple[str, ...] = ()
    noise: float = 1.0
    unlogged: tuple[str, ...] = ()
    smooth: bool = False


ARM, LIGHT = Shape(FLEXIBLE, 0.6, 0.06, (100, 140), 0.4), Shape(COBOT, 1.2, 0.8, (20, 30), 0.5)
FAMILIES = {
    "no sensors stated": Family(ARM, silent=("sensors",)),
    "noise stated a third": Family(ARM, noise=1 / 3),
    "noise stated threefold": Family(ARM, noise=3.0),
    "rounded": Family(replace(ARM, joint=ROUNDED)),
    "rounded, no sensors stated": Family(replace(ARM, joint=ROUNDED), silent=("sensors",)),
    "ten times the noise": Family(replace(ARM, joint=NOISY)),
    "short": Family(replace(ARM, seconds=(25, 30))),
    "smooth friction": Family(replace(ARM, friction=1.0), smooth=True),
    "no law, no setpoint": Family(ARM, silent=("controller",), unlogged=("setpoint",)),
    "no law, no speed": Family(ARM, silent=("controller",), unlogged=("motor_velocity",)),
    "nothing but setpoint, effort and position": Family(
        ARM, silent=("controller", "sensors"), unlogged=("motor_velocity",)
    ),
    "torque, nothing but these": Family(
        Shape(TORQUE, 1.0, 1.0, (40, 60), 1.0), silent=("controller", "sensors"), unlogged=("motor_velocity",)
    ),
    "light": Family(LIGHT),
    "light, no sensors stated": Family(LIGHT, silent=("sensors",)),
    "direct, no sensors stated": Family(Shape(DIRECT, 1.0, 2.0, (15, 20), 0.6), silent=("sensors",)),
    "torque, no sensors stated": Family(Shape(TORQUE, 1.0, 1.0, (40, 60), 1.0), silent=("sensors",)),
    "linear, no sensors stated": Family(Shape(LINEAR, 0.12, 0.2, (24, 25), 1.0), silent=("sensors",)),
}
KINDS = (
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "cable_harness",
    "output_inertia_change",
    "position_gain",
)
ROTARY = ("cogging", "gravity_unbalance")
AMPERES = ("torque_constant_change", "current_bias")
GEARED = ("backlash", "stiffness_change", "gearbox_hysteresis")
SOUND = 4
"""Joints of every family in which nothing is wrong but the model's numbers."""


@dataclass(frozen=True, slots=True)
class Told:
    """How a case went: whether it was right, and a line on it."""

    family: str
    sound: bool
    right: bool
    line: str


def designs(family: Family) -> list[Design]:
    """Lay out every kind that can act in a joint of the family, and sound joints."""
    joint = family.shape.joint
    kinds = KINDS + (ROTARY if joint.axis == "rotary" else ())
    kinds += (AMPERES if joint.effort == "motor_current" else ()) + (GEARED if joint.structure == "flexible" else ())
    sizes = ("moderate", "plain")
    return [Design("single", (kind,), sizes[i % 2]) for i, kind in enumerate(kinds)] + SOUND * [Design("null")]


def misled(folder: Path, family: Family) -> None:
    """Make of a case's files what the family says that is told of it."""
    path = folder / "nominal.toml"
    document = {key: value for key, value in tomllib.loads(path.read_text()).items() if key not in family.silent}
    for name in document.get("sensors", {}):
        document["sensors"][name] *= family.noise if "noise" in name else 1.0
    path.write_text(tomli_w.dumps(document))
    for recording in folder.glob("*.parquet") if family.unlogged else ():
        table = pq.read_table(recording)
        pq.write_table(table.select([n for n in table.column_names if not n.startswith(family.unlogged)]), recording)


def one(job: tuple[str, Design, int]) -> Told:
    """Draw one case, reconcile it, and compare; a number of the model that is off is no physics."""
    name, design, seed = job
    family = FAMILIES[name]
    cases = "gsfdi.proof.cases"
    shape, share = patch(f"{cases}.shape_for", return_value=family.shape), patch(f"{cases}.SMOOTHLY", family.smooth)
    with TemporaryDirectory() as place, shape, share:
        folder = Path(place)
        case = draw(design, seed)
        write_files(case, folder)
        misled(folder, family)
        records = ingest.read(sorted(folder.glob("*.parquet"))).records
        start = time.process_time()
        answer = reconcile(records, load_models(folder / "nominal.toml").for_joint(records[0].joint))
        took = time.process_time() - start
    found = [str(entry["term"]) for entry in answer.omitted_physics]
    true = [effect.term for effect in case.world.effects]
    if true:
        right = found[:1] == true
    else:
        right = answer.verdict != "unexplained" and all(term.endswith("_change") for term in found)
    line = f"{design.name} ({seed}): {answer.verdict}, {', '.join(found) or 'nothing'}, {took:.0f} s"
    return Told(name, not true, right, f"{name}: {'' if right else 'NOT RIGHT '}{line}")


def main() -> None:
    """Run the families that are asked for, or all."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("families", nargs="*", metavar="FAMILY", help=" | ".join(FAMILIES))
    asked.add_argument("--first", type=int, default=100, help="seed of the first case of every family")
    asked.add_argument("--jobs", type=int, default=2)
    call = asked.parse_args()
    names = call.families or list(FAMILIES)
    if unknown := [name for name in names if name not in FAMILIES]:
        asked.error(f"no such family: {unknown[0]}")
    jobs = [(name, design, call.first + i) for name in names for i, design in enumerate(designs(FAMILIES[name]))]
    right, asked_of = Counter[tuple[str, bool]](), Counter[tuple[str, bool]]()
    with ProcessPoolExecutor(call.jobs) as pool:
        for told in pool.map(one, jobs):
            print(told.line, flush=True)
            right[told.family, told.sound] += told.right
            asked_of[told.family, told.sound] += 1
    for name in names:
        acting, sound = (f"{right[name, calm]} of {asked_of[name, calm]}" for calm in (False, True))
        print(f"{name}: first name right {acting}, nothing but numbers named {sound} sound joints")


if __name__ == "__main__":
    main()
