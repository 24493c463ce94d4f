"""Paths in, `Batch` out: which files, which reader, and what of their content may be believed."""

import glob
import hashlib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Mapping as Map
from pathlib import Path
from typing import Any, Literal

from gsfdi.assemble import Blocks, assemble
from gsfdi.errors import GsfdiError, UnusableInputError
from gsfdi.mapping import Mapping, load_mapping
from gsfdi.readers import Reader
from gsfdi.registry import shelf
from gsfdi.types import Array, Batch, JointRecord, Problem
from gsfdi.wire import Columns, Key

__all__ = ["describe", "gather", "load_mapping", "read", "stream", "summary"]

PIECE = 4_000_000
"""Values held before `stream` hands a piece on."""
MOST_HELD = 200_000_000
"""Values of one file that `read` holds at most: four days of one joint's five channels at 100 Hz."""
HEAD = 1 << 16
STRAY = 3
"""A joint with no more samples than this, where others have a hundred times as many, is a damaged name."""


def gather(sources: Sequence[str]) -> list[Path]:
    """Name the files that files, folders and globs stand for.

    Parameters
    ----------
    sources : sequence of str

    Returns
    -------
    list of Path
        Each once, sorted within a source. Of a folder only what a reader knows.

    Raises
    ------
    UnusableInputError
        A source stands for nothing.
    """
    found: dict[Path, None] = {}
    for source in sources:
        path = Path(source)
        if path.is_dir():
            files = sorted(p for p in path.rglob("*") if p.is_file() and not _hidden(p, path) and _reader(p))
        elif path.exists():
            files = [path]
        else:
            files = sorted(Path(name) for name in glob.glob(source, recursive=True) if Path(name).is_file())
        if not files:
            what = "holds no MCAP, Parquet or CSV" if path.is_dir() else "does not exist"
            raise UnusableInputError(source, what, "name a recording, a folder of them or a glob")
        found |= dict.fromkeys(files)
    return list(found)


def read(paths: Iterable[Path | str], mappings: Sequence[Mapping] = (), joints: Sequence[str] = ()) -> Batch:
    """Read recordings whole.

    Parameters
    ----------
    paths : iterable of Path
    mappings : sequence of Mapping
    joints : sequence of str
        Joints wanted; all if empty.

    Returns
    -------
    Batch
        A record per file, robot and joint, and everything left out and why. A file that cannot be used is a problem
        of the batch; the others are read all the same.
    """
    records: list[JointRecord] = []
    problems: list[Problem] = []
    for path in paths:
        whole = Batch(())
        for piece in _file(Path(path), mappings, joints, piece=None):
            whole = piece
        records += whole.records
        problems += whole.problems
    return Batch(tuple(records), tuple(problems))


def stream(
    paths: Iterable[Path | str], mappings: Sequence[Mapping] = (), joints: Sequence[str] = (), piece: int = PIECE
) -> Iterator[Batch]:
    """Read recordings of any length piece by piece.

    Parameters
    ----------
    paths : iterable of Path
    mappings : sequence of Mapping
    joints : sequence of str
        Joints wanted; all if empty.
    piece : int
        Values held at most before a piece is handed on.

    Yields
    ------
    Batch
        Consecutive stretches; the last of a file carries its problems.
    """
    for path in paths:
        yield from _file(Path(path), mappings, joints, piece)


def describe(path: Path | str, mappings: Sequence[Mapping] = ()) -> dict[str, object]:
    """Say what a file holds and how it would be read.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    """
    path = Path(path)
    reader = _reader(path)
    if reader is None:
        raise UnusableInputError(path, _unknown(path), "give MCAP, Parquet or CSV")
    return {"path": str(path), "bytes": path.stat().st_size, **reader.describe(path, mappings)}


def summary(records: Iterable[JointRecord]) -> list[dict[str, object]]:
    """One row per robot and joint: records, rate, span, gaps, and what was masked.

    Parameters
    ----------
    records : iterable of JointRecord
        Gone through once and not kept, so it may be as long as it likes.
    """
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for record in records:
        clock = record.quality.get("time", {})
        row = rows.setdefault(
            (record.robot, record.joint),
            {
                "robot": record.robot,
                "joint": record.joint,
                "records": 0,
                "samples": 0,
                "span_s": 0.0,
                "rate_hz": 0.0,
                "gaps": 0,
                "longest_gap_s": 0.0,
                "channels": [],
                "left_out": {},
                "masked": {},
            },
        )
        row["records"] += 1
        row["samples"] += len(record.t)
        row["span_s"] += clock.get("span_s", 0.0)
        row["rate_hz"] = max(row["rate_hz"], clock.get("rate_hz", 0.0))
        row["gaps"] += int(clock.get("gaps", 0.0))
        row["longest_gap_s"] = max(row["longest_gap_s"], clock.get("longest_gap_s", 0.0))
        row["channels"] = sorted({*row["channels"], *record.channels})
        _add_counts(row["left_out"], {kind: count for kind, count in clock.items() if kind not in _CLOCK})
        for channel in record.channels:
            _add_counts(row["masked"].setdefault(channel, {}), record.quality.get(channel, {}))
    return [rows[key] for key in sorted(rows)]


