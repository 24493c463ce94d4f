"""Gives each case to the tool in a process of its own kind: a folder that holds recordings and nominal model alone."""

import json
import os
import select
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from gsfdi.atomic import write_text
from gsfdi.proof.seal import spelled

TOOL = ("gsfdi", "reconcile", "--model", "nominal.toml", "--out", "answer", "--jobs", "1", "--quiet")
"""Module and arguments; the recordings follow, and ``--without TERM`` where a case withholds one."""

HERE = Path(__file__).parent


@dataclass(slots=True)
class Desk:
    """A worker at which one case after another is put before the tool.

    Parameters
    ----------
    tool : sequence of str
        Module (or script) and arguments.
    patience : float
        A case that takes longer is stopped, and counts as unanswered [s].
    """

    tool: Sequence[str] = TOOL
    patience: float = 180.0
    _process: subprocess.Popen[str] | None = field(default=None, init=False)

    def answer(self, folder: Path, extra: Sequence[str]) -> dict[str, Any]:
        """Let the tool answer the case in `folder`; `extra` arguments follow the tool's own."""
        process = self._ready()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            print(json.dumps({"folder": str(folder), "arguments": list(extra)}), file=process.stdin, flush=True)
            waited, _, _ = select.select([process.stdout], [], [], self.patience)
            line = process.stdout.readline() if waited else ""
        except BrokenPipeError:
            line = ""
        if not line:
            self.close()
            return {"status": -1, "seconds": self.patience, "trespasses": [], "said": "no answer: it stopped or hung"}
        reply: dict[str, Any] = json.loads(line)
        return reply

    def _ready(self) -> subprocess.Popen[str]:
        if self._process is None:
            inherited = (
                "PATH",
                "HOME",
                "LANG",
                "NUMBA_CACHE_DIR",
                "PYTHONPATH",
                "SYSTEMROOT",
                "COVERAGE_PROCESS_START",
            )
            environment = {name: os.environ[name] for name in inherited if name in os.environ}
            environment["PYTHONPATH"] = os.pathsep.join(
                filter(None, [str(HERE.parents[1]), os.environ.get("PYTHONPATH")])
            )
            environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
            self._process = subprocess.Popen(
                [sys.executable, "-P", str(HERE / "watched.py"), *self.tool],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment,
                text=True,
            )
        return self._process

    def close(self) -> None:
        """Send the worker home."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    pipe.close()
            self._process = None


def examine(
    desk: Desk,
    name: str,
    files: Mapping[str, bytes],
    withheld: Sequence[str],
    answers: Path,
    compare: Callable[[Path], object] = lambda folder: {},
) -> None:
    """Put one case before the tool and store its answer, unless it is stored already.

    Parameters
    ----------
    desk : Desk
        Where the tool sits.
    name : str
        Neutral name of the case.
    files : mapping of str to bytes
        What it is given.
    withheld : sequence of str
        Terms that it is told to leave out of its library.
    answers : Path
        Folder for the answers.
    compare : callable
        Gives what rivals say of the same folder, stored beside the answer.
    """
    stored = answers / f"{name}.json"
    if stored.exists():
        return
    with TemporaryDirectory(prefix="case-", ignore_cleanup_errors=True) as place:
        for file, content in files.items():
            (Path(place) / file).write_bytes(content)
        recordings = [file for file in files if file.endswith(".parquet")]
        extra = [option for term in withheld for option in ("--without", term)]
        reply = desk.answer(Path(place), [*extra, *recordings])
        try:
            said = json.loads((Path(place) / "answer" / "reconcile.json").read_text())
        except (OSError, ValueError):
            said = None
        rivals = compare(Path(place))
    write_text(stored, spelled({"case": name, "answer": said, "rivals": rivals, **reply}) + "\n")
