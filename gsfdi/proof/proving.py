"""The whole proof in one call: draw, seal, let the tool answer, open, score.

A proof that was cut short goes on where it stopped, when it is asked again for the same cases into the same folder.
"""

import hashlib
import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from gsfdi.atomic import write_text
from gsfdi.proof.cases import Case, Design, draw, truth_of, write_files
from gsfdi.proof.checking import scored
from gsfdi.proof.concealment import concealment
from gsfdi.proof.plan import plan
from gsfdi.proof.real import COVERS, home, trials
from gsfdi.proof.rivals import rivals
from gsfdi.proof.running import TOOL, Desk, examine
from gsfdi.proof.scoring import named_in
from gsfdi.proof.seal import Sealed, digest, promised_inputs, put, sealed_otherwise, spelled
from gsfdi.proof.showcase import showcase

FRESH = 100_000  # seeds of cases begin here; those below served to build the tool


def prove(
    cases: int | Sequence[Design] = 20,
    *,
    seed: int = 0,
    out: Path,
    jobs: int = 1,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
    say: Callable[[str], None] = lambda line: None,
    tool: Sequence[str] = TOOL,
    seconds: float = math.inf,
) -> dict[str, Any]:
    """Prove reconcile on concealed cases, or go on with a proof that was cut short.

    Parameters
    ----------
    cases : int or sequence of Design
        How many, in the shares of `plan.SHARES`; or which.
    seed : int
        Seed of every draw. The tool is never told.
    out : Path
        Folder for seal, answers, truth and scores.
    jobs : int
        Cases that are worked on at a time.
    progress : callable
        Told how many are done, of how many, and what is going on.
    say : callable
        Told the hash of the seal before the first case is analysed.
    tool : sequence of str
        Module and arguments of the tool on trial.
    seconds : float
        No case is begun later than this after the seal; the order of the cases is random, so that those reached are a
        fair sample of all.

    Returns
    -------
    dict
        What ``proof.json`` holds.
    """
    named = neutral(plan(cases, seed) if isinstance(cases, int) else cases, seed)
    truths, inputs, held = {}, {}, promised_inputs(out)
    with ThreadPoolExecutor(jobs) as pool:
        for done, (name, (truth, hashes)) in enumerate(zip(named, pool.map(drawn, named.values()), strict=True)):
            progress(done, len(named), "drawing cases")
            if held is not None and held.get(name) != hashes:
                raise sealed_otherwise(out)
            truths[name], inputs[name] = truth, hashes
    sealed = Sealed(truths, salt=hashlib.sha256(f"salt {seed}".encode()).hexdigest())
    say(f"{len(named)} cases sealed: SHA-256 {put(out, sealed, inputs)}")
    answer_all(named, inputs, out / "answers", jobs, progress, tool, time.monotonic() + seconds)
    write_text(out / "truth.json", sealed.text)
    result = scored(out)
    write_text(out / "proof.json", spelled(result) + "\n")  # kept, whatever comes of what follows
    if tuple(tool) == TOOL:
        result["showcase"] = showcase(result["scores"], truths, lambda name: files_of(draw(*named[name])))
        if (recordings := home()) is not None:
            result["real"] = semi_blind(recordings, out / "real", tool)
    write_text(out / "proof.json", spelled(result) + "\n")
    return result


def drawn(designed: tuple[Design, int]) -> tuple[dict[str, Any], dict[str, str]]:
    """Draw a case: what goes into the seal, and the hashes of the files that the tool will be given."""
    case = draw(*designed)
    hidden, oracle = concealment(case)
    truth = {**truth_of(case), "concealment": asdict(hidden), "oracle": oracle}
    return truth, {file: digest(content) for file, content in files_of(case).items()}


def semi_blind(recordings: Path, answers: Path, tool: Sequence[str]) -> list[dict[str, Any]]:
    """Let the tool find what is withheld from the model of a real recording."""
    answers.mkdir(parents=True, exist_ok=True)
    desk, rows = Desk(tool), []
    try:
        for withheld, files in trials(recordings):
            examine(desk, withheld, files, (), answers)
            named = named_in(json.loads((answers / f"{withheld}.json").read_text()))
            right = bool(named) and named[0] in COVERS[withheld]
            rows.append({"recording": "EMPS", "withheld": withheld, "named": named, "right": right})
    finally:
        desk.close()
    return rows


def neutral(designs: Sequence[Design], seed: int) -> dict[str, tuple[Design, int]]:
    """Give each design a seed of its own and a name that says nothing, in random order."""
    rng = np.random.default_rng((seed, 79))
    order = rng.permutation(len(designs))
    seeds = FRESH + seed * 10_000 + np.arange(len(designs))
    return {f"case-{place:03d}": (designs[k], int(seeds[k])) for place, k in enumerate(order)}


def files_of(case: Case) -> dict[str, bytes]:
    """Everything that the tool is given of a case."""
    with TemporaryDirectory(prefix="draw-") as folder:
        write_files(case, Path(folder))
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


def answer_all(
    named: Mapping[str, tuple[Design, int]],
    inputs: Mapping[str, Mapping[str, str]],
    answers: Path,
    jobs: int,
    progress: Callable[[int, int, str], None],
    tool: Sequence[str],
    latest: float,
) -> None:
    """Put every case before the tool, `jobs` at a time, in the order of their names, until the clock is at `latest`."""
    answers.mkdir(parents=True, exist_ok=True)
    desks: SimpleQueue[Desk] = SimpleQueue()
    all_desks = [Desk(tool) for _ in range(jobs)]
    for desk in all_desks:
        desks.put(desk)

    def one(name: str) -> None:
        design, at = named[name]
        if (answers / f"{name}.json").exists() or time.monotonic() > latest:
            return
        desk = desks.get()
        try:
            case = draw(design, at)
            files = files_of(case)
            assert {file: digest(content) for file, content in files.items()} == inputs[name], "cases must repeat"
            examine(desk, name, files, case.withheld, answers, rivals)
        finally:
            desks.put(desk)

    try:
        with ThreadPoolExecutor(jobs) as pool:
            for done, _ in enumerate(pool.map(one, named), start=1):
                progress(done, len(named), "cases")
    finally:
        for desk in all_desks:
            desk.close()
