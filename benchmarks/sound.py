"""Reconcile sound joints whose friction turns round over a range of speeds, and in their model at once.

``python benchmarks/sound.py [--first 100] [--joints 60] [--jobs 2]`` prints a line for each that is given a name, and
at the end how many were. A rigid joint of 2 kg m² with 2 N m of dry friction, 25 to 61 s at 100 Hz on a trajectory of
its own, once with its speed logged and twice without: nothing is wrong, but how two simulators write a friction. Made
by gsfdi's own simulator, to see what noise and an unlogged speed make of that alone.
"""

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.contract import without_speed
from gsfdi.simulate import simulate_record

JOINT = JointModel(
    name="J",
    structure="rigid",
    plant=Plant(output_inertia=2.0, gear_ratio=1.0, torque_constant=1.0),
    controller=Controller(200.0, 100.0, 40.0, 100.0, effort="drive_torque"),
    sensors=Sensors(position_noise=1e-5, motor_velocity_noise=1e-3),
    effort="drive_torque",
)
NOISES = (0.03, 0.1)  # [N m], of some 2 that the drive gives
TURNS = (0.0, 2e-4, 5e-4)  # [rad/s], a share of 0.03 of the slowest trajectory's speed at most


@dataclass(frozen=True)
class Sound:
    """One sound joint, and whether its speed is logged."""

    seed: int
    noise: float
    turns: float
    logged: bool


def sound(first: int, joints: int) -> Iterator[Sound]:
    """Lay out sound joints."""
    for n in range(joints):
        seed, kind = divmod(n, len(NOISES) * len(TURNS))
        yield Sound(first + seed, NOISES[kind // len(TURNS)], TURNS[kind % len(TURNS)], (first + seed) % 3 == 0)


def names(case: Sound) -> list[str]:
    """What `reconcile` names in a sound joint."""
    friction = {"torque_nm": 2.0}
    sensors = replace(JOINT.sensors, effort_noise=case.noise)
    model = replace(JOINT, sensors=sensors, physics=(TermUse("coulomb_friction", friction),))
    turns = {"smooth_rad_s": case.turns} if case.turns else {}
    real = replace(model, physics=(TermUse("coulomb_friction", {**friction, **turns}),))
    record = simulate_record(real, seed=case.seed, duration=25.0 + case.seed % 4 * 12.0)
    shown = record if case.logged else without_speed(record)
    return [entry["term"] for entry in reconcile([shown], model).omitted_physics]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--joints", type=int, default=60)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    cases = list(sound(given.first, given.joints))
    with ProcessPoolExecutor(given.jobs) as pool:
        named = [(case, found) for case, found in zip(cases, pool.map(names, cases), strict=True) if found]
    for case, found in named:
        print(f"{case}: {', '.join(found)}")
    print(f"{len(named)} of {len(cases)} sound joints were given a name")


if __name__ == "__main__":
    main()
