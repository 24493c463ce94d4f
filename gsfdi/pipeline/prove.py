"""``gsfdi prove``: the proof on concealed data, run or checked."""

import logging
from pathlib import Path
from typing import Any

from gsfdi import proof
from gsfdi.pipeline.outcome import Outcome
from gsfdi.workers import ALONE, Crew, Report, silent

LOG = logging.getLogger("gsfdi")


def prove(cases: int, *, seed: int, out: Path, crew: Crew = ALONE, progress: Report = silent) -> Outcome:
    """Make sealed cases, reconcile each without knowing the answer, open the seal and score.

    Parameters
    ----------
    cases : int
        How many.
    seed : int
        Seed of the cases.
    out : Path
        Folder for proof.json and proof.html.
    crew : Crew
        Who does the work.
    progress : callable
        Told how far the work has come.
    """
    return _told(proof.prove(cases, seed=seed, out=out, jobs=crew.size, progress=progress, say=LOG.warning))


def check(folder: Path) -> Outcome:
    """Check the seal of an earlier proof, and score its stored answers again.

    Parameters
    ----------
    folder : Path
        What `prove` wrote.
    """
    return _told(proof.check(folder))


def _told(result: dict[str, Any]) -> Outcome:
    return Outcome(result, [str(line) for line in result.get("says", ())])
