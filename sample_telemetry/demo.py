"""The main job on the sample telemetry: ingest, learn a baseline, judge a night; each command as one would type it."""

import shlex
import subprocess
import sys
import time
from pathlib import Path

HOME = Path(__file__).resolve().parent
ROOT = HOME.parent
OUT = ROOT / "demo"
COMMANDS = (
    "ingest sample_telemetry/healthy sample_telemetry/night --store demo/store",
    "baseline sample_telemetry/healthy --model configs/era_arm.toml --store demo/store",
    "analyze sample_telemetry/night --store demo/store --out demo/night",
    "reconcile sample_telemetry/night --joint WR2 --model configs/era_arm.toml --out demo/reconciled",
)


def main() -> None:
    """Run the commands one after another; stop at the first that fails."""
    print("The first run on a machine compiles the simulator and the filters, which takes a minute; later ones do not.")
    for command in COMMANDS:
        print(f"\n$ gsfdi {command}", flush=True)
        began = time.perf_counter()
        ended = subprocess.run([sys.executable, "-m", "gsfdi", *shlex.split(command)], cwd=ROOT, check=False)
        if ended.returncode:
            sys.exit(ended.returncode)
        print(f"({time.perf_counter() - began:.1f} s)", flush=True)
    print(f"\nThe verdicts:              {OUT / 'night' / 'report.html'}")
    print(f"What the model left out:   {OUT / 'reconciled' / 'report.html'}")


if __name__ == "__main__":
    main()
