"""The full proof on concealed data: every kind of effect, nulls, several at once, strangers, MuJoCo; all sealed.

    python benchmarks/proof.py [--seed N] [--each 8] [--nulls 100] [--jobs 2] [--out benchmarks/proof]

Stopped and started again with the same arguments it goes on where it stopped. The folder keeps the seal, every answer,
the opened truth and the figures, so that ``gsfdi prove --check benchmarks/proof`` scores it again.
"""

import argparse
import time
from pathlib import Path

from gsfdi.proof import prove
from gsfdi.proof.plan import full

HERE = Path(__file__).parent


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--seed", type=int, default=1)
    ask.add_argument("--each", type=int, default=8, help="cases per kind, over four sizes")
    ask.add_argument("--nulls", type=int, default=100)
    ask.add_argument("--doubles", type=int, default=40)
    ask.add_argument("--unknown", type=int, default=4, help="cases per invention")
    ask.add_argument("--minutes", type=float, default=float("inf"), help="begin no case later than this")
    ask.add_argument("--jobs", type=int, default=2)
    ask.add_argument("--out", type=Path, default=HERE / "proof")
    given = ask.parse_args()
    designs = full(given.seed, each=given.each, nulls=given.nulls, doubles=given.doubles, unknown=given.unknown)
    started = time.time()

    def progress(done: int, total: int, what: str) -> None:
        if done % 10 == 0:
            print(f"{time.time() - started:6.0f} s  {what}: {done} of {total}", flush=True)

    result = prove(
        designs,
        seed=given.seed,
        out=given.out,
        jobs=given.jobs,
        progress=progress,
        say=print,
        seconds=60 * given.minutes,
    )
    for name, figure in result["figures"].items():
        if isinstance(figure, dict) and "rate" in figure:
            low, high = figure["ci95"]
            share = "-" if figure["rate"] is None else f"{100 * figure['rate']:5.1f} %"
            print(f"{name:45s} {figure['hits']:4d} of {figure['of']:4d}  {share}  [{100 * low:.1f}, {100 * high:.1f}]")
        elif not isinstance(figure, dict):
            print(f"{name:45s} {figure}")
    for name, figures in result["rivals"].items():
        print(f"{name:20s} first name right {figures['first_name_right']['rate']}")


if __name__ == "__main__":
    main()
