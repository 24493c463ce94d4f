"""Two thousand faults of time and value, each read and judged: never `normal` for what could not be assessed.

A recording without any checksum is spoilt besides, one bit at a time, and each copy is carried through to its verdict.

python benchmarks/faults.py [--cases N] [--flips N] [--seed N]
"""

import argparse
import json
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import recordings

from gsfdi import baseline, diagnosis, ingest, simulate
from gsfdi.channels import CHANNELS
from gsfdi.modelfile import load_models
from gsfdi.types import Array, JointRecord

RESULTS = Path(__file__).parent / "results" / "faults.json"
MODEL = Path(__file__).parents[1] / "configs" / "era_joint.toml"
NEEDED = ("position", "motor_velocity", "motor_current")
SERIOUS = ("distress", "critical")
MOST = 0.7
"""A batch that has lost this share of its samples, or of one needed channel, cannot be assessed."""


@dataclass
class Case:
    """A batch being spoilt: stamps [ns] and channels, and how much of it is left to judge by."""

    rng: np.random.Generator
    stamps: np.ndarray
    channels: dict[str, Array]
    hopeless: bool = False
    single: bool = False
    told: list[str] = field(default_factory=list)

    def some(self) -> tuple[np.ndarray, float]:
        """A random share of the rows."""
        share = float(self.rng.choice([0.002, 0.05, 0.3, 0.8, 1.0]))
        return self.rng.random(len(self.stamps)) < share, share

    def channel(self) -> str:
        """One of the channels that a verdict needs."""
        return str(self.rng.choice(NEEDED))


def value(bad: float) -> Callable[[Case], None]:
    def spoil(case: Case) -> None:
        rows, share = case.some()
        case.channels[case.channel()][rows] = bad
        case.hopeless |= share > MOST

    return spoil


def dead(case: Case) -> None:
    name = case.channel()
    case.channels[name][:] = case.rng.choice([0.0, float(case.channels[name][0])])
    case.hopeless = True


def frozen(case: Case) -> None:
    name, start = case.channel(), int(case.rng.integers(0, len(case.stamps)))
    case.channels[name][start:] = case.channels[name][start]
    case.hopeless |= start < (1 - MOST) * len(case.stamps)


def absent(case: Case) -> None:
    del case.channels[case.channel()]
    case.hopeless = True


def flipped(case: Case) -> None:
    name, row, bit = case.channel(), int(case.rng.integers(0, len(case.stamps))), int(case.rng.integers(0, 64))
    case.channels[name].view(np.uint64)[row] ^= np.uint64(1) << np.uint64(bit)
    case.single = True


def spike(case: Case) -> None:
    name, row = case.channel(), int(case.rng.integers(0, len(case.stamps)))
    case.channels[name][row] += case.rng.normal() * 10.0 ** case.rng.uniform(-3, 3)
    case.single = True


def again(case: Case) -> None:
    rows, share = case.some()
    rows[0] = False
    last = np.maximum.accumulate(np.where(rows, 0, np.arange(len(rows))))  # the newest row that kept its own
    case.stamps = case.stamps[last]
    case.hopeless |= share > MOST


def shuffled(case: Case) -> None:
    rows, share = case.some()
    case.stamps[rows] = case.rng.permutation(case.stamps[rows])
    case.hopeless |= share > MOST


def jump(case: Case) -> None:
    at, seconds = int(case.rng.integers(1, len(case.stamps))), 10.0 ** case.rng.uniform(-2, 8)
    case.stamps[at:] += int(case.rng.choice([-1, 1]) * seconds * 1e9)


def no_stamp(case: Case) -> None:
    rows, share = case.some()
    case.stamps[rows] = case.rng.choice([0, 1, -(10**18), 2**62])
    case.hopeless |= share > MOST


def one_stamp(case: Case) -> None:
    case.stamps[:] = case.stamps[0]
    case.hopeless = True


def backwards(case: Case) -> None:
    case.stamps = case.stamps[::-1].copy()
    case.hopeless = True


def short(case: Case) -> None:
    n = int(case.rng.integers(0, len(case.stamps)))
    case.stamps = case.stamps[:n]
    case.channels = {name: values[:n] for name, values in case.channels.items()}
    case.hopeless |= n < 250


def gap(case: Case) -> None:
    a, b = np.sort(case.rng.integers(0, len(case.stamps), 2))
    keep = np.r_[0:a, b : len(case.stamps)]
    case.stamps = case.stamps[keep]
    case.channels = {name: values[keep] for name, values in case.channels.items()}
    case.hopeless |= len(keep) < 250


def noise(case: Case) -> None:
    name = case.channel()
    known = case.channels[name][np.abs(case.channels[name]) < 1e100]  # another fault may have been here before
    low, high = (known.min(), known.max()) if len(known) else (0.0, 1.0)
    case.channels[name][:] = case.rng.uniform(low, high, len(case.stamps))
    case.hopeless = True  # plausible numbers without any meaning: whatever is said of them, not `normal`


SPOILERS: dict[str, Callable[[Case], None]] = {
    "missing values": value(np.nan),
    "infinite values": value(np.inf),
    "absurd values": value(1e165),
    "dead channel": dead,
    "frozen channel": frozen,
    "absent channel": absent,
    "flipped bit": flipped,
    "spike": spike,
    "repeated stamps": again,
    "shuffled stamps": shuffled,
    "clock jump": jump,
    "impossible stamps": no_stamp,
    "one stamp for all": one_stamp,
    "time backwards": backwards,
    "cut short": short,
    "gap": gap,
    "meaningless numbers": noise,
}


