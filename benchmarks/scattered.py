"""Joints of any size: six decades of inertia, with and without a gearbox, in loops of 50 Hz to 1 kHz.

``python benchmarks/scattered.py [--first 5000] [--cases 60] [--jobs 2] [--silent]`` draws each joint, its law, sensors
and motion by chance, lets up to two things act in it, leaves out some of what a log or model may lack, and prints what
was named. It asks above all that nothing ends in a message about a bug; the recordings are those of gsfdi's own
simulator, so that what is named proves little. With `--silent` sensors have no noise, as in a plain simulation.
"""

import argparse
import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from tally import tally

from gsfdi.errors import UnusableInputError
from gsfdi.model import Controller, Effort, JointModel, Plant, Sensors, Side, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord

DAMPING = 0.02  # of the gearbox's own mode, as a share of the critical one


@dataclass(frozen=True, slots=True)
class Scene:
    """A joint and the wave that it is asked to follow: its reach [rad] and rate [rad/s]."""

    model: JointModel
    reach: float
    rate: float

    @property
    def torque(self) -> float:
        """Torque at the output that the wave takes [N m]."""
        plant = self.model.plant
        return (plant.output_inertia + plant.motor_inertia * plant.gear_ratio**2) * self.rate**2 * self.reach


def scene_of(rng: np.random.Generator, silent: bool) -> Scene:
    """Draw a joint whose law is fast enough for its sampling and slow enough for its gearbox."""
    rigid, inertia = rng.random() < 0.35, 10 ** rng.uniform(-5, 3)
    mode, sampling = 10 ** rng.uniform(0.3, 2.2), float(rng.choice([50, 100, 200, 500, 1000]))
    effort: Effort = "drive_torque" if rigid and rng.random() < 0.5 else "motor_current"
    constant = 1.0 if effort == "drive_torque" else 10 ** rng.uniform(-2, 0.5)
    gear = 1.0 if effort == "drive_torque" else float(rng.choice([1, 1, 30, 100, 260]))
    if rigid:
        plant = Plant(output_inertia=inertia, gear_ratio=gear, torque_constant=constant)
    else:
        spring = (2 * np.pi * mode) ** 2 * inertia
        motor = inertia * 10 ** rng.uniform(-1, 1) / gear**2
        plant = Plant(inertia, motor, gear, spring, 2 * DAMPING * np.sqrt(spring * inertia), constant)
    whole, unit = inertia + plant.motor_inertia * gear**2, gear * constant
    band = 2 * np.pi * min(10 ** rng.uniform(-0.3, 1.2), sampling / 15, mode / 4)
    law = Controller(
        whole * band**2 / unit, whole * band**3 / 8 / unit, 1.4 * whole * band / unit, sampling, effort=effort
    )
    reach, rate, noise = (
        10 ** rng.uniform(-2, 0.5),
        min(band / 4, 10 ** rng.uniform(-1, 0.6)),
        10 ** rng.uniform(-5, -1.5),
    )
    sensors = Sensors(
        position_noise=reach * 10 ** rng.uniform(-6, -3.5),
        motor_velocity_noise=(1.0 if rigid else gear) * reach * rate * noise,
        effort_noise=whole * rate**2 * reach / unit * noise,
    )
    sensors = Sensors() if silent else sensors
    return Scene(
        JointModel("J", "rigid" if rigid else "flexible", plant, controller=law, sensors=sensors, effort=effort),
        reach,
        rate,
    )


