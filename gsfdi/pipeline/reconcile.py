"""``gsfdi reconcile``: where simulation and recording differ, what was left out, and the models that put it right."""

import json
import logging
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

from gsfdi import ingest as reading
from gsfdi.atomic import write_text
from gsfdi.errors import GsfdiError, UnusableInputError, is_interruption, nearest
from gsfdi.model import JointModel
from gsfdi.modelfile import dump, load_models, terms
from gsfdi.pipeline.outcome import Outcome, absent, by_joint, mappings_of, need
from gsfdi.reconcile import Reconciliation
from gsfdi.reconcile import reconcile as reconcile_joint
from gsfdi.reports import reconcile_page
from gsfdi.reports.to_json import strict
from gsfdi.simulate import at_once
from gsfdi.types import JointRecord, Problem
from gsfdi.workers import ALONE, Crew, Report, each, silent

LOG = logging.getLogger("gsfdi")


@dataclass(frozen=True, slots=True)
class Question:
    """What a worker reconciles.

    Parameters
    ----------
    records : tuple of JointRecord
        Recordings of one joint.
    model : JointModel
        The simulation that they are held against.
    without : tuple of str
        Terms that the library must do without.
    """

    records: tuple[JointRecord, ...]
    model: JointModel
    without: tuple[str, ...] = ()


def answer(question: Question, hands: int = 1) -> Reconciliation | Problem:
    """Reconcile one joint, or say why that cannot be done: what fails for one must not cost the answers of the others.

    Parameters
    ----------
    question : Question
        Recordings and model.
    hands : int
        Threads that replay it.
    """
    subject = f"{question.records[0].source}: joint {question.records[0].joint}"
    try:
        with at_once(hands):
            return reconcile_joint(question.records, question.model, without=question.without)
    except GsfdiError as error:
        return Problem(subject, f"{error.subject}: {error.what}", error.mend, "left_out")
    except Exception as error:
        if is_interruption(error):
            raise KeyboardInterrupt from error
        LOG.debug("%s", subject, exc_info=True)
        bug = f"{type(error).__name__}: {error}; this is a bug in gsfdi"
        return Problem(subject, bug, "'--jobs 1 -vv' shows where; leave the joint out until it is mended", "left_out")


def reconcile(
    sources: Sequence[str],
    *,
    model: Path,
    out: Path,
    mappings: Sequence[Path] = (),
    joints: Sequence[str] = (),
    without: Sequence[str] = (),
    crew: Crew = ALONE,
    progress: Report = silent,
) -> Outcome:
    """Find where recordings and simulation differ, joint by joint, and write what was found.

    Parameters
    ----------
    sources : sequence of str
        Files, folders, globs.
    model : Path
        Model file.
    out : Path
        Folder for reconcile.json, report.html and the updated models.
    mappings : sequence of Path
        Mapping files.
    joints : sequence of str
        Joints wanted; all if empty.
    without : sequence of str
        Terms to leave out of the library.
    crew : Crew
        Who does the work.
    progress : callable
        Told how far the work has come.
    """
    for term in without:
        if term not in terms():
            raise UnusableInputError(f"--without {term}", "no term is called that", nearest(term, terms()))
    models = load_models(model)
    batch = reading.read(reading.gather(sources), mappings_of(mappings), joints)
    need(batch.records, batch.problems)
    problems = [*batch.problems, *absent(joints, (record.joint for record in batch.records))]
    questions = []
    for records in by_joint(batch.records).values():
        try:
            questions.append(Question(tuple(records), models.for_joint(records[0].joint), tuple(without)))
        except GsfdiError as error:
            problems.append(Problem(error.subject, error.what, error.mend, "left_out"))
    return solve(questions, problems, out, crew, progress)


def solve(
    questions: Sequence[Question],
    problems: Sequence[Problem],
    out: Path,
    crew: Crew = ALONE,
    progress: Report = silent,
) -> Outcome:
    """Answer every question, and write what was found.

    Parameters
    ----------
    questions : sequence of Question
        One per joint.
    problems : sequence of Problem
        What was left out so far.
    out : Path
        Folder for what is written.
    crew : Crew
        Who does the work.
    progress : callable
        Told how far the work has come.
    """
    answers = each(partial(answer, hands=crew.hands(len(questions))), questions, crew, progress, "joints")
    problems = [*problems, *(one for one in answers if isinstance(one, Problem))]
    found = [one for one in answers if isinstance(one, Reconciliation)]
    need(found, problems)
    return write(found, [record for question in questions for record in question.records], out, problems)


def write(
    found: Sequence[Reconciliation], records: Sequence[JointRecord], out: Path, problems: Sequence[Problem]
) -> Outcome:
    """Write updated models, reconcile.json and the page, in this order, so that the JSON never names a missing file.

    Parameters
    ----------
    found : sequence of Reconciliation
        One per joint.
    records : sequence of JointRecord
        What they were found in.
    out : Path
        Folder.
    problems : sequence of Problem
        What was left out.
    """
    stories, joints = [], []
    for one in found:
        joint: dict[str, Any] = dict(one.to_json())
        text = ""
        joint["updated_model"] = None
        if one.updated_model is not None:
            joint["updated_model"] = f"{quote(one.joint, safe='')}.updated_model.toml"
            dump(one.updated_model, out / joint["updated_model"])
            text = (out / joint["updated_model"]).read_text(encoding="utf-8")
        joints.append(joint)
        stories.append(reconcile_page.Story(joint, one.evidence, text))
    recordings = [{"path": path, "sha256": sha256} for path, sha256 in sorted({(r.source, r.sha256) for r in records})]
    made = datetime.now(UTC).isoformat(timespec="seconds")
    result = strict(
        {
            "schema": "gsfdi/reconcile/1",
            "made": made,
            "recordings": recordings,
            "joints": joints,
            "problems": [asdict(problem) for problem in problems],
        }
    )
    assert isinstance(result, dict)
    write_text(out / "reconcile.json", json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    write_text(out / "report.html", reconcile_page.write(stories, recordings, made))
    lines = [f"{joint['joint']}: {reconcile_page.sentence(joint)}" for joint in joints]
    return Outcome(result, [*lines, str(out / "reconcile.json"), str(out / "report.html")], problems)
