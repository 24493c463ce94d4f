"""Reconcile joints as a plain simulator would make them: small Euler steps, textbook laws, sums by rectangles.

``python benchmarks/stepped.py [--steps 100] [--share 0.1] [--first 100] [--without speed] [--jobs 2]`` prints a line an
effect: what was left out, what was named. The joint is that of ``configs/era_joint.toml`` with inertias and spring a
few per cent off; every step moves the speeds first and the angles with them, `steps` of them a tick, so that the log
has shifts of time of half a step; the controller counts its newest error at once. Dry friction turns round as
tanh(v / 2e-4 rad/s). Shares no code with gsfdi's simulator, nor with that of the proof.
"""

import argparse
import math
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

from gsfdi.model import Controller, JointModel
from gsfdi.modelfile import load_models
from gsfdi.reconcile import reconcile
from gsfdi.types import Array, JointRecord

MODEL = Path(__file__).resolve().parents[1] / "configs" / "era_joint.toml"
TICK, SECONDS, TURN = 0.01, 120.0, 2e-4
NUMBERS = (
    *("drive", "drift", "ripple", "cogging", "saturation", "rotor", "dry", "dry_out", "viscous", "viscous_out"),
    *("stribeck", "asymmetric", "loaded", "bump", "quadratic", "spring", "cubic", "gap", "loop", "lossy", "error"),
    *("link", "weight", "cable", "mode", "push", "stop"),
)
AT = {name: place for place, name in enumerate(NUMBERS)}
EFFECTS = {
    "torque_constant_change": "drive",
    "torque_constant_drift": "drift",
    "torque_ripple": "ripple",
    "cogging": "cogging",
    "magnetic_saturation": "saturation",
    "motor_inertia_change": "rotor",
    "coulomb_friction": "dry",
    "coulomb_friction at the output": "dry_out",
    "viscous_friction": "viscous",
    "viscous_friction at the output": "viscous_out",
    "stribeck_friction": "stribeck",
    "asymmetric_friction": "asymmetric",
    "load_dependent_friction": "loaded",
    "position_dependent_friction": "bump",
    "quadratic_friction": "quadratic",
    "stiffness_change": "spring",
    "stiffening": "cubic",
    "backlash": "gap",
    "gearbox_hysteresis": "loop",
    "gearbox_damping": "lossy",
    "transmission_error": "error",
    "output_inertia_change": "link",
    "gravity_unbalance": "weight",
    "cable_harness": "cable",
    "structural_mode": "mode",
    "constant_load": "push",
    "end_stop": "stop",
    "nothing": "",
}
"""What is left out, and the number that it is sized by, as a share of what the drive or the motion has of its kind."""


@numba.njit
def stepped(r, rate, e, size, steps, noise, joint, law, out):  # type: ignore[no-untyped-def]
    """Write position, motor speed and current of the joint; `size` is torque, speed, wind-up, current, reach."""
    jm, jl, k, d, turns, kt = joint
    force, fast, windup, amperes, reach = size
    h = TICK / steps
    xm = xl = xa = r[0]
    vm = vl = va = swept = z = 0.0
    for n in range(len(r)):
        shown = round((xl + noise[n, 0]) / 1e-6) * 1e-6
        turning = turns * vm + noise[n, 1]
        swept += (r[n] - shown) * TICK
        i = law[0] * (r[n] - shown) + law[1] * swept + law[2] * (rate[n] - turning / turns)
        out[n, 0], out[n, 1], out[n, 2] = shown, turning, i + noise[n, 2]
        gain = turns * kt * (1 - e[0]) * (1 - e[1] * max(n * TICK - 30.0, 0.0) / 60.0)
        if e[4] > 0:
            x = abs(i) * math.sqrt(3 * e[4]) / amperes
            gain *= math.tanh(x) / x if x > 1e-6 else 1.0
        for _ in range(steps):
            phi = turns * xm
            dry, dry_out, x = math.tanh(vm / TURN), math.tanh(vl / TURN), vm / fast
            wave = 0.1 * e[20] * windup * math.sin(2 * phi)
            lever = 1 - 0.2 * e[20] * windup * turns * math.cos(2 * phi)
            bent = xm - xl - wave
            bent = math.copysign(max(abs(bent) - e[17] * windup, 0.0), bent)
            pull = k * (1 - e[15]) * bent + e[16] * k * bent**3 / windup**2
            z += h * (vm - vl - abs(vm - vl) * z / (0.3 * windup)) if e[18] > 0 else 0.0
            pull += e[18] * force * z / (0.3 * windup) + e[19] * force * (vm - vl) / (2 * windup)
            drag = e[6] * dry + e[8] * x + e[10] * math.exp(-((x / 0.15) ** 2)) * dry
            drag += e[11] * (0.5 * abs(dry) + 0.5 * abs(x)) + e[14] * x * abs(x)
            drag += e[13] * math.exp(-0.5 * ((xl / reach - 0.3) / 0.15) ** 2) * dry
            drive = gain * i * (1 + e[2] * math.sin(phi)) - e[3] * force * math.sin(6 * phi)
            held = (
                e[7] * dry_out + e[9] * vl / fast + 3 * e[22] * math.sin(xl + 0.5) + e[23] * (xl / reach - 0.3) + e[25]
            )
            held += 20 * e[26] * max(xl / reach - 0.9, 0.0)
            load = d * vl + force * held
            if e[24] > 0:
                tug = 121.0 * (xl - xa) + 0.44 * (vl - va)  # at 1.75 Hz, damped by 0.02
                load += e[24] * jl * tug
                va += h * tug
                xa += h * va
            vm += h * (drive - force * drag - e[12] * abs(pull) * dry - lever * pull) / (jm * (1 + e[5]))
            vl += h * (pull - load) / (jl * (1 + e[21]))
            xm, xl = xm + h * vm, xl + h * vl