def acting(scene: Scene, rng: np.random.Generator) -> tuple[TermUse, ...]:
    """Draw nothing, one or two things that the nominal model lacks."""
    model, torque, tick = scene.model, scene.torque, 1.0 / scene.model.controller.sample_rate  # type: ignore[union-attr]
    flexible = model.structure == "flexible"
    side: Side | None = ("motor" if rng.random() < 0.5 else "output") if flexible else None
    wet = torque / (scene.reach * scene.rate) * 10 ** rng.uniform(-1.5, 0.5)
    pool = [
        TermUse("coulomb_friction", {"torque_nm": torque * 10 ** rng.uniform(-1.5, 1)}, side),
        TermUse("viscous_friction", {"coefficient_nms_rad": wet}, side),
        TermUse("constant_load", {"torque_nm": torque * rng.uniform(-2, 2)}, "output" if flexible else None),
        TermUse("position_gain", {"ratio": rng.uniform(0.9, 1.1)}),
        TermUse("position_bias", {"bias_rad": scene.reach * 0.01}, None, 8.0),
        TermUse("velocity_lag", {"lag_s": rng.uniform(0.1, 2) * tick}),
        TermUse("actuation_delay", {"delay_s": rng.uniform(0.2, 3) * tick}),
    ]
    count = 0 if rng.random() < 0.25 else int(rng.integers(1, 3))
    return tuple(pool[i] for i in rng.choice(len(pool), count, replace=False))


def recorded(scene: Scene, acts: tuple[TermUse, ...], seed: int, rng: np.random.Generator) -> JointRecord:
    """Simulate the joint along two waves."""
    base = simulate_record(replace(scene.model, sensors=Sensors()), seed=seed, duration=float(rng.uniform(4, 25)))
    waves = ((scene.reach, scene.rate), (scene.reach / 3, 2.7 * scene.rate))
    phases = rng.uniform(0, 6, 2)
    place = sum(a * np.sin(w * base.t + p) for (a, w), p in zip(waves, phases, strict=True))
    rate = sum(a * w * np.cos(w * base.t + p) for (a, w), p in zip(waves, phases, strict=True))
    asked = replace(base, channels={**base.channels, "setpoint": place, "setpoint_rate": rate}, valid={})
    return simulate_record(replace(scene.model, physics=acts), replay=asked, seed=seed)


def lacking(record: JointRecord, model: JointModel, rng: np.random.Generator) -> tuple[JointRecord, JointModel]:
    """Leave out channels, rows, the law or the sensors, and get the output's inertia wrong."""
    rare, gone = rng.random(6) < 0.3, list[str]()
    plant = replace(model.plant, output_inertia=model.plant.output_inertia * rng.uniform(0.8, 1.3))
    gone += ["motor_velocity", "joint_velocity"] * int(rare[0]) + ["setpoint_rate"] * int(rare[1])
    gone += ["setpoint", "setpoint_rate"] * int(rare[2] and rare[3])
    told = replace(
        model,
        plant=plant,
        controller=None if rare[2] else model.controller,
        sensors=Sensors() if rare[4] else model.sensors,
    )
    keep = rng.random(len(record.t)) > (0.05 if rare[5] else 0.0)
    channels = {name: record[name][keep] for name in record.channels if name not in gone}
    return replace(record, t=record.t[keep], channels=channels, valid={}), told


def one(seed: int, silent: bool) -> tuple[bool, str]:
    """Draw one joint and reconcile it; tell whether that ended in no bug, and what came of it."""
    rng = np.random.default_rng(seed)
    scene = scene_of(rng, silent)
    acts = acting(scene, rng)
    true = ", ".join(use.term for use in acts) or "nothing"
    try:
        record, model = lacking(recorded(scene, acts, seed, rng), scene.model, rng)
        start = time.process_time()
        answer = reconcile([record], model)
    except UnusableInputError as error:
        return True, f"{true} ({seed}): cannot be used: {error}"
    except Exception as error:  # any other is what this looks for
        return False, f"{true} ({seed}): BUG {error!r}"
    named = ", ".join(str(entry["term"]) for entry in answer.omitted_physics) or "nothing"
    return True, f"{true} ({seed}): {answer.verdict}, {named}, {time.process_time() - start:.0f} s"


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--first", type=int, default=5000, help="seed of the first joint")
    asked.add_argument("--cases", type=int, default=60)
    asked.add_argument("--jobs", type=int, default=2)
    asked.add_argument("--silent", action="store_true", help="sensors without noise")
    call = asked.parse_args()
    jobs = range(call.first, call.first + call.cases)
    print(f"{tally(partial(one, silent=call.silent), jobs, call.jobs)} ended in no bug")


if __name__ == "__main__":
    main()
