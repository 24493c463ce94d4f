"""Runs a tool case by case in this process, and writes down every file it opens that is none of its business.

Started as ``python -P watched.py MODULE ARG...``, by its path so that nothing of the proof is loaded. It reads one
request per line from standard input (a folder and further arguments, in JSON), changes into the folder, runs MODULE as
``__main__``, and answers with one JSON line: exit status, seconds, and trespasses. An audit hook cannot be removed, so
nothing that Python opens escapes it.

The tool may open its own code, the libraries, the system's shared files and what lies in the case's folder. Anything
else is a trespass: the seal, another case, the parent's memory or command line, a network, a process of its own, and
the very code of the proof, with which it could draw the cases again.
"""

import contextlib
import io
import json
import os
import runpy
import site
import sys
import sysconfig
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

_trespasses: list[str] = []
_case: list[str] = [""]
PROOF = os.path.realpath(Path(__file__).parent)
HOME = os.path.realpath(Path(__file__).parents[2])
SEARCHED = frozenset(os.path.realpath(folder) for folder in sys.path if folder)
"""Folders that Python itself lists to find modules in."""
NETWORK = ("socket.connect", "socket.sendto", "urllib.Request")
PROCESS = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn")


def allowed(module: str) -> tuple[str, ...]:
    """Folders (and the script, if the tool is one) that a tool may read: code, libraries, the system's own."""
    homes = [sys.prefix, sys.base_prefix, *site.getsitepackages(), sysconfig.get_path("stdlib")]
    homes += [str(Path(__file__).parents[1]), "/usr", "/etc", "/lib", "/dev", "/sys", "/proc/self", "/proc/cpuinfo"]
    homes += ["/proc/meminfo", "/proc/stat", os.environ.get("NUMBA_CACHE_DIR", sys.prefix), module]
    return tuple(os.path.realpath(home) for home in homes)


def watch(homes: tuple[str, ...]) -> None:
    """Install the hook."""

    def hook(event: str, args: tuple[Any, ...]) -> None:
        if event == "open" or event in ("os.listdir", "os.scandir", "glob.glob"):
            path = args[0] if args else None
            if event == "os.listdir" and isinstance(path, str) and os.path.realpath(path) in SEARCHED:
                return
            if isinstance(path, (str, bytes, os.PathLike)) and not _may(os.fsdecode(path), homes):
                _trespasses.append(f"{event} {os.fsdecode(path)}")
        elif event in NETWORK or event in PROCESS:
            _trespasses.append(f"{event} {args[:1]!r}")

    sys.addaudithook(hook)


def _may(path: str, homes: tuple[str, ...]) -> bool:
    real = os.path.realpath(path)
    if _below(real, PROOF):
        return False
    if real == HOME or (real.startswith(HOME) and ".egg-info" in real):  # where Python looks for installed packages
        return True
    return any(_below(real, home) for home in (*homes, _case[0], f"/proc/{os.getpid()}"))


def _below(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder + os.sep)


def serve(module: str, arguments: Sequence[str]) -> None:
    """Answer requests until standard input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what the tool's own children print must not look like an answer
    watch(allowed(module))
    for line in sys.stdin:
        request = json.loads(line)
        folder = request["folder"]
        _case[0] = os.path.realpath(folder)
        tempfile.tempdir = _case[0]
        _trespasses.clear()
        os.chdir(folder)
        started, said = time.perf_counter(), io.StringIO()
        status = run(module, [*arguments, *request["arguments"]], said)
        answer = {"status": status, "seconds": time.perf_counter() - started, "trespasses": sorted(set(_trespasses))}
        print(json.dumps(answer | {"said": said.getvalue()[-2000:]}), file=answers, flush=True)


def run(module: str, arguments: Sequence[str], said: io.StringIO) -> int:
    """Run the module once; what it prints goes to `said`."""
    sys.argv = [module, *arguments]
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            if module.endswith(".py"):
                runpy.run_path(module, run_name="__main__")
            else:
                runpy.run_module(module, run_name="__main__", alter_sys=False)
    except SystemExit as end:
        return int(end.code or 0) if not isinstance(end.code, str) else 1
    except Exception as error:  # whatever a tool does, the proof goes on and counts it
        said.write(f"{type(error).__name__}: {error}")
        return 70
    return 0


if __name__ == "__main__":
    serve(sys.argv[1], sys.argv[2:])
