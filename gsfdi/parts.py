"""The files of telemetry in a store: one for each source, robot, joint and day, or for a piece of one."""

import hashlib
import itertools
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from gsfdi.canonical import axis_of, filled, open_verified
from gsfdi.channels import CHANNEL_OF_COLUMN
from gsfdi.errors import UnusableInputError
from gsfdi.quality import judge
from gsfdi.seal import digests
from gsfdi.types import Array, JointRecord

DAY_NS = 86_400_000_000_000
CONTENT = "gsfdi.content"


class Part(NamedTuple):
    """One file of telemetry and the stretch that it holds."""

    robot: str
    joint: str
    path: Path
    start_ns: int
    end_ns: int


def days(record: JointRecord) -> Iterator[JointRecord]:
    """The record cut at midnights UTC."""
    if not len(record.t):
        return
    stamps = record.t0_ns + np.round(record.t * 1e9).astype(np.int64)
    day = stamps // DAY_NS
    edges = [0, *(np.flatnonzero(np.diff(day)) + 1).tolist(), len(day)]
    for a, b in itertools.pairwise(edges):
        yield cut(record, a, b) if (a, b) != (0, len(day)) else record


def cut(record: JointRecord, first: int, last: int) -> JointRecord:
    """Samples `first` up to before `last` of a record, with their masks.

    Parameters
    ----------
    record : JointRecord
    first, last : int
    """
    t = record.t[first:last]
    start = round(float(t[0]) * 1e9)
    return replace(
        record,
        t0_ns=record.t0_ns + start,
        t=(np.round(t * 1e9) - start) * 1e-9,
        channels={name: values[first:last] for name, values in record.channels.items()},
        valid={name: mask[first:last] for name, mask in record.valid.items()},
    )


def content_of(record: JointRecord) -> str:
    """Digest of a record's numbers, so that another mapping of the same bytes is seen to differ."""
    hasher = hashlib.sha256(f"{record.axis} {record.t0_ns}".encode())
    hasher.update(record.t.tobytes())
    for name in sorted(record.channels):
        hasher.update(name.encode() + record.channels[name].tobytes())
    return hasher.hexdigest()


def holds(path: Path, record: JointRecord) -> bool:
    """Whether a file is there, whole, and holds the record."""
    if not path.exists():
        return False
    try:
        file = open_verified(path, digests(path).whole)
    except UnusableInputError:
        return False
    with file:
        kept: bytes = (file.metadata.metadata or {}).get(CONTENT.encode(), b"")
        return kept.decode() == content_of(record)


def retire(path: Path) -> None:
    """Remove what an earlier reading of the same bytes left that overlaps the file just kept."""
    kept = part_of(path)
    source = path.name.split("-", 1)[0]
    for other in path.parent.glob(f"{source}-*.parquet"):
        part = part_of(other)
        if other != path and part.start_ns <= kept.end_ns and kept.start_ns <= part.end_ns:
            other.unlink()


def part_of(path: Path) -> Part:
    """What a file's place and name say of it."""
    robot, joint = (unquote(folder.name.split("=", 1)[1]) for folder in (path.parents[2], path.parent))
    _, start, end = path.stem.rsplit("-", 2)
    return Part(robot, joint, path, int(start), int(end))


def meets(part: Part, start_ns: int | None, end_ns: int | None) -> bool:
    """Whether a file can hold samples from `start_ns` up to before `end_ns`."""
    return (end_ns is None or part.start_ns < end_ns) and (start_ns is None or start_ns <= part.end_ns)


def read_part(part: Part, start_ns: int | None, end_ns: int | None, seconds: float | None) -> Iterator[JointRecord]:
    """Records of one file, whole or in pieces of so many seconds."""
    file = open_verified(part.path, digests(part.path).whole)
    with file:
        notes = file.metadata.metadata or {}
        [[source, sha256]] = json.loads(notes[b"gsfdi.source"])
        lost = json.loads(notes[b"gsfdi.quality"]).get(part.joint, {}).get("time", {})
        names = filled(file)
        axis = axis_of(names)
        for batch in _blocks(file, part, ["timestamp", *names], seconds):
            stamps = np.asarray(batch.column("timestamp").cast(pa.int64()))
            a = 0 if start_ns is None else int(np.searchsorted(stamps, start_ns))
            b = len(stamps) if end_ns is None else int(np.searchsorted(stamps, end_ns))
            if a >= b:
                continue
            t = (stamps[a:b] - stamps[a]) * 1e-9
            channels = {CHANNEL_OF_COLUMN[name][0]: _numbers(batch.column(name))[a:b] for name in names}
            valid, quality = judge(t, channels, axis)
            quality["time"] = {**lost, **quality["time"]}
            yield JointRecord(part.robot, part.joint, int(stamps[a]), t, channels, axis, valid, source, sha256, quality)
            lost = {}


def _blocks(
    file: pq.ParquetFile, part: Part, columns: list[str], seconds: float | None
) -> Iterator[pa.RecordBatch | pa.Table]:
    """The rows of a file, all at once or no more than so many seconds of them."""
    if seconds is None:
        yield file.read(columns=columns, use_threads=False).combine_chunks()
        return
    span = max((part.end_ns - part.start_ns) * 1e-9, 1e-9)
    rows = max(int(seconds * file.metadata.num_rows / span), 1)
    for group in range(file.num_row_groups):  # a walk over all of them would keep their bytes to its end
        yield from file.iter_batches(batch_size=rows, row_groups=[group], columns=columns, use_threads=False)


def _numbers(column: pa.Array) -> Array:
    return np.asarray(pc.fill_null(column, np.nan), dtype=np.float64)
