"""The store: telemetry, baselines and the ledger under one folder, each file whole or not there.

::

    telemetry/robot=R/date=YYYY-MM-DD/joint=J/<source>-<first stamp>-<last stamp>.parquet
    baselines/NAME/<version>.json
    ledger/R/J.jsonl

A file of telemetry is named by the bytes that it came from, so the same bytes twice are one batch, and a run that was
killed half way is finished by running it again. Every file is checked against its own checksum when it is read.
"""

import hashlib
import itertools
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from gsfdi.atomic import sync_folder, write_text
from gsfdi.canonical import axis_of, filled, open_verified, write_parquet
from gsfdi.channels import CHANNEL_OF_COLUMN
from gsfdi.errors import BaselineError, UnusableInputError
from gsfdi.quality import judge
from gsfdi.types import Array, Batch, JointRecord

BASELINE_SCHEMA = "gsfdi/baseline-file/1"
DAY_NS = 86_400_000_000_000


class Part(NamedTuple):
    """One file of telemetry and the stretch that it holds."""

    robot: str
    joint: str
    path: Path
    start_ns: int
    end_ns: int


class Store:
    """What gsfdi keeps between runs.

    Parameters
    ----------
    root : Path or str
        Folder; made when first written to.
    """

    def __init__(self, root: Path | str) -> None:
        self.root = Path(root)

    def add(self, batch: Batch) -> list[Path]:
        """Keep the records of a batch.

        Parameters
        ----------
        batch : Batch

        Returns
        -------
        list of Path
            Files that are new; none when the same bytes were there already.
        """
        written = []
        for record in batch.records:
            for day in _days(record):
                path = self._place(day)
                if not _holds(path, day):
                    write_parquet(path, [day], {_CONTENT: _content(day)}, hive=True)
                    written.append(path)
                _retire(path)
        return written

    def parts(self, robot: str = "", joint: str = "") -> list[Part]:
        """List the files of telemetry, sorted by robot, joint and time.

        Parameters
        ----------
        robot, joint : str
            Narrow the list; all if empty.
        """
        chosen = f"robot={quote(robot, safe='') or '*'}/date=*/joint={quote(joint, safe='') or '*'}/*.parquet"
        found = [_part(path) for path in (self.root / "telemetry").glob(chosen)]
        return sorted(found, key=lambda part: (part.robot, part.joint, part.start_ns, part.path.name))

    def records(
        self, robot: str = "", joints: Sequence[str] = (), start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[JointRecord]:
        """Hand out what is kept, a file at a time.

        Parameters
        ----------
        robot : str
            All if empty.
        joints : sequence of str
            All if empty.
        start_ns, end_ns : int, optional
            Only samples from `start_ns` up to before `end_ns` [ns since 1970].
        """
        for part in self.parts(robot):
            if (not joints or part.joint in joints) and _meets(part, start_ns, end_ns):
                yield from _read(part, start_ns, end_ns, None)

    def pieces(
        self,
        joint: str,
        start_ns: int | None = None,
        end_ns: int | None = None,
        seconds: float = 600.0,
        robot: str = "",
    ) -> Iterator[JointRecord]:
        """Hand out one joint's telemetry in pieces of bounded length, in order of time.

        Parameters
        ----------
        joint : str
        start_ns, end_ns : int, optional
            Bounds [ns since 1970].
        seconds : float
            Longest piece wanted [s]; memory follows it, not the length of what is kept.
        robot : str
            All if empty.
        """
        for part in self.parts(robot, joint):
            if _meets(part, start_ns, end_ns):
                yield from _read(part, start_ns, end_ns, seconds)

    def save_baseline(self, name: str, content: Mapping[str, Any]) -> str:
        """Keep a baseline under the next version of its name.

        Parameters
        ----------
        name : str
        content : mapping
            Anything JSON can hold.

        Returns
        -------
        str
            SHA-256 of the content.
        """
        folder = self.root / "baselines" / quote(name, safe="")
        version = max((int(path.stem) for path in folder.glob("*.json")), default=0) + 1
        text = json.dumps(content, sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()
        whole = {"schema": BASELINE_SCHEMA, "name": name, "version": version, "sha256": digest, "content": content}
        write_text(folder / f"{version:06d}.json", json.dumps(whole, sort_keys=True))
        return digest

    def load_baseline(self, name: str, version: int | None = None) -> tuple[dict[str, Any], str]:
        """Fetch a baseline, the newest unless a version is given, and its SHA-256.

        Parameters
        ----------
        name : str
        version : int, optional

        Raises
        ------
        BaselineError
            There is none, or its checksum fails.
        """
        folder = self.root / "baselines" / quote(name, safe="")
        paths = sorted(folder.glob("*.json"))
        if version is not None:
            paths = [path for path in paths if int(path.stem) == version]
        if not paths:
            known = sorted(unquote(path.name) for path in (self.root / "baselines").glob("*"))
            raise BaselineError(name, f"no such baseline in {self.root}; known: {', '.join(known) or 'none'}", _LEARN)
        try:
            whole = json.loads(paths[-1].read_text(encoding="utf-8"))
            content, digest = whole["content"], whole["sha256"]
            text = json.dumps(content, sort_keys=True)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise BaselineError(paths[-1], f"is damaged: {error}", _LEARN) from error
        if hashlib.sha256(text.encode()).hexdigest() != digest:
            raise BaselineError(paths[-1], "is damaged: its checksum fails", _LEARN)
        return dict(content), str(digest)

    def append_ledger(self, robot: str, joint: str, key: str, row: Mapping[str, Any]) -> bool:
        """Add a row to a joint's history; a key that is there already is left as it is.

        Parameters
        ----------
        robot, joint : str
        key : str
            What the row is about, for example the batch's SHA-256.
        row : mapping
            Anything JSON can hold.

        Returns
        -------
        bool
            Whether the row is new.
        """
        path = self._ledger(robot, joint)
        if any(known == key for known, _ in _ledger_rows(path)):
            return False
        line = json.dumps({"key": key, "row": row}, sort_keys=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            size = os.fstat(handle).st_size
            torn = size > 0 and os.pread(handle, 1, size - 1) != b"\n"  # a run was killed while it wrote
            os.write(handle, (("\n" if torn else "") + f"{_check(line)} {line}\n").encode())
            os.fsync(handle)
        finally:
            os.close(handle)
        sync_folder(path.parent)
        return True

    def ledger(self, robot: str, joint: str) -> list[dict[str, Any]]:
        """Rows of a joint's history, in the order they were added; a row whose checksum fails is passed over.

        Parameters
        ----------
        robot, joint : str
        """
        return [row for _, row in _ledger_rows(self._ledger(robot, joint))]

    def _ledger(self, robot: str, joint: str) -> Path:
        return self.root / "ledger" / quote(robot, safe="") / f"{quote(joint, safe='')}.jsonl"

    def _place(self, record: JointRecord) -> Path:
        date = str(np.datetime64(record.t0_ns, "ns").astype("datetime64[D]"))
        folder = f"robot={quote(record.robot, safe='')}/date={date}/joint={quote(record.joint, safe='')}"
        name = (
            f"{record.sha256[:16] or 'made'}-{record.t0_ns}-{record.t0_ns + round(float(record.t[-1]) * 1e9)}.parquet"
        )
        return self.root / "telemetry" / folder / name


_CONTENT = "gsfdi.content"
_LEARN = "learn one with gsfdi baseline"


def _days(record: JointRecord) -> Iterator[JointRecord]:
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


def _content(record: JointRecord) -> str:
    """Digest of a record's numbers, so that another mapping of the same bytes is seen to differ."""
    hasher = hashlib.sha256(f"{record.axis} {record.t0_ns}".encode())
    hasher.update(record.t.tobytes())
    for name in sorted(record.channels):
        hasher.update(name.encode() + record.channels[name].tobytes())
    return hasher.hexdigest()


def _holds(path: Path, record: JointRecord) -> bool:
    """Whether a file is there, whole, and holds the record."""
    if not path.exists():
        return False
    try:
        file, _ = open_verified(path)
    except UnusableInputError:
        return False
    with file:
        kept: bytes = (file.metadata.metadata or {}).get(_CONTENT.encode(), b"")
        return kept.decode() == _content(record)


def _retire(path: Path) -> None:
    """Remove what an earlier reading of the same bytes left that overlaps the file just kept."""
    kept = _part(path)
    source = path.name.split("-", 1)[0]
    for other in path.parent.glob(f"{source}-*.parquet"):
        part = _part(other)
        if other != path and part.start_ns <= kept.end_ns and kept.start_ns <= part.end_ns:
            other.unlink()


def _part(path: Path) -> Part:
    robot, joint = (unquote(folder.name.split("=", 1)[1]) for folder in (path.parents[2], path.parent))
    _, start, end = path.stem.rsplit("-", 2)
    return Part(robot, joint, path, int(start), int(end))


def _meets(part: Part, start_ns: int | None, end_ns: int | None) -> bool:
    return (end_ns is None or part.start_ns < end_ns) and (start_ns is None or start_ns <= part.end_ns)


def _read(part: Part, start_ns: int | None, end_ns: int | None, seconds: float | None) -> Iterator[JointRecord]:
    """Records of one file, whole or in pieces of so many seconds."""
    file, _ = open_verified(part.path)
    with file:
        notes = file.metadata.metadata or {}
        [[source, sha256]] = json.loads(notes[b"gsfdi.source"])
        lost = json.loads(notes[b"gsfdi.quality"]).get(part.joint, {}).get("time", {})
        names = filled(file)
        axis = axis_of(names)
        rows = max(file.metadata.num_rows, 1)
        if seconds is not None:
            span = max((part.end_ns - part.start_ns) * 1e-9, 1e-9)
            rows = max(min(rows, int(seconds * rows / span)), 1)
        for batch in file.iter_batches(batch_size=rows, columns=["timestamp", *names]):
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


def _numbers(column: pa.Array) -> Array:
    return np.asarray(pc.fill_null(column, np.nan), dtype=np.float64)


def _check(line: str) -> str:
    return hashlib.sha256(line.encode()).hexdigest()[:16]


def _ledger_rows(path: Path) -> list[tuple[str, dict[str, Any]]]:
    if not path.exists():
        return []
    rows = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        check, _, text = line.partition(" ")
        if check == _check(text):
            entry = json.loads(text)
            rows.append((str(entry["key"]), dict(entry["row"])))
    return rows
