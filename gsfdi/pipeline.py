"""The order of the stages: what each command does with its files, from paths to an `Outcome`."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from gsfdi import ingest as reading
from gsfdi.atomic import write_text
from gsfdi.errors import BaselineError, GsfdiError, UnusableInputError, nearest, one_line
from gsfdi.store import Store
from gsfdi.types import JointRecord, Level, Problem
from gsfdi.workers import ALONE, Crew, Report, each, silent

__all__ = ["Crew", "Outcome", "analyze", "baseline", "describe", "ingest", "prove", "reconcile", "simulate", "terms"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a command has to say.

    Parameters
    ----------
    result : object
        What ``--json`` prints.
    lines : sequence of str
        What is printed otherwise.
    problems : sequence of Problem
        What was damaged, cut short or left out.
    levels : sequence of str
        The verdicts' levels, for ``--fail-on``.
    """

    result: Any
    lines: Sequence[str]
    problems: Sequence[Problem] = ()
    levels: Sequence[Level] = ()

    @property
    def log(self) -> list[str]:
        """One line per problem."""
        return [one_line(f"{p.path}: {p.what}" + (f"; {p.mend}" if p.mend else "")) for p in self.problems]

    @property
    def damaged(self) -> bool:
        """Whether a problem costs telemetry."""
        return any(problem.kind != "note" for problem in self.problems)


def describe(sources: Sequence[str], mappings: Sequence[Path]) -> Outcome:
    """Say what files hold and how they would be read.

    Parameters
    ----------
    sources : sequence of str
        Files, folders, globs.
    mappings : sequence of Path
        Mapping files.
    """
    loaded = _mappings(mappings)
    found: list[Mapping[str, object]] = []
    problems: list[Problem] = []
    for path in reading.gather(sources):
        try:
            found.append(reading.describe(path, loaded))
        except GsfdiError as error:
            problems.append(Problem(str(path), error.what, error.mend, "unusable"))
    _need(found, problems)
    return Outcome(found, [line for about in found for line in _outline(about)], problems)


def ingest(
    sources: Sequence[str],
    *,
    store: Path,
    mappings: Sequence[Path] = (),
    joints: Sequence[str] = (),
    progress: Report = silent,
) -> Outcome:
    """Read telemetry into the store, file by file.

    Parameters
    ----------
    sources : sequence of str
        Files, folders, globs.
    store : Path
        The store's folder.
    mappings : sequence of Path
        Mapping files.
    joints : sequence of str
        Joints wanted; all if empty.
    progress : callable
        Told how far the work has come.
    """
    loaded, keep = _mappings(mappings), Store(store)
    paths = reading.gather(sources)
    rows: list[dict[str, object]] = []
    problems: list[Problem] = []
    added = 0
    for done, path in enumerate(paths):
        progress(done, len(paths), "files")
        batch = reading.read([path], loaded, joints)
        problems += batch.problems
        if batch.records:
            new = bool(keep.add(batch))
            added += new
            rows += [{"source": str(path), "new": new, **row} for row in reading.summary(batch.records)]
    _need(rows, problems)
    result = {
        "schema": "gsfdi/ingest/1",
        "store": str(store),
        "files": len(paths),
        "new": added,
        "joints": rows,
        "problems": [asdict(problem) for problem in problems],
    }
    return Outcome(result, [_quality_line(row) for row in rows], problems)


@dataclass(frozen=True, slots=True)
class _Lesson:
    """What a worker learns one joint's baseline from."""

    records: tuple[JointRecord, ...]
    model: Any


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
    from gsfdi.baseline import Baseline

    model_of = _models(model)
    batch = reading.read(reading.gather(sources), _mappings(mappings), joints)
    _need(batch.records, batch.problems)
    by_joint: dict[str, list[JointRecord]] = {}
    for record in batch.records:
        by_joint.setdefault(f"{record.robot}/{record.joint}", []).append(record)
    lessons = [_Lesson(tuple(records), model_of(records[0].joint)) for records in by_joint.values()]
    learnt = dict(zip(by_joint, each(_learn, lessons, crew, progress, "baselines"), strict=True))
    problems = [*batch.problems, *(one for one in learnt.values() if isinstance(one, Problem))]
    whole = Baseline({key: one for key, one in learnt.items() if not isinstance(one, Problem)})
    if not whole.joints:
        _need((), problems)
    digest = Store(store).save_baseline(name, json.loads(json.dumps(whole.to_dict(), default=_plain)))
    rows = [
        {"robot": one.robot, "joint": one.joint, "batches": one.batches, "span_s": one.span}
        for one in whole.joints.values()
    ]
    result = {
        "schema": "gsfdi/baseline-summary/1",
        "name": name,
        "sha256": digest,
        "joints": rows,
        "problems": [asdict(problem) for problem in problems],
    }
    lines = [f"{row['joint']}: learnt from {row['batches']} batches, {row['span_s']:.0f} s" for row in rows]
    return Outcome(result, [*lines, f"baseline {name!r} {digest[:12]} is kept in {store}"], problems)


def _learn(lesson: _Lesson) -> Any:
    from gsfdi.baseline import learn_joint

    first = lesson.records[0]
    try:
        return learn_joint(lesson.records, lesson.model)
    except GsfdiError as error:
        return Problem(f"{first.source}: {first.joint}", error.what, error.mend, "left_out")


def _mappings(paths: Sequence[Path]) -> tuple[Any, ...]:
    return tuple(reading.load_mapping(path) for path in paths)


def _models(path: Path | None) -> Any:
    """From the name of a joint to its model, None where there is no model file."""
    if path is None:
        return lambda joint: None
    from gsfdi.modelfile import load_models

    return load_models(path).for_joint


def _need(found: Sequence[object], problems: Sequence[Problem]) -> None:
    """Refuse to go on when nothing of the input can be used, naming the first reason."""
    if not found:
        first = problems[0] if problems else Problem("input", "holds no joint telemetry")
        more = f" (and {len(problems) - 1} more like it)" if len(problems) > 1 else ""
        raise UnusableInputError(first.path, first.what + more, first.mend)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else dict(value)


def _quality_line(row: Mapping[str, Any]) -> str:
    masked = ", ".join(
        f"{channel} {kind.replace('_', ' ')} {count:g}"
        for channel, counts in row["masked"].items()
        for kind, count in counts.items()
    )
    return (
        f"{row['joint']}: {row['samples']} samples, {row['span_s']:.1f} s at {row['rate_hz']:.4g} Hz, "
        f"{row['gaps']} gaps; masked: {masked or 'nothing'}" + ("" if row["new"] else " (in the store already)")
    )


def _outline(about: Mapping[str, object], indent: str = "") -> list[str]:
    """What a file holds, as indented lines."""
    lines = []
    for key, value in about.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{key}:", *_outline(value, indent + "  ")]
        elif isinstance(value, list | tuple) and any(isinstance(item, Mapping) for item in value):
            lines.append(f"{indent}{key}:")
            for item in value:
                first, *rest = _outline(item, indent + "    ") if isinstance(item, Mapping) else [f"{indent}    {item}"]
                lines += [f"{indent}  - {first.strip()}", *rest]
        elif isinstance(value, list | tuple):
            lines.append(f"{indent}{key}: {', '.join(map(str, value)) or 'none'}")
        else:
            lines.append(f"{indent}{key}: {value}")
    return lines
