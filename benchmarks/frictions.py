"""Reconcile a drive like the EMPS, of which a model knows its mass and its loop, where several frictions act at once.

``python benchmarks/frictions.py [--first 100] [--jobs 2]`` prints a line a drive: what was left out, what was named.

The drive is that of ``configs/emps_joint.toml`` with its mass a few per cent off, moved so slowly that frictions take
most of its force. Every tick of a millisecond is made in twenty steps that move the speed first and the way with it;
what is dry stops the carriage exactly. Shares no code with gsfdi's simulator, nor with that of the proof.
"""

import argparse
import math
import time
from pathlib import Path

import numba
import numpy as np
from tally import tally

from gsfdi.modelfile import load_models
from gsfdi.reconcile import reconcile
from gsfdi.types import Array, JointRecord

MODEL = Path(__file__).resolve().parents[1] / "configs" / "emps_joint.toml"
TICK, STEPS, REACH, FASTEST = 1e-3, 20, 0.12, 0.15
NOISE = np.array([2e-7, 1e-5, 0.5])
DRAGS = (
    "nothing",
    "coulomb_friction",
    "viscous_friction",
    "coulomb_friction viscous_friction",
    "coulomb_friction viscous_friction constant_load",
    "coulomb_friction viscous_friction asymmetric_friction",
    "coulomb_friction viscous_friction stribeck_friction",
    "coulomb_friction viscous_friction position_dependent_friction",
    "viscous_friction presliding_friction",
    "coulomb_friction viscous_friction actuation_delay",
    "coulomb_friction viscous_friction cable_harness",
    "coulomb_friction quadratic_friction",
    "coulomb_friction output_inertia_change",
)
AT = {
    name: place for place, name in enumerate(dict.fromkeys(term for drag in DRAGS[1:] for term in drag.split()))
}  # place of each term in the table of sizes
MASSES = {"output_inertia_change", "torque_constant_change"}


@numba.njit
def moved(r, mass, law, sizes, late, noise, out):  # type: ignore[no-untyped-def]
    """Write position, speed and force of the drive; `sizes` [N] at usual speed as `AT` has them, `late` in steps."""
    dry, wet, push, uneven, slow, spot, bristle, _, cable, square, _ = sizes
    h, x, v, z, sent = TICK / STEPS, r[0], 0.0, 0.0, np.zeros(late + 1)
    at = 0
    for n in range(len(r)):
        shown, speed = round((x + noise[n, 0]) / 1e-7) * 1e-7, v + noise[n, 1]
        force = law[0] * (r[n] - shown) - law[1] * speed
        out[n, 0], out[n, 1], out[n, 2] = shown, speed, force + noise[n, 2]
        for _ in range(STEPS):
            sent[at] = force
            at = (at + 1) % (late + 1)
            fast = v / (0.6 * FASTEST)
            level = dry + slow * math.exp(-((fast / 0.15) ** 2)) + spot * math.exp(-0.5 * ((x - 0.02) / 0.018) ** 2)
            drag = push + cable * (x / REACH - 0.3) + square * fast * abs(fast) + bristle * z
            drag += 0.5 * uneven * (1 + abs(fast)) * (v != 0.0)
            z += h * (v - abs(v) * z) / (0.01 * REACH)
            v = (v + h * (sent[at] - drag) / mass) / (1 + h * wet / (0.6 * FASTEST) / mass)
            v = math.copysign(max(abs(v) - h * level / mass, 0.0), v)
            x += h * v


def setpoint(rng: np.random.Generator, count: int) -> Array:
    """Strokes along trapezoids of speed with rests between them, or smooth strokes under a few slow sines."""
    smooth = rng.random() < 0.5
    r, at = np.zeros(count), int(rng.uniform(1.0, 3.0) / TICK)
    while at < count:
        goal = rng.uniform(-REACH, REACH)
        s = np.linspace(0.0, 1.0, max(int(1.9 * abs(goal - r[at - 1]) / FASTEST / rng.uniform(0.3, 1.0) / TICK), 2000))
        ramp = np.cumsum(np.clip(np.minimum(s, 1 - s) / 0.25, 0.0, 1.0))
        stroke = s**3 * (10 - 15 * s + 6 * s**2) if smooth else ramp / ramp[-1]
        stroke = np.append(r[at - 1] + (goal - r[at - 1]) * stroke, np.full(int(rng.uniform(0.5, 4.0) / TICK), goal))
        r[at : at + len(stroke)] = stroke[: count - at]
        at += len(stroke)
    if smooth:
        t = TICK * np.arange(count)
        f, phase = rng.uniform(0.01, 0.4, 3), rng.uniform(0.0, 6.28, 3)
        waves = np.sum(np.sin(2 * np.pi * np.outer(t, f) + phase) / f, axis=1)
        fade = np.clip(t / 4.0, 0.0, 1.0) ** 2
        r = 0.8 * r + fade * (waves - waves[0]) * 0.3 * FASTEST / np.abs(np.gradient(waves, TICK)).max()
    return r


def one(job: tuple[str, int]) -> tuple[bool, str]:
    """Make one drive, reconcile it, and say whether what was left out was named and nothing besides."""
    drag, seed = job
    rng, terms = np.random.default_rng(seed), [] if drag == "nothing" else drag.split()
    force = 50.0 * float(np.exp(rng.uniform(math.log(0.1), 0.0)))
    sizes = np.zeros(len(AT))
    for term in terms:
        sizes[AT[term]] = force * (rng.choice([-1.0, 1.0]) if term in ("constant_load", "asymmetric_friction") else 1.0)
    late = round(rng.uniform(0.3, 1.5) * STEPS) if "actuation_delay" in terms else 0
    r = setpoint(rng, int(rng.choice([25_000, 40_000])))
    nominal = load_models(MODEL).for_joint("EMPS")
    law = nominal.controller
    assert law is not None
    mass = nominal.plant.output_inertia * (1.2 if "output_inertia_change" in terms else rng.uniform(0.97, 1.03))
    out = np.zeros((len(r), 3))
    noise = rng.standard_normal(out.shape) * NOISE
    moved(r, mass, np.array([law.proportional, law.derivative]), sizes, late, noise, out)
    channels = {"setpoint": r, "position": out[:, 0], "joint_velocity": out[:, 1], "drive_torque": out[:, 2]}
    record = JointRecord("drive", "EMPS", 0, TICK * np.arange(len(r)), channels, axis="linear")
    start = time.process_time()
    answer = reconcile([record], nominal)
    took = time.process_time() - start
    named = [str(entry["term"]) for entry in answer.omitted_physics]
    right = sorted(n for n in named if n not in MASSES or n in terms) == sorted(terms)
    told = f"{drag} ({seed}, {force:.0f} N): {answer.verdict}, {', '.join(named) or 'nothing'}, {took:.0f} s"
    alike = "; ".join("/".join(group) for group in answer.indistinguishable)
    return right, f"{'' if right else 'NOT RIGHT '}{told}{alike and f', alike: {alike}'}"


def main() -> None:
    """Run every combination once."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--first", type=int, default=100, help="seed of the first drive")
    asked.add_argument("--jobs", type=int, default=2)
    call = asked.parse_args()
    jobs = [(drag, call.first + i) for i, drag in enumerate(DRAGS)]
    print(f"named rightly and alone: {tally(one, jobs, call.jobs)}")


if __name__ == "__main__":
    main()
