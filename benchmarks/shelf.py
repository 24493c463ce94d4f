"""Every term of the shelf on the contract's joint, made by gsfdi's own simulator and reconciled with what lacks it.

``python benchmarks/shelf.py [--onset 40] [--without law] [--without speed] [--drive 1.0]`` prints one line a term: what
was put in, what was named, and how long that took. With `--drive` the terms that are sized in newton metres, per speed
or per angle, act with so many times the drive's own torque instead of the size in their file. No proof, for simulator
and reconcile share their laws: whatever is wrong here is wrong everywhere.
"""

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

from gsfdi.model import Side, TermUse
from gsfdi.modelfile import load_models
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.contract import without_speed
from gsfdi.reconcile.scales import scales_of
from gsfdi.registry import shelf
from gsfdi.simulate import simulate_record

HOME = Path(__file__).resolve().parent.parent
Job = tuple[str, float | None, tuple[str, ...], int, float, float]
SIZED = ("N m", "N m s/rad", "N m s²/rad²", "N m/rad")
"""Units of what sizes a torque."""


def one(job: Job) -> tuple[bool, str]:
    """Simulate one term at the sizes of its file, and reconcile; whether it was named alone, and a line on it."""
    name, onset, without, seed, seconds, share = job
    joint = load_models(HOME / "configs" / "era_joint.toml").for_joint("era-joint")
    term = shelf("gsfdi.terms", PhysicsTerm)[name]
    side: Side | None = term.sides[0] if term.sides else None
    values = {param.name: param.start for param in term.params}
    if share > 0:
        scales = scales_of([simulate_record(joint, seed=seed, duration=seconds)], joint, 0.01)
        values[term.params[0].name] = share * scales.of(term.params[0].unit)
    use = TermUse(name, values, side, onset)
    record = simulate_record(replace(joint, physics=(use,)), seed=seed, duration=seconds)
    if "speed" in without:
        record = without_speed(record)
    start = time.process_time()
    answer = reconcile([record], replace(joint, controller=None) if "law" in without else joint)
    took = time.process_time() - start
    found = [
        (entry["term"], *(f"{key} {number['value']:.4g}" for key, number in entry["parameters"].items()))
        for entry in answer.omitted_physics
    ]
    alike = [group for group in answer.indistinguishable if name in group]
    return [entry[0] for entry in found] == [name], f"{name}: {answer.verdict}, {found} {alike or ''} {took:.1f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--onset", type=float)
    parser.add_argument("--without", action="append", default=[], choices=("law", "speed"))
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--drive", type=float, default=0.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("terms", nargs="*")
    given = parser.parse_args()
    known = shelf("gsfdi.terms", PhysicsTerm)
    able = [name for name in sorted(known) if given.drive == 0 or known[name].params[0].unit in SIZED]
    jobs = [
        (name, given.onset, tuple(given.without), given.seed, given.seconds, given.drive)
        for name in given.terms or able
    ]
    with ProcessPoolExecutor(given.jobs) as pool:
        lines = []
        for alone, line in pool.map(one, jobs):
            lines.append(alone)
            print("  " if alone else "! ", line, flush=True)
    print(f"{sum(lines)} of {len(lines)} named, and nothing besides")


if __name__ == "__main__":
    main()