def spoilt(record: JointRecord, number: int) -> tuple[str, Case]:
    """A copy of a fault-free batch with one fault, or two."""
    rng = np.random.default_rng(number)
    stamps = record.t0_ns + np.round(record.t * 1e9).astype(np.int64)
    case = Case(rng, stamps, {name: values.copy() for name, values in record.channels.items()})
    names = [str(name) for name in rng.choice(list(SPOILERS), 1 + (number % 5 == 0), replace=False)]
    for name in sorted(names, key=lambda each: SPOILERS[each] not in (short, gap)):  # rows go first, then are spoilt
        if len(case.stamps) > 2 and set(NEEDED) <= set(case.channels):
            SPOILERS[name](case)
    case.single &= len(names) == 1
    return names[0] if len(names) == 1 else "two at once", case


def write(path: Path, case: Case) -> None:
    columns: dict[str, object] = {
        "timestamp": pa.array(case.stamps).cast(pa.timestamp("ns", tz="UTC")),
        "joint": ["J1"] * len(case.stamps),
    }
    columns |= {CHANNELS[name].rotary: values for name, values in case.channels.items()}
    pq.write_table(pa.table(columns), path)


def judge_spoilt(cases: int, seed: int, folder: Path) -> dict[str, object]:
    """Judge generated batches, each spoilt in its own way."""
    model = load_models(MODEL).for_joint("J1")
    healthy = [simulate.simulate_record(model, seed=seed + i, duration=60.0) for i in range(8)]
    learnt = baseline.learn_joint(healthy[:5], model)
    score: Counter[str] = Counter()
    verdicts: dict[str, Counter[str]] = defaultdict(Counter)
    examples: list[dict[str, object]] = []
    path = folder / "batch.parquet"
    for number in range(seed, seed + cases):
        kind, case = spoilt(healthy[5 + number % 3], number)
        write(path, case)
        verdict = verdict_of(path, learnt)
        verdicts[kind][verdict] += 1
        score["cases"] += 1
        score["could not be assessed"] += case.hopeless
        score["of these called normal"] += case.hopeless and verdict == "normal"
        score["one sample spoilt"] += case.single
        score["of these called distress or critical"] += case.single and verdict in SERIOUS
        score["tracebacks"] += verdict.startswith("traceback")
        if (case.hopeless and verdict == "normal") or (case.single and verdict in SERIOUS) or "trace" in verdict:
            examples.append({"case": number, "kind": kind, "verdict": verdict})
    return {
        "score": dict(score),
        "verdicts": {kind: dict(counts) for kind, counts in sorted(verdicts.items())},
        "to look into": examples[:20],
    }


def verdict_of(path: Path, learnt: baseline.JointBaseline) -> str:
    """Read a file and judge its joint."""
    try:
        records = [one for one in ingest.read([path]).records if one.joint == learnt.joint]
        return diagnosis.assess(records[0], learnt).verdict if records else "not_assessed"
    except Exception as error:
        return f"traceback {type(error).__name__}: {error}"[:120]


def bare(path: Path, record: JointRecord) -> Path:
    """A joint as JointState messages without compression and without any checksum."""
    plant = load_models(MODEL).for_joint("J1").plant
    speed = record.channels["motor_velocity"] / plant.gear_ratio
    torque = record.channels["motor_current"] * plant.gear_ratio * plant.torque_constant
    stamps = (record.t0_ns + np.round(record.t * 1e9).astype(np.int64)).tolist()
    rows = zip(stamps, record.channels["position"].tolist(), speed.tolist(), torque.tolist(), strict=True)
    states = [(stamp, recordings.joint_state(stamp, ["J1"], [q], [v], [e])) for stamp, q, v, e in rows]
    schema = recordings.JOINT_STATE.encode()
    entry = ("/joint_states", "cdr", "sensor_msgs/msg/JointState", "ros2msg", schema, states)
    return recordings.write_mcap(path, [entry], "none", enable_crcs=False)


def judge_flips(count: int, seed: int, folder: Path) -> dict[str, object]:
    """Flip one bit of a file without checksums, and see what verdict its joint is given."""
    model = load_models(MODEL).for_joint("J1")
    healthy = [simulate.simulate_record(model, seed=seed + i, duration=60.0) for i in range(6)]
    records = [ingest.read([bare(folder / "bare.mcap", one)]).records[0] for one in healthy]
    learnt = baseline.learn_joint(records[:5])
    whole, damaged = (folder / "bare.mcap").read_bytes(), folder / "flipped.mcap"
    rng = np.random.default_rng(seed)
    verdicts = Counter({"none flipped: " + verdict_of(folder / "bare.mcap", learnt): 1})
    serious = []
    for at, bit in zip(rng.integers(8, len(whole), count).tolist(), rng.integers(0, 8, count).tolist(), strict=True):
        spoilt_bytes = bytearray(whole)
        spoilt_bytes[at] ^= 1 << bit
        damaged.write_bytes(spoilt_bytes)
        verdict = verdict_of(damaged, learnt)
        verdicts[verdict] += 1
        if verdict in SERIOUS or verdict.startswith("traceback"):
            serious.append([at, bit, verdict])
    return {"flips": count, "verdicts": dict(verdicts), "distress, critical or traceback": serious}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=2000, help="batches spoilt")
    parser.add_argument("--flips", type=int, default=1000, help="bits flipped in a file without checksums")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        result = {
            "seed": given.seed,
            **judge_spoilt(given.cases, given.seed, Path(name)),
            "no checksum": judge_flips(given.flips, given.seed, Path(name)),
            "seconds": round(time.perf_counter() - started),
        }
    if given.cases >= 2000:
        RESULTS.write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
