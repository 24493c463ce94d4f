"""``gsfdi baseline``: what every joint does while it is free of faults, learnt and kept."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gsfdi import __version__
from gsfdi import ingest as reading
from gsfdi.baseline import Baseline, JointBaseline, learn_joint
from gsfdi.errors import BaselineError, GsfdiError, UnusableInputError
from gsfdi.model import JointModel
from gsfdi.modelfile import Models, load_models
from gsfdi.pipeline.outcome import Outcome, absent, by_joint, mappings_of, need
from gsfdi.store import Store
from gsfdi.types import JointRecord, Problem
from gsfdi.workers import ALONE, Crew, Report, each, silent


@dataclass(frozen=True, slots=True)
class Lesson:
    """What a worker learns one joint's baseline from."""

    records: tuple[JointRecord, ...]
    model: JointModel | None


def baseline(
    sources: Sequence[str],
    *,
    store: Path,
    mappings: Sequence[Path] = (),
    joints: Sequence[str] = (),
    model: Path | None = None,
    name: str = "default",
    crew: Crew = ALONE,
    progress: Report = silent,
) -> Outcome:
    """Learn the baseline of every joint and keep it.

    Parameters
    ----------
    sources : sequence of str
        Files, folders, globs of fault-free batches.
    store : Path
        The store's folder.
    mappings : sequence of Path
        Mapping files.
    joints : sequence of str
        Joints wanted; all if empty.
    model : Path, optional
        Model file.
    name : str
        Name of the baseline.
    crew : Crew
        Who does the work.
    progress : callable
        Told how far the work has come.
    """
    models = load_models(model) if model else None
    batch = reading.read(reading.gather(sources), mappings_of(mappings), joints)
    need(batch.records, batch.problems)
    sorted_by_joint = by_joint(batch.records)
    problems = [*batch.problems, *absent(joints, (record.joint for record in batch.records))]
    lessons = [Lesson(tuple(some), model_of(models, some[0].joint, problems)) for some in sorted_by_joint.values()]
    learnt = dict(zip(sorted_by_joint, each(learn, lessons, crew, progress, "baselines"), strict=True))
    problems += [one for one in learnt.values() if isinstance(one, Problem)]
    whole = Baseline({key: one for key, one in learnt.items() if isinstance(one, JointBaseline)})
    need(list(whole.joints), problems)
    content = {**whole.to_dict(), "order": list(whole.joints), "learnt_by": __version__}
    digest = Store(store).save_baseline(name, json.loads(json.dumps(content, default=plain)))
    rows = [
        {"robot": one.robot, "joint": one.joint, "batches": one.batches, "span_s": one.span}
        for one in whole.joints.values()
    ]
    lines = [f"{row['joint']}: learnt from {row['batches']} batches, {row['span_s']:.0f} s" for row in rows]
    result = {
        "schema": "gsfdi/baseline-summary/1",
        "name": name,
        "sha256": digest,
        "joints": rows,
        "problems": [asdict(problem) for problem in problems],
    }
    return Outcome(result, [*lines, f"baseline {name!r} ({digest[:12]}) is kept in {store}"], problems)


def load(store: Path, name: str) -> tuple[Baseline, str]:
    """Fetch a baseline from a store, with its SHA-256.

    Parameters
    ----------
    store : Path
        The store's folder.
    name : str
        Name of the baseline.

    Raises
    ------
    BaselineError
        There is none, its checksum fails, or another version learnt it, whose numbers mean something else.
    """
    content, digest = Store(store).load_baseline(name)
    by = content.get("learnt_by")
    if by != __version__:
        raise BaselineError(
            name, f"was learnt by gsfdi {by}, this is {__version__}", "learn it anew with gsfdi baseline"
        )
    content["joints"] = {key: content["joints"][key] for key in content["order"]}
    kept = Baseline.from_dict(content).joints
    return Baseline({key: replace(one, joint=key.removeprefix(f"{one.robot}/")) for key, one in kept.items()}), digest


def model_of(models: Models | None, joint: str, problems: list[Problem]) -> JointModel | None:
    """Find a joint's model; without one it is learnt from telemetry alone, and a note says so.

    Parameters
    ----------
    models : Models or None
        What the model file describes.
    joint : str
        Name of the joint.
    problems : list of Problem
        Where the note goes.
    """
    try:
        return models.for_joint(joint) if models else None
    except UnusableInputError as error:
        problems.append(Problem(error.subject, f"{error.what}; learnt without a model", error.mend, "note"))
        return None


def learn(lesson: Lesson) -> JointBaseline | Problem:
    """Learn one joint, or say why that cannot be done.

    Parameters
    ----------
    lesson : Lesson
        Fault-free telemetry, and the joint's model where there is one.
    """
    first = lesson.records[0]
    try:
        return learn_joint(lesson.records, lesson.model)
    except GsfdiError as error:
        return Problem(f"{first.source}: joint {first.joint}", error.what, error.mend, "left_out")


def plain(value: Any) -> Any:
    """Turn what JSON does not know into what it knows.

    Parameters
    ----------
    value : object
        An array, a number of numpy's or a mapping.
    """
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else dict(value)
