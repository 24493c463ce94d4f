"""``gsfdi prove``: the proof on concealed data, run or checked."""

import logging
from pathlib import Path

from gsfdi import proof
from gsfdi.atomic import write_text
from gsfdi.pipeline.outcome import Outcome
from gsfdi.reports import proof_page
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
    result = proof.prove(cases, seed=seed, out=out, jobs=crew.size, progress=progress, say=LOG.warning)
    write_text(out / "proof.html", proof_page.write(result))
    return Outcome(result, [*proof_page.lines(result), str(out / "proof.json"), str(out / "proof.html")])


def check(folder: Path) -> Outcome:
    """Check the seal of an earlier proof, and score its stored answers again.

    Parameters
    ----------
    folder : Path
        What `prove` wrote.
    """
    result = proof.check(folder)
    return Outcome(result, ["the seal holds, and the stored answers score as was said", *proof_page.lines(result)])