def _add_counts(total: dict[str, float], counts: Map[str, float] | Map[str, int]) -> None:
    for kind, count in counts.items():
        if count:
            total[kind] = total.get(kind, 0.0) + count


_CLOCK = ("samples", "span_s", "rate_hz", "gaps", "longest_gap_s")


def _file(path: Path, mappings: Sequence[Mapping], joints: Sequence[str], piece: int | None) -> Iterator[Batch]:
    """Pieces of one file; a file that cannot be used is a batch of one problem."""
    problems: list[Problem] = []
    try:
        reader = _reader(path)
        if reader is None:
            raise UnusableInputError(path, _unknown(path), "give MCAP, Parquet or CSV")
        held = _Held(path, _sha256(path), joints)
        for item in reader.read(path, mappings):
            if isinstance(item, Problem):
                problems.append(item)
                continue
            held.add(item)
            if held.size >= (piece or MOST_HELD):
                if piece is None:
                    what = f"is too long to be held at once: more than {MOST_HELD:,} values"
                    raise UnusableInputError(path, what, "cut it, or ingest and analyze it, which go piece by piece")
                yield Batch(held.records())
        last = held.records()
        yield Batch(last, (*problems, *held.problems()))
    except GsfdiError as error:
        yield Batch((), (*problems, Problem(str(path), error.what, error.mend, "unusable")))
    except OSError as error:
        yield Batch((), (*problems, Problem(str(path), f"cannot be read: {error.strerror or error}", "", "unusable")))


class _Held:
    """What was read of a file and not yet handed on, and what is to be told of it at its end."""

    def __init__(self, path: Path, sha256: str, joints: Sequence[str]) -> None:
        self.path, self.sha256, self.joints = path, sha256, joints
        self.blocks: dict[tuple[str, str], Blocks] = defaultdict(list)
        self.faults: dict[str, float] = {}
        self.size = 0
        self.ends: dict[tuple[str, str], int] = {}
        self.strays: dict[str, None] = {}
        self.lost: dict[str, float] = {}

    def add(self, item: Columns) -> None:
        """Take a block in."""
        by_joint: dict[tuple[str, str], dict[Key, Array]] = defaultdict(dict)
        for key, values in item.values.items():
            if not self.joints or key.joint in self.joints:
                by_joint[key.robot, key.joint][key] = values
                self.size += len(values)
        for joint, columns in by_joint.items():
            self.blocks[joint].append((item.origin, item.time_ns, columns))
        _add_counts(self.faults, item.faults)

    def records(self) -> tuple[JointRecord, ...]:
        """Hand on what is held as records.

        A joint that turns up a few times where others do hundreds of times is one flipped bit in a name: left out.
        """
        source = (str(self.path), self.sha256)
        made = [
            record
            for (robot, joint), blocks in self.blocks.items()
            if (record := assemble(robot, joint, blocks, self.ends.get((robot, joint)), self.faults, *source))
        ]
        longest = max((len(record.t) for record in made), default=0)
        kept = []
        for record in made:
            name = (record.robot, record.joint)
            if name not in self.ends and len(record.t) <= min(STRAY, 0.01 * longest):
                self.strays[record.joint] = None
                continue
            self.ends[name] = record.t0_ns + round(float(record.t[-1]) * 1e9)
            kept.append(record)
        self._note(kept)
        self.blocks.clear()
        self.faults.clear()
        self.size = 0
        return tuple(kept)

    def _note(self, records: Sequence[JointRecord]) -> None:
        """Count what was left out of these records for its time or form, as the joint that lost most has it."""
        worst: dict[str, float] = {}
        for record in records:
            for kind, count in record.quality["time"].items():
                if kind not in (*_CLOCK, "corrupt_row") and not kind.startswith("stale"):
                    worst[kind] = max(worst.get(kind, 0.0), count)
        _add_counts(self.lost, worst)

    def problems(self) -> Iterator[Problem]:
        """What is to be told of the whole file."""
        source = str(self.path)
        if not self.ends:
            wanted = f" of {', '.join(self.joints)}" if self.joints else ""
            kind: Literal["note", "left_out"] = "note" if self.joints else "left_out"  # other files may hold them
            yield Problem(source, f"holds no joint telemetry{wanted}", "see what it holds with --dry-run", kind)
        for joint in self.strays:
            what = f"is damaged: it names a joint {joint!r} in {STRAY} messages at most; they were left out"
            yield Problem(source, what, "fetch the file again")
        if self.lost:
            told = ", ".join(f"{int(count)} {kind}" for kind, count in sorted(self.lost.items()))
            yield Problem(source, f"rows whose time or form cannot be believed were left out: {told}")


def _reader(path: Path) -> Reader | None:
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise UnusableInputError(path, f"cannot be read: {error.strerror}", "check its permissions") from error
    return next((reader for reader in shelf("gsfdi.readers", Reader).values() if reader.sniff(head)), None)


def _unknown(path: Path) -> str:
    size = path.stat().st_size
    return f"is none of MCAP, Parquet, CSV ({size} bytes)" if size else "is empty"


def _hidden(path: Path, root: Path) -> bool:
    return any(part.startswith((".", "_")) for part in path.relative_to(root).parts)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
