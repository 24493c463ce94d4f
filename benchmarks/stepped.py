"""Reconcile joints as a plain simulator would make them: small Euler steps, textbook laws, sums by rectangles.

``python benchmarks/stepped.py [--steps 100] [--exact] [--ramps] [--share 0.1] [--first 100] [--without CHANNEL]``

Prints a line an effect: what was left out, what was named. The joint is that of ``configs/era_joint.toml`` with
inertias and spring a few per cent off; every step moves the speeds first and the angles with them, `steps` of them a
tick, so that the log has shifts of time of half a step (``--exact`` takes steps that leave none); the controller counts
its newest error at once. Dry friction turns round as tanh(v / 2e-4 rad/s). Shares no code with gsfdi's simulator, nor
with that of the proof.
"""

import argparse
import math
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from tally import tally

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
def rates(y, i, t, e, size, joint, out):  # type: ignore[no-untyped-def]
    """Write the rates of the state: angle and speed of motor, link and appendage, and the bristle's stretch."""
    jm, jl, k, d, turns, kt = joint
    force, fast, windup, amperes, reach = size
    xm, vm, xl, vl, xa, va, z = y
    gain = turns * kt * (1 - e[0]) * (1 - e[1] * max(t - 30.0, 0.0) / 60.0)
    if e[4] > 0:
        x = abs(i) * math.sqrt(3 * e[4]) / amperes
        gain *= math.tanh(x) / x if x > 1e-6 else 1.0
    phi = turns * xm
    dry, dry_out, x = math.tanh(vm / TURN), math.tanh(vl / TURN), vm / fast
    wave = 0.1 * e[20] * windup * math.sin(2 * phi)
    lever = 1 - 0.2 * e[20] * windup * turns * math.cos(2 * phi)
    bent = xm - xl - wave
    bent = math.copysign(max(abs(bent) - e[17] * windup, 0.0), bent)
    pull = k * (1 - e[15]) * bent + e[16] * k * bent**3 / windup**2
    out[6] = vm - vl - abs(vm - vl) * z / (0.3 * windup) if e[18] > 0 else 0.0
    pull += e[18] * force * z / (0.3 * windup) + e[19] * force * (vm - vl) / (2 * windup)
    drag = e[6] * dry + e[8] * x + e[10] * math.exp(-((x / 0.15) ** 2)) * dry
    drag += e[11] * (0.5 * abs(dry) + 0.5 * abs(x)) + e[14] * x * abs(x)
    drag += e[13] * math.exp(-0.5 * ((xl / reach - 0.3) / 0.15) ** 2) * dry
    drive = gain * i * (1 + e[2] * math.sin(phi)) - e[3] * force * math.sin(6 * phi)
    held = e[7] * dry_out + e[9] * vl / fast + 3 * e[22] * math.sin(xl + 0.5) + e[23] * (xl / reach - 0.3) + e[25]
    load = d * vl + force * (held + 20 * e[26] * max(xl / reach - 0.9, 0.0))
    tug = 121.0 * (xl - xa) + 0.44 * (vl - va)  # at 1.75 Hz, damped by 0.02
    load += e[24] * jl * tug
    out[0], out[2], out[4] = vm, vl, va
    out[1] = (drive - force * drag - e[12] * abs(pull) * dry - lever * pull) / (jm * (1 + e[5]))
    out[3] = (pull - load) / (jl * (1 + e[21]))
    out[5] = tug


@numba.njit
def by_euler(y, i, t, h, e, size, joint, slope):  # type: ignore[no-untyped-def]
    """Step the speeds, then the angles with them."""
    rates(y, i, t, e, size, joint, slope[0])
    for j in (1, 3, 5, 6):
        y[j] += h * slope[0, j]
    for j in (0, 2, 4):
        y[j] += h * y[j + 1]


@numba.njit
def by_runge_kutta(y, i, t, h, e, size, joint, slope):  # type: ignore[no-untyped-def]
    """Step everything by the classic rule of four."""
    rates(y, i, t, e, size, joint, slope[0])
    for n, part in ((1, 0.5), (2, 0.5), (3, 1.0)):
        rates(y + part * h * slope[n - 1], i, t, e, size, joint, slope[n])
    y += h / 6 * (slope[0] + 2 * slope[1] + 2 * slope[2] + slope[3])