def setpoint(rng: np.random.Generator, swings: bool) -> Array:
    """A sum of four sines that fades in, or smooth strokes with rests between them."""
    t = np.arange(0.0, SECONDS, TICK)
    if swings:
        f, phase = rng.uniform(0.02, 0.35, 4), rng.uniform(0.0, 6.28, 4)
        r = np.sum(rng.uniform(0.3, 1.0, 4) / f * np.sin(2 * np.pi * np.outer(t, f) + phase), axis=1)
        fade = np.clip(t / 5.0, 0.0, 1.0)
        return np.asarray((r - r[0]) * 0.06 / np.abs(np.gradient(r, TICK)).max() * fade**2 * (3 - 2 * fade))
    r, at = np.zeros(len(t)), 0
    while at < len(t):
        s = np.linspace(0.0, 1.0, int(rng.uniform(4.0, 10.0) / TICK))
        goal = np.clip(r[at - 1] + rng.choice([-1, 1]) * rng.uniform(0.05, 0.3), -0.6, 0.6)
        stroke = r[at - 1] + (goal - r[at - 1]) * s**3 * (10 - 15 * s + 6 * s**2)
        stroke = np.append(stroke, np.full(int(rng.uniform(0.5, 3.0) / TICK), goal))[: len(t) - at]
        r[at : at + len(stroke)] = stroke
        at += len(stroke)
    return r


@dataclass(frozen=True, slots=True)
class Job:
    """An effect, its share, the seed of its joint, the steps of a tick, and whether a speed is logged."""

    effect: str
    share: float
    seed: int
    steps: int
    speed: bool


def recorded(job: Job, model: JointModel) -> JointRecord:
    """Simulate the joint twice: without the effect, for the scales, and with it."""
    law, plant = model.controller, model.plant
    assert isinstance(law, Controller)
    rng = np.random.default_rng(job.seed)
    r = setpoint(rng, job.seed % 2 == 0)
    rate, turns = np.gradient(r, TICK), plant.gear_ratio
    off = 1 + np.array([0.02, 0.03, 0.03]) * rng.standard_normal(3)
    nominal = (plant.motor_inertia * turns**2, plant.output_inertia, plant.stiffness)
    joint = (*(off * nominal), plant.damping, turns, plant.torque_constant)
    gains = (law.proportional, law.integral, law.derivative)
    noise = rng.standard_normal((len(r), 3)) * [4e-6, 2e-3, 2e-4]
    plain, out, none = np.empty((len(r), 3)), np.empty((len(r), 3)), np.zeros(len(NUMBERS))
    stepped(r, rate, none, (1.0, 1.0, 1.0, 1.0, 1.0), job.steps, 0 * noise, joint, gains, plain)
    torque, speed = turns * plant.torque_constant * plain[:, 2], plain[:, 1] / turns
    windup = np.abs(torque - joint[0] * np.gradient(speed, TICK)).max() / joint[2]
    sizes = (np.sqrt(np.mean(torque**2)), np.abs(speed).max(), windup, np.abs(plain[:, 2]).max(), 0.5 * np.ptp(r))
    effect = none.copy()
    if name := EFFECTS[job.effect]:
        effect[AT[name]] = job.share
    stepped(r, rate, effect, sizes, job.steps, noise, joint, gains, out)
    channels = {"setpoint": r, "setpoint_rate": rate, "position": out[:, 0], "motor_current": out[:, 2]}
    channels |= {"motor_velocity": out[:, 1]} if job.speed else {}
    return JointRecord("stepped", model.name, 0, TICK * np.arange(len(r)), channels, source="stepped")


def one(job: Job) -> tuple[bool, str]:
    """Reconcile one joint: whether it was named rightly and nothing besides, but numbers that really are off."""
    model = load_models(MODEL).for_joint("")
    start = time.process_time()
    answer = reconcile([recorded(job, model)], model)
    took = time.process_time() - start
    true = job.effect.split()[0]
    aside = {"motor_inertia_change", "output_inertia_change", "stiffness_change"} - {true}
    named = [str(entry["term"]) for entry in answer.omitted_physics]
    right = [name for name in named if name not in aside] == ([] if true == "nothing" else [true])
    told = f"{answer.verdict}, {', '.join(named) or 'nothing'}, {took:.0f} s"
    alike = "; ".join("/".join(group) for group in answer.indistinguishable)
    return right, f"{'' if right else 'NOT RIGHT '}{job.effect} ({job.seed}): {told}{alike and f', alike: {alike}'}"


def main() -> None:
    """Run every effect once."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--steps", type=int, default=100, help="Euler steps per tick of 10 ms")
    asked.add_argument("--share", type=float, default=0.1, help="size of the effects")
    asked.add_argument("--first", type=int, default=100, help="seed of the first joint")
    asked.add_argument("--without", choices=["speed"], help="what nobody logs")
    asked.add_argument("--jobs", type=int, default=2)
    call = asked.parse_args()
    jobs = [
        Job(effect, call.share, call.first + i, call.steps, call.without != "speed") for i, effect in enumerate(EFFECTS)
    ]
    with ProcessPoolExecutor(call.jobs) as pool:
        found = []
        for right, line in pool.map(one, jobs):
            print(line, flush=True)
            found.append(right)
    print(f"named rightly and alone: {sum(found)} of {len(found)}")


if __name__ == "__main__":
    main()
