"""The store: telemetry, baselines and the ledger under one folder, each file whole or not there.

::

    telemetry/robot=R/date=YYYY-MM-DD/joint=J/<source>-<first stamp>-<last stamp>.parquet
    baselines/NAME/<version>.json
    ledger/R/J.jsonl

A file of telemetry is named by the bytes that it came from, so the same bytes twice are one batch, and a run that was
killed half way is finished by running it again. Every file is checked against its own checksum when it is read.
"""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from gsfdi.atomic import sync_folder, write_text
from gsfdi.canonical import write_parquet
from gsfdi.errors import BaselineError
from gsfdi.parts import CONTENT, Part, content_of, days, holds, meets, part_of, read_part, retire
from gsfdi.types import Batch, JointRecord

BASELINE_SCHEMA = "gsfdi/baseline-file/1"


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
            for day in days(record):
                path = self._place(day)
                if not holds(path, day):
                    write_parquet(path, [day], {CONTENT: content_of(day)}, hive=True)
                    written.append(path)
                retire(path)
        return written

    def parts(self, robot: str = "", joint: str = "") -> list[Part]:
        """List the files of telemetry, sorted by robot, joint and time.

        Parameters
        ----------
        robot, joint : str
            Narrow the list; all if empty.
        """
        chosen = f"robot={quote(robot, safe='') or '*'}/date=*/joint={quote(joint, safe='') or '*'}/*.parquet"
        found = [part_of(path) for path in (self.root / "telemetry").glob(chosen)]
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
            if (not joints or part.joint in joints) and meets(part, start_ns, end_ns):
                yield from read_part(part, start_ns, end_ns, None)

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
            if meets(part, start_ns, end_ns):
                yield from read_part(part, start_ns, end_ns, seconds)

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


_LEARN = "learn one with gsfdi baseline"


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
