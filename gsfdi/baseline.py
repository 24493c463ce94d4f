"""Learn what the fault-free joints of a robot do, and give it as plain numbers that a store can keep.

``learn(records, models)`` takes the records of several fault-free batches, sorts them by joint and learns each joint's
nominal model (`gsfdi.healthy`) and what every detector of the shelf makes of it. ``Baseline.to_dict`` gives nested
dictionaries of str, float, int, lists and float64 arrays; ``Baseline.from_dict`` takes them back.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from gsfdi.detectors import Detector, Tally
from gsfdi.errors import BaselineError, GsfdiError
from gsfdi.healthy import BY_KEY, EXTRA, cut, learn_nominal
from gsfdi.model import JointModel, Plant
from gsfdi.nominal import Nominal, filtered, observer, watch
from gsfdi.observer import Filter
from gsfdi.registry import shelf
from gsfdi.stretches import Stretch
from gsfdi.types import Array, JointRecord, Problem

PIECE = 5.0
"""A recording is cut into pieces of no less than this where there are few, to see how the joint varies [s]."""
SLAB = 60.0
"""Long stretches are taken in slabs of this length [s]."""
WHOLE = 900.0
"""Seconds of a batch that are always scored in full."""
UNUSUAL = 1.5
"""Times the usual power of the innovations at which a slab is scored whatever the length of the batch."""
FEWEST = 4
"""Pieces that a joint's baseline is cut into when it has fewer batches than this."""


