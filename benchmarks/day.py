"""A day of seven joints at 100 Hz through ``gsfdi analyze``, beside pyarrow reading the same columns, in one run.

python benchmarks/day.py [--days N] [--rounds N] [--folder DIR]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from gsfdi.canonical import write_parquet
from gsfdi.modelfile import load_models
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord

ROOT = Path(__file__).parents[1]
MODEL = ROOT / "configs" / "era_arm.toml"
HEALTHY = ROOT / "sample_telemetry" / "healthy"
RESULTS = Path(__file__).parent / "results" / "day.json"
SEEDS = (301, 302, 303, 304)
"""Hours that are simulated; a day takes them by turns."""
PAUSE_S = 60
"""What each hour is short of a whole one, so that no seam jumps."""
T0_NS = 1_788_220_800_000_000_000
"""Midnight of a day in 2026 [ns]."""
HOUR_NS = 3_600_000_000_000
BARE = """
import sys
import pyarrow.parquet as pq
how, *paths = sys.argv[1:]
for path in paths:
    file = pq.ParquetFile(path)
    if how == "groups":
        for group in range(file.num_row_groups):
            file.read_row_group(group, use_threads=False)
    else:
        for batch in file.iter_batches():
            pass
"""
"""Reads every column, all of which gsfdi reads too."""
ONE_THREAD = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def hours() -> Iterator[list[JointRecord]]:
    """Different hours of each joint of the arm, fault-free."""
    for number, model in enumerate(load_models(MODEL)):
        yield [simulate_record(model, seed=seed + 1000 * number, duration=3600.0 - PAUSE_S) for seed in SEEDS]


def write_days(folder: Path, days: int) -> None:
    """Write days of telemetry, a folder each with a file per joint; the first one's first hour has a folder too."""
    for some in hours():
        name = f"{some[0].joint}.parquet"
        records = [replace(some[hour % len(some)], t0_ns=T0_NS + hour * HOUR_NS) for hour in range(24)]
        write_parquet(folder / "day-1" / name, records)
        write_parquet(folder / "hour" / name, records[:1])
        for day in range(1, days):
            shift(folder / "day-1" / name, folder / f"day-{day + 1}" / name, 24 * day * HOUR_NS)


def shift(source: Path, target: Path, later_ns: int) -> None:
    """Write a day again for another date, as any program would: without a seal, and packed for speed."""
    target.parent.mkdir(parents=True, exist_ok=True)
    file = pq.ParquetFile(source)
    schema = file.schema_arrow.remove_metadata()
    with pq.ParquetWriter(target, schema, compression="lz4", use_dictionary=["joint"]) as writer:
        for group in range(file.num_row_groups):
            table = file.read_row_group(group, use_threads=False)
            stamps = pc.add(table["timestamp"].cast(pa.int64()), later_ns).cast(schema.field("timestamp").type)
            writer.write_table(table.set_column(0, schema.field("timestamp"), stamps))


def run(command: Sequence[str]) -> dict[str, float]:
    """Processor time of a command [s], and its peak memory [MB]."""
    done = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=ONE_THREAD)
    _, status, used = os.wait4(done.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(command)} ended with {status}")
    return {"cpu_s": used.ru_utime + used.ru_stime, "peak_mb": used.ru_maxrss / 1024}


def gsfdi(*words: str | Path) -> list[str]:
    return [sys.executable, "-m", "gsfdi", *map(str, words)]


def measured(folder: Path, days: int, rounds: int) -> dict[str, object]:
    """Analyse an hour and a day (and more) by turns, each beside pyarrow reading it: every round, and their medians."""
    store = folder / "store"
    run(gsfdi("baseline", HEALTHY, "--model", MODEL, "--store", store))
    spans = {"hour": [folder / "hour"], "day": [folder / "day-1"]}
    if days > 1:
        spans[f"{days} days"] = [folder / f"day-{day + 1}" for day in range(days)]
    kept: dict[str, list[dict[str, float]]] = {name: [] for name in spans}
    for _ in range(rounds):
        for name, folders in spans.items():
            kept[name].append(side_by_side(folders, store, folder / "out"))
            print(name, json.dumps(kept[name][-1]), flush=True)
    medians = {name: {key: median(one[key] for one in some) for key in some[0]} for name, some in kept.items()}
    start = medians["hour"]["gsfdi analyze [s]"]
    times = [(one["gsfdi analyze [s]"] - start) / one["pyarrow, row groups [s]"] for one in kept["day"]]
    return {"median": medians, "a day beyond an hour, times row groups": times, "rounds": kept}


def side_by_side(folders: Sequence[Path], store: Path, out: Path) -> dict[str, float]:
    """Processor time and peak memory of one analysis, and processor time of pyarrow reading the same files."""
    files = [str(path) for one in folders for path in sorted(one.glob("*.parquet"))]
    groups, batches = (run([sys.executable, "-c", BARE, how, *files])["cpu_s"] for how in ("groups", "batches"))
    import_only = run([sys.executable, "-c", BARE, "groups"])["cpu_s"]
    ours = run(gsfdi("analyze", *folders, "--store", store, "--out", out, "--jobs", 1))
    verdicts = [one["verdict"] for one in json.loads((out / "verdicts.json").read_text())["joints"]]
    return {
        "gsfdi analyze [s]": ours["cpu_s"],
        "peak of gsfdi [MB]": ours["peak_mb"],
        "pyarrow, row groups [s]": groups - import_only,
        "pyarrow, iter_batches [s]": batches - import_only,
        "joints": len(verdicts),
        "not normal": sum(one != "normal" for one in verdicts),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--days", type=int, default=1, help="days written; beyond one they are analysed together too")
    parser.add_argument("--rounds", type=int, default=1, help="times that everything is measured, by turns")
    parser.add_argument("--folder", type=Path, help="where telemetry is kept and taken from again; none by default")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = given.folder or Path(name)
        if not (folder / f"day-{given.days}").exists():
            write_days(folder, given.days)
        RESULTS.write_text(json.dumps(measured(folder, given.days, given.rounds), indent=1) + "\n")


if __name__ == "__main__":
    main()