@numba.njit
def stepped(r, rate, e, size, steps, exact, noise, joint, law, out):  # type: ignore[no-untyped-def]
    """Write position, motor speed and current of the joint; `size` is torque, speed, wind-up, current, reach."""
    turns, swept, h = joint[4], 0.0, TICK / steps
    y, slope = np.zeros(7), np.zeros((4, 7))
    y[0] = y[2] = y[4] = r[0]
    for n in range(len(r)):
        shown = round((y[2] + noise[n, 0]) / 1e-6) * 1e-6
        turning = turns * y[1] + noise[n, 1]
        swept += (r[n] - shown) * TICK
        i = law[0] * (r[n] - shown) + law[1] * swept + law[2] * (rate[n] - turning / turns)
        out[n, 0], out[n, 1], out[n, 2] = shown, turning, i + noise[n, 2]
        for _ in range(steps):
            if exact:
                by_runge_kutta(y, i, n * TICK, h, e, size, joint, slope)
            else:
                by_euler(y, i, n * TICK, h, e, size, joint, slope)


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


def ramps(rng: np.random.Generator) -> Array:
    """Strokes whose speed rises, holds and falls in straight lines, with rests between them."""
    speed, at, place = np.zeros(round(SECONDS / TICK)), 100, 0.0
    while at < len(speed) - 200:
        way, fast, rise = rng.uniform(-0.5, 0.5) - place, rng.uniform(0.02, 0.06), rng.uniform(0.02, 0.05)
        fast = min(fast, math.sqrt(abs(way) * rise))
        t = np.arange(0.0, abs(way) / fast + fast / rise, TICK)
        stroke = np.clip(np.minimum(rise * t, rise * (t[-1] + TICK - t)), 0.0, fast)[: len(speed) - at]
        speed[at : at + len(stroke)] = math.copysign(1.0, way) * stroke
        place += math.copysign(1.0, way) * float(stroke.sum()) * TICK
        at += len(stroke) + int(rng.uniform(0.5, 3.0) / TICK)
    return np.asarray(np.cumsum(speed) * TICK)


@dataclass(frozen=True, slots=True)
class Job:
    """An effect, its share, a joint's seed, the steps of a tick and their rule, the motion, and what is not logged."""

    effect: str
    share: float
    seed: int
    steps: int
    exact: bool
    ramps: bool
    unlogged: str | None


def recorded(job: Job, model: JointModel) -> JointRecord:
    """Simulate the joint twice: without the effect, for the scales, and with it."""
    law, plant = model.controller, model.plant
    assert isinstance(law, Controller)
    rng = np.random.default_rng(job.seed)
    r = ramps(rng) if job.ramps else setpoint(rng, job.seed % 2 == 0)
    rate, turns = np.gradient(r, TICK), plant.gear_ratio
    off = 1 + np.array([0.02, 0.03, 0.03]) * rng.standard_normal(3)
    nominal = (plant.motor_inertia * turns**2, plant.output_inertia, plant.stiffness)
    joint = (*(off * nominal), plant.damping, turns, plant.torque_constant)
    gains = (law.proportional, law.integral, law.derivative)
    noise = rng.standard_normal((len(r), 3)) * [4e-6, 2e-3, 2e-4]
    plain, out, none = np.empty((len(r), 3)), np.empty((len(r), 3)), np.zeros(len(NUMBERS))
    stepped(r, rate, none, (1.0, 1.0, 1.0, 1.0, 1.0), job.steps, job.exact, 0 * noise, joint, gains, plain)
    torque, speed = turns * plant.torque_constant * plain[:, 2], plain[:, 1] / turns
    windup = np.abs(torque - joint[0] * np.gradient(speed, TICK)).max() / joint[2]
    sizes = (np.sqrt(np.mean(torque**2)), np.abs(speed).max(), windup, np.abs(plain[:, 2]).max(), 0.5 * np.ptp(r))
    effect = none.copy()
    if name := EFFECTS[job.effect]:
        effect[AT[name]] = job.share
    stepped(r, rate, effect, sizes, job.steps, job.exact, noise, joint, gains, out)
    motion = {"setpoint": r, "setpoint_rate": rate, "position": out[:, 0], "motor_velocity": out[:, 1]}
    channels = {"motor_current": out[:, 2], **{name: x for name, x in motion.items() if name != job.unlogged}}
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
    asked.add_argument("--steps", type=int, default=100, help="steps per tick of 10 ms")
    asked.add_argument("--share", type=float, default=0.1, help="size of the effects")
    asked.add_argument("--first", type=int, default=100, help="seed of the first joint")
    asked.add_argument("--exact", action="store_true", help="Runge and Kutta's steps in place of Euler's")
    asked.add_argument("--ramps", action="store_true", help="move at speeds that rise and fall in straight lines")
    asked.add_argument("--without", choices=["motor_velocity", "setpoint_rate"], help="what nobody logs")
    asked.add_argument("--jobs", type=int, default=2)
    call = asked.parse_args()
    jobs = [
        Job(effect, call.share, call.first + i, call.steps, call.exact, call.ramps, call.without)
        for i, effect in enumerate(EFFECTS)
    ]
    print(f"named rightly and alone: {tally(one, jobs, call.jobs)}")


if __name__ == "__main__":
    main()
