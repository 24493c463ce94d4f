"""Reconcile the seven joints of ``configs/era_arm.toml``, each of which lacks one effect: what is named, and how soon.

``python benchmarks/seven.py [--seconds 180] [--seed 0]`` prints a line a joint, with the processor time of the whole
command on one core, and then the time on the clock that one command takes for all seven with two processes.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ARM = Path(__file__).resolve().parents[1] / "configs" / "era_arm.toml"
LEFT_OUT = {
    "SH1": "coulomb_friction=20",
    "SH2": "stribeck_friction=30",
    "EL": "backlash=5e-4",
    "WR1": "cogging=0.01",
    "WR2": "gearbox_hysteresis=10",
    "WR3": "actuation_delay=0.005",
    "EE": "viscous_friction=40",
}


def gsfdi(*arguments: object) -> tuple[float, float]:
    """Run a command; its time on the clock and its processor time [s]."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, "-m", "gsfdi", *map(str, arguments), "--quiet"], check=True)
    took, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return took, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=180.0)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for seed, (joint, fault) in enumerate(LEFT_OUT.items(), start=given.seed):
            files.append(Path(folder) / f"{joint}.parquet")
            gsfdi("simulate", "--model", ARM, "--joint", joint, "--fault", fault, "--duration", given.seconds,
                  "--seed", seed, "--out", files[-1])  # fmt: skip
        for file in files:
            out = Path(folder) / "alone"
            busy = gsfdi("reconcile", file, "--model", ARM, "--jobs", 1, "--out", out)[1]
            (answer,) = json.loads((out / "reconcile.json").read_text())["joints"]
            named = ", ".join(entry["term"] for entry in answer["omitted_physics"])
            print(f"{file.stem}: {LEFT_OUT[file.stem]}, {answer['verdict']} by {named}, {busy:.1f} s", flush=True)
        clock = gsfdi("reconcile", *files, "--model", ARM, "--jobs", 2, "--out", Path(folder) / "all")[0]
        print(f"all seven, two processes: {clock:.1f} s")


if __name__ == "__main__":
    main()
