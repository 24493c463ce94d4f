"""From fault-free records to a baseline, joint by joint."""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np

from gsfdi.baseline.gathering import Gathering, detectors
from gsfdi.baseline.kept import Baseline, JointBaseline
from gsfdi.errors import GsfdiError
from gsfdi.healthy import learn_nominal
from gsfdi.model import JointModel
from gsfdi.types import Array, JointRecord, Problem, sealed

PIECE = 5.0
"""A recording is cut into pieces of no less than this where there are few, to see how the joint varies [s]."""
FEWEST = 4
"""Pieces that a joint's baseline is cut into when it has fewer batches than this."""


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


def learn_joint(records: Sequence[JointRecord], model: JointModel | None = None) -> JointBaseline:
    """Learn one joint from its fault-free records."""
    pieces = _pieces(records)
    nominal = learn_nominal(pieces, model)
    gathered, span = [], 0.0
    for piece in pieces:
        seen = Gathering(nominal)
        seen.add(piece)
        if seen.seconds > 0:
            gathered.append(seen.numbers())
            span += seen.seconds
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
        record.robot, record.joint, record.t0_ns + round(start * 1e9), sealed(t - start),
        {name: values[low:high] for name, values in record.channels.items()}, record.axis,
        {name: mask[low:high] for name, mask in record.valid.items()}, record.source, record.sha256, record.quality,
    )  # fmt: skip


def _range(values: Sequence[Array]) -> tuple[float, float]:
    whole = np.concatenate(values)
    whole = whole[np.isfinite(whole)]
    return (float(whole.min()), float(whole.max())) if len(whole) else (0.0, 0.0)
