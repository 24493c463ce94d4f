"""Reconcile joints whose controller nobody tells, and which is no PID law: cascades and computed torques.

``python benchmarks/unruled.py [--first 100] [--seconds 60] [--jobs 2]``

Prints a line a joint: what was left out, if anything, and what was named. A loop of speed sees that smoothed over a few
samples and sums it up with all its noise; a computed torque knows inertia and damping. The joints are stepped by
leap-frog, speeds and angles by turns, and share no code with gsfdi's simulator nor with that of the proof.
"""

import argparse
from dataclasses import dataclass
from itertools import product

import numba
import numpy as np
from tally import tally

from gsfdi.model import JointModel, Plant, Sensors
from gsfdi.reconcile import reconcile
from gsfdi.types import Array, JointRecord

STEPS = 100  # a tick


@dataclass(frozen=True)
class Site:
    """A joint and what moves it: ticks a second, reach [rad], acceleration [rad/s²], bandwidth of the loop [rad/s]."""

    rate: float
    reach: float
    push: float
    bandwidth: float
    plant: Plant
    sensors: Sensors


JOINTS = {
    "harmonic drive": Site(
        500.0, 1.2, 3.0, 14.0,
        Plant(1.3, 6e-5, 100.0, 16000.0, 0.9, 0.11), Sensors(1.2e-5, 1e-5, 0.0, 0.05, 0.0, 5e-3),
    ),
    "crane": Site(
        50.0, 1.0, 0.08, 3.0,
        Plant(2200.0, 0.05, 180.0, 9e5, 60.0, 1.9), Sensors(2.4e-5, 1.5e-5, 0.0, 0.01, 0.0, 0.01),
    ),
    "wrist": Site(
        1000.0, 1.5, 12.0, 22.0,
        Plant(0.06, 1.2e-5, 51.0, 2600.0, 0.08, 1 / 51), Sensors(0.0, 2e-5, 0.0, 0.1, 0.0, 0.01),
    ),
}  # fmt: skip
LOOPS = ("cascade", "computed torque")
SHARES = {None: 0.0, "coulomb_friction": 0.05, "gravity_unbalance": 0.2, "cogging": 0.03}
"""What is left out, and how large it is as a share of the torque that accelerates the joint."""
ORDER = 7.0


@dataclass(frozen=True)
class Job:
    """One joint under one loop, without one effect."""

    joint: str
    loop: str
    term: str | None
    seed: int
    seconds: float


def asked_for(rate: float, seconds: float, reach: float, push: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Setpoint and its rate: from place to place by polynomials of the fifth order, with rests between."""
    t = np.arange(round(rate * seconds)) / rate
    setpoint, speed, begun, here = np.zeros(t.size), np.zeros(t.size), 0.5, 0.0
    while begun < seconds:
        way = rng.uniform(-reach, reach) - here
        takes = max((5.8 * abs(way) / push) ** 0.5, 20.0 / rate)
        u = np.clip((t - begun) / takes, 0.0, 1.0)
        setpoint += way * u**3 * (10 - 15 * u + 6 * u**2)
        speed += way / takes * 30 * u**2 * (1 - u) ** 2
        begun, here = begun + takes + rng.uniform(0.0, 1.0), here + way
    return setpoint, speed


@numba.njit
def steps(plant, gains, smoothing, told, asked, noise, grain, effect, tick, out):  # type: ignore[no-untyped-def]
    """Run the loop; `effect` is Coulomb friction, weight, and cogging, of which the last two act by their angles."""
    output, motor, turns, stiffness, damping, drive = plant
    joint = shaft = asked[0, 0]
    rate = speed = seen = swept = 0.0
    h = tick / STEPS
    for k in range(len(asked)):
        angle, shown = joint + noise[k, 0], speed + noise[k, 1]
        angle = np.round(angle / grain) * grain if grain > 0.0 else angle
        seen += (shown - seen) / (1.0 + smoothing)
        error = asked[k, 0] - angle
        short = gains[0] * error + asked[k, 1] - seen
        swept += tick * short
        effort = gains[1] * short + gains[2] * swept + told[k]
        out[k, 0], out[k, 1], out[k, 2] = angle, turns * shown, effort + noise[k, 2]
        for _ in range(STEPS):
            joint, shaft = joint + 0.5 * h * rate, shaft + 0.5 * h * speed
            spring = stiffness * (joint - shaft)
            rate -= h / output * (spring + damping * rate + effect[1] * np.sin(joint - 0.3))
            push = drive * effort + spring - effect[2] * np.sin(ORDER * turns * shaft)
            moved, held = speed + h / motor * push, h / motor * effect[0]
            speed = moved - min(max(moved, -held), held)
            joint, shaft = joint + 0.5 * h * rate, shaft + 0.5 * h * speed


def recorded(job: Job) -> tuple[JointRecord, JointModel]:
    """Record a joint, and give the model that knows neither its loop nor what was left out."""
    site, rng = JOINTS[job.joint], np.random.default_rng(job.seed)
    plant, sensors, rate, bandwidth = site.plant, site.sensors, site.rate, site.bandwidth
    motor, drive = plant.gear_ratio**2 * plant.motor_inertia, plant.gear_ratio * plant.torque_constant
    inertia = plant.output_inertia + motor
    asked = np.column_stack(asked_for(rate, job.seconds, site.reach, site.push, rng))
    sizes = (sensors.position_noise, sensors.motor_velocity_noise / plant.gear_ratio, sensors.effort_noise)
    noise, out = rng.standard_normal((len(asked), 3)) * sizes, np.empty((len(asked), 3))
    known = job.loop == "computed torque"
    told = known * (inertia * np.gradient(asked[:, 1], 1 / rate) + plant.damping * asked[:, 1]) / drive
    gains = np.array([0.5, 1.0, 0.0 if known else 0.15 * bandwidth]) * [bandwidth, inertia * bandwidth / drive, 1.0]
    gains[2] *= gains[1]
    effect = np.array([SHARES[job.term] * site.push * inertia * (job.term == name) for name in list(SHARES)[1:]])
    numbers = (plant.output_inertia, motor, plant.gear_ratio, plant.stiffness, plant.damping, drive)
    steps(numbers, gains, 0.0 if known else 3.5, told, asked, noise, sensors.position_resolution, effect, 1 / rate, out)
    names = ("setpoint", "setpoint_rate", "position", "motor_velocity", "motor_current")
    channels = dict(zip(names, np.column_stack([asked, out]).T, strict=True))
    model = JointModel("J1", "flexible", plant, sensors=sensors)
    return JointRecord("outside", "J1", 0, np.arange(len(asked)) / rate, channels), model


def one(job: Job) -> tuple[bool, str]:
    """Reconcile a joint; whether the right name came alone, and a line about it."""
    record, model = recorded(job)
    found = reconcile([record], model)
    named = [entry["term"] for entry in found.omitted_physics]
    right = named == ([job.term] if job.term else [])
    line = f"{job.joint}, {job.loop}, without {job.term or 'nothing'} ({job.seed}): {found.verdict} {', '.join(named)}"
    return right, line if right else f"NOT RIGHT {line}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=100, help="seed of the first joint")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    kinds = product(JOINTS, LOOPS, SHARES)
    jobs = [Job(*kind, seed, given.seconds) for seed, kind in enumerate(kinds, start=given.first)]
    print(tally(one, jobs, given.jobs), "named rightly and alone")


if __name__ == "__main__":
    main()
