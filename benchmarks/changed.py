"""Reconcile the contract's joint with a model that holds its frictions as they were before they grew or fell.

``python benchmarks/changed.py [--first 1] [--seconds 120] [--jobs 2]`` prints a line a joint: by what share its dry and
its viscous friction changed, and what was said. Made by gsfdi's own simulator, as ``shelf.py`` is.
"""

import argparse
import itertools
import time
from dataclasses import replace
from pathlib import Path

from tally import tally

from gsfdi.model import TermUse
from gsfdi.modelfile import load_models
from gsfdi.reconcile import reconcile
from gsfdi.simulate import simulate_record

MODEL = Path(__file__).resolve().parents[1] / "configs" / "era_joint.toml"
DRY, WET = 3.0, 30.0
SHARES = (0.7, 0.9, 1.0, 1.1, 1.3)
NEAR = 0.25
"""Share of a change by which it may be told wrongly."""


def rubbing(dry: float, wet: float) -> tuple[TermUse, ...]:
    """Frictions of the motor [N m, N m s/rad]."""
    return (
        TermUse("coulomb_friction", {"torque_nm": dry}, "motor"),
        TermUse("viscous_friction", {"coefficient_nms_rad": wet}, "motor"),
    )


def one(job: tuple[tuple[float, float], int, float]) -> tuple[bool, str]:
    """Make one joint, reconcile it, and say whether both changes were told and nothing besides."""
    (dry, wet), seed, seconds = job
    arm = load_models(MODEL).for_joint("J1")
    record = simulate_record(replace(arm, physics=rubbing(dry * DRY, wet * WET)), seed=seed, duration=seconds)
    start = time.process_time()
    answer = reconcile([record], replace(arm, physics=rubbing(DRY, WET)))
    took = time.process_time() - start
    told = {str(e["term"]): float(next(iter(e["parameters"].values()))["value"]) for e in answer.omitted_physics}
    changed = {"coulomb_friction": (dry - 1) * DRY, "viscous_friction": (wet - 1) * WET}
    wanted = {term: size for term, size in changed.items() if size != 0.0}
    right = told.keys() == wanted.keys() and all(abs(told[t] / size - 1) < NEAR for t, size in wanted.items())
    line = ", ".join(f"{term} {size:+.3g}" for term, size in told.items()) or "nothing"
    said = f"dry {100 * (dry - 1):+.0f} %, viscous {100 * (wet - 1):+.0f} % ({seed}): {answer.verdict}, {line}"
    return right, f"{'' if right else 'NOT RIGHT '}{said}, {took:.0f} s"


def main() -> None:
    """Run every pair of changes once."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--first", type=int, default=1, help="seed of the first joint")
    asked.add_argument("--seconds", type=float, default=120.0)
    asked.add_argument("--jobs", type=int, default=2)
    call = asked.parse_args()
    pairs = [(pair, call.first + i, call.seconds) for i, pair in enumerate(itertools.product(SHARES, SHARES))]
    print(f"told rightly and alone: {tally(one, pairs, call.jobs)}")


if __name__ == "__main__":
    main()