@dataclass(frozen=True, slots=True)
class JointBaseline:
    """What the fault-free joint does.

    Parameters
    ----------
    joint, robot : str
    nominal : Nominal
        Its model, terms and noise.
    learnt : mapping of str to mapping of str to array
        By detector, what it learnt.
    batches : int
        Fault-free pieces it was learnt from.
    span : float
        Their total length [s].
    sources : tuple of str
        SHA-256 of the files.
    ranges : mapping of str to (float, float)
        Least and greatest value of each channel.
    """

    joint: str
    robot: str
    nominal: Nominal
    learnt: Mapping[str, Mapping[str, Array]]
    batches: int
    span: float
    sources: tuple[str, ...] = ()
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Baseline:
    """Baselines of a robot's joints by name, and what could not be learnt and why."""

    joints: Mapping[str, JointBaseline]
    problems: tuple[Problem, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Plain numbers for a store."""
        return {
            "schema": "gsfdi/baseline/1",
            "joints": {name: _joint_to_dict(one) for name, one in self.joints.items()},
        }

    @classmethod
    def from_dict(cls, kept: Mapping[str, Any]) -> "Baseline":
        """Take back what :meth:`to_dict` gave."""
        if kept.get("schema") != "gsfdi/baseline/1":
            raise BaselineError("baseline", f"schema {kept.get('schema')!r} is not 'gsfdi/baseline/1'", "learn it anew")
        return cls({name: _joint_from_dict(name, one) for name, one in kept["joints"].items()})


def detectors() -> dict[str, Detector]:
    """Every detector of the shelf, by name."""
    return shelf("gsfdi.detectors", Detector)


def gather(
    pieces: Iterable[JointRecord],
    nominal: Nominal,
    settings: Mapping[str, Mapping[str, float]] | None = None,
    usual: float | None = None,
) -> tuple[dict[str, dict[str, Array]], float]:
    """One pass over a batch, in pieces: every detector's numbers, and the seconds they saw.

    Parameters
    ----------
    pieces : iterable of JointRecord
        Successive pieces of one batch of one joint; ``t0_ns`` of each places it in time.
    nominal : Nominal
        The joint's nominal model.
    settings : mapping of str to mapping of str to float, optional
        Changed knobs by detector.
    usual : float, optional
        Mean weighted square of the fault-free innovations. With it, what lies beyond the first `WHOLE` seconds is
        scored in part only: every twentieth slab, and each whose innovations are not as usual.
    """
    run = observer(nominal)
    tallies: dict[str, Tally] = {
        name: one.tally(nominal, {**one.settings, **((settings or {}).get(name) or {})})
        for name, one in detectors().items()
    }
    seconds, scored, first = 0.0, 0.0, None
    for piece in pieces:
        first = piece.t0_ns if first is None else first
        late = (piece.t0_ns - first) * 1e-9
        extra = tuple(name for name in EXTRA if name in piece and np.isfinite(piece[name]).any())
        for part in cut(piece, nominal, extra):
            for slab in slabs(part._replace(start=part.start + late)):
                length = slab.step * len(slab.trusted)
                seconds += length
                if usual is not None and scored > WHOLE + 0.05 * seconds and _as_usual(nominal, run, slab, usual):
                    continue
                scored += length
                seen = watch(nominal, run, slab, BY_KEY)
                for tally in tallies.values():
                    tally.add(seen)
    return {name: tally.numbers() for name, tally in tallies.items()}, seconds


def slabs(part: Stretch) -> Iterator[Stretch]:
    """Cut a long stretch into slabs of `SLAB` seconds, the last one longer."""
    size, n = max(round(SLAB / part.step), 400), len(part.trusted)
    edges = [*range(0, max(n - size, 1), size), n]
    for low, high in pairwise(edges):
        values = {name: some[low:high] for name, some in part.values.items()}
        yield Stretch(part.start + low * part.step, part.step, values, part.trusted[low:high])


def _as_usual(nominal: Nominal, run: Filter, slab: Stretch, usual: float) -> bool:
    """Whether a slab's innovations are no larger than those of a fault-free joint."""
    seen = filtered(nominal, run, slab, BY_KEY)
    e = seen.e[seen.live * seen.used > 0]
    return len(e) > 0 and float(np.einsum("ki,ij,kj->", e, run.weight, e)) < UNUSUAL * usual * len(e)


def learn_joint(records: Sequence[JointRecord], model: JointModel | None = None) -> JointBaseline:
    """Learn one joint from its fault-free records."""
    pieces = _pieces(records)
    nominal = learn_nominal(pieces, model)
    gathered, span = [], 0.0
    for piece in pieces:
        numbers, seconds = gather([piece], nominal)
        if seconds > 0:
            gathered.append(numbers)
            span += seconds
    learnt = {
        name: one.learn([numbers[name] for numbers in gathered if numbers[name]], one.settings)
        for name, one in detectors().items()
        if any(numbers[name] for numbers in gathered)
    }
    ranges = {name: _range([record[name] for record in records if name in record]) for name in records[0].channels}
    return JointBaseline(
        records[0].joint, records[0].robot, nominal, learnt, len(gathered), span,
        tuple(dict.fromkeys(record.sha256 for record in records if record.sha256)), ranges,
    )  # fmt: skip


def learn(
    records: Iterable[JointRecord],
    models: Callable[[str], JointModel | None] | None = None,
    each: Callable[[str], None] | None = None,
) -> Baseline:
    """Learn a baseline for every joint among the records.

    Parameters
    ----------
    records : iterable of JointRecord
        Fault-free telemetry, several batches of each joint.
    models : callable, optional
        From a joint's name to its model, or None where no model file speaks of it.
    each : callable, optional
        Told the name of each joint as it is done.
    """
    by_joint: dict[str, list[JointRecord]] = {}
    for record in records:
        by_joint.setdefault(record.joint, []).append(record)
    joints, problems = {}, []
    for joint, some in by_joint.items():
        try:
            joints[joint] = learn_joint(some, models(joint) if models is not None else None)
        except GsfdiError as error:
            problems.append(Problem(joint, str(error), kind="left_out"))
        if each is not None:
            each(joint)
    return Baseline(joints, tuple(problems))


def _pieces(records: Sequence[JointRecord]) -> list[JointRecord]:
    """The records themselves, or pieces of them where there are too few to see how the joint varies."""
    if len(records) >= FEWEST:
        return list(records)
    pieces = []
    for record in records:
        length = float(record.t[-1] - record.t[0]) if len(record.t) else 0.0
        count = int(np.clip(length // PIECE, 1, -(-FEWEST // len(records)))) if length >= 2 * PIECE else 1
        edges = np.linspace(0, len(record.t), count + 1).astype(int)
        pieces += [part_of(record, low, high) for low, high in pairwise(edges)]
    return pieces


def part_of(record: JointRecord, low: int, high: int) -> JointRecord:
    """Samples ``low`` to ``high`` of a record, with the time in it counted anew."""
    t = record.t[low:high]
    start = float(t[0]) if len(t) else 0.0
    return JointRecord(
        record.robot, record.joint, record.t0_ns + round(start * 1e9), t - start,
        {name: values[low:high] for name, values in record.channels.items()}, record.axis,
        {name: mask[low:high] for name, mask in record.valid.items()}, record.source, record.sha256, record.quality,
    )  # fmt: skip


def _range(values: Sequence[Array]) -> tuple[float, float]:
    whole = np.concatenate(values)
    whole = whole[np.isfinite(whole)]
    return (float(whole.min()), float(whole.max())) if len(whole) else (0.0, 0.0)


_PLANT = ("output_inertia", "motor_inertia", "gear_ratio", "stiffness", "damping", "torque_constant")


def _joint_to_dict(one: JointBaseline) -> dict[str, object]:
    nominal = one.nominal
    plant = {name: getattr(nominal.plant, name) for name in _PLANT}
    if not nominal.flexible:
        plant.pop("stiffness")
    return {
        "robot": one.robot, "batches": one.batches, "span": one.span, "sources": list(one.sources),
        "ranges": {name: list(pair) for name, pair in one.ranges.items()},
        "learnt": {name: dict(numbers) for name, numbers in one.learnt.items()},
        "nominal": {
            "plant": plant, "effort": nominal.effort, "velocity": nominal.velocity, "step": nominal.step,
            "terms": dict(nominal.terms), "noise": list(nominal.noise), "unrest": nominal.unrest, "held": nominal.held,
            "slow": nominal.slow, "weight": [list(row) for row in nominal.weight],
        },
    }  # fmt: skip


def _joint_from_dict(name: str, kept: Mapping[str, Any]) -> JointBaseline:
    held = kept["nominal"]
    nominal = Nominal(
        Plant(**held["plant"]), held["effort"], held["velocity"], float(held["step"]), dict(held["terms"]),
        tuple(held["noise"]), float(held["unrest"]), float(held["held"]), float(held["slow"]),
        tuple(tuple(row) for row in held["weight"]),
    )  # fmt: skip
    learnt = {
        detector: {key: np.asarray(values, dtype=np.float64) for key, values in numbers.items()}
        for detector, numbers in kept["learnt"].items()
    }
    ranges = {channel: (float(low), float(high)) for channel, (low, high) in kept["ranges"].items()}
    return JointBaseline(
        name, kept["robot"], nominal, learnt, int(kept["batches"]), float(kept["span"]), tuple(kept["sources"]), ranges
    )
