"""The night's work, as cron calls it: new files from the inbox in, one dated folder and the history out.

It may be killed at any moment and started again. A night is made in a hidden folder and appears under its date by one
rename; only that rename makes its files "done", and removing the folder makes them new again. A file is known by its
SHA-256, so the same bytes under another name are not analysed twice; what the store and the ledger got before a kill
they recognise by the same hash. The history (``history.jsonl``, one line per joint and night) is brought up to date
from the dated folders at every start, so a kill between rename and history loses nothing.
"""

import json
import logging
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from hashlib import file_digest
from pathlib import Path
from typing import Any

import filelock

from gsfdi import ingest as reading
from gsfdi.atomic import sync_folder, write_text
from gsfdi.config import Night
from gsfdi.errors import GsfdiError, LockedError, UnusableInputError
from gsfdi.modelfile import load_models
from gsfdi.options import LEVELS
from gsfdi.pipeline.analyze import LARGE, analyze
from gsfdi.pipeline.baseline import load
from gsfdi.pipeline.cause import healthy
from gsfdi.pipeline.ingest import ingest
from gsfdi.pipeline.outcome import Outcome, by_joint, mappings_of, need
from gsfdi.pipeline.reconcile import Question, solve
from gsfdi.pipeline.watching import baseline_of
from gsfdi.types import Problem
from gsfdi.workers import Crew, Report, silent

LOG = logging.getLogger("gsfdi")
HISTORY = "history.jsonl"
NIGHT = "night.json"
DAY = 86400.0


@dataclass(frozen=True, slots=True)
class Arrival:
    """A file of the inbox and the hash of its bytes."""

    path: Path
    sha256: str


def nightly(settings: Night, *, progress: Report = silent, now: datetime | None = None) -> Outcome:
    """Do one night's work.

    Parameters
    ----------
    settings : Night
        The night's settings.
    progress : callable
        Told how far the work has come.
    now : datetime, optional
        When the night is; the present moment by default.

    Returns
    -------
    Outcome
        What the analysis found; without new files, that there was nothing to do.

    Raises
    ------
    LockedError
        Another run is at work on the same folders.
    """
    if not settings.inbox.is_dir():
        raise UnusableInputError(settings.inbox, "the inbox is no folder", "make it, or mend 'inbox'")
    settings.out.mkdir(parents=True, exist_ok=True)
    lock = filelock.FileLock(settings.out / ".lock")
    try:
        with lock.acquire(timeout=0):
            return make(settings, progress, now or datetime.now(UTC))
    except filelock.Timeout as error:
        raise LockedError(settings.out, "another run is at work here", "let it finish, or end it") from error


def make(settings: Night, progress: Report, now: datetime) -> Outcome:
    """Do the work of one night while the lock is held."""
    for rest in settings.out.glob(".*.making"):
        shutil.rmtree(rest)
    known = _remember(settings.out)
    arrivals = [one for one in _arrivals(settings) if one.sha256 not in known]
    unique = list({one.sha256: one for one in arrivals}.values())
    if not unique:
        return Outcome({"schema": "gsfdi/night/1", "folder": None, "files": []}, ["nothing new in the inbox"])
    making = settings.out / f".{now:%Y-%m-%d}.making"
    making.mkdir()
    outcome = _work(settings, [str(one.path) for one in unique], making, progress, now)
    files = [{"path": str(one.path), "sha256": one.sha256} for one in unique]
    joints = outcome.result.get("joints", [])
    night = {"schema": "gsfdi/night/1", "at": now.isoformat(timespec="seconds"), "files": files, "joints": joints}
    write_text(making / NIGHT, json.dumps(night, indent=1))
    folder = _free(settings.out, f"{now:%Y-%m-%d}")
    making.rename(folder)
    sync_folder(settings.out)
    _remember(settings.out)
    need(joints, outcome.problems)
    lines = [line.replace(str(making), str(folder)) for line in outcome.lines]
    return Outcome({**outcome.result, "folder": str(folder), "files": files}, lines, outcome.problems, outcome.levels)


def _work(settings: Night, files: list[str], making: Path, progress: Report, now: datetime) -> Outcome:
    """Ingest and analyse; input that is wholly unusable is a night too, else it would be tried again every night."""
    store, mappings, joints = settings.store, settings.mappings, settings.joints
    try:
        ingest(files, store=store, mappings=mappings, joints=joints, progress=progress)
    except UnusableInputError as error:
        return Outcome({"joints": []}, [], [Problem(error.subject, error.what, error.mend, "unusable")])
    outcome = analyze(
        files,
        store=store,
        mappings=mappings,
        joints=joints,
        name=settings.baseline,
        model=settings.model if settings.reconcile else None,
        out=making,
        crew=Crew(settings.jobs, settings.scheduler),
        progress=progress,
        reports=settings.reports,
        stale_after_s=DAY * settings.stale_after_days if settings.stale_after_days is not None else None,
        now=now,
    )
    alarmed = [joint for joint in outcome.result["joints"] if joint["verdict"] in LEVELS]
    if alarmed and settings.reconcile and settings.model and sum(Path(file).stat().st_size for file in files) < LARGE:
        written = _causes(settings, settings.model, files, alarmed, making / "reconciled", progress)
        return replace(outcome, lines=[*outcome.lines, *written])
    return outcome


def _causes(
    settings: Night,
    model: Path,
    files: Sequence[str],
    alarmed: Sequence[Mapping[str, Any]],
    out: Path,
    progress: Report,
) -> Sequence[str]:
    """Hold the joints that alarm against their fault-free selves, for the page that shows what has changed."""
    models, baseline = load_models(model), load(settings.store, settings.baseline)[0]
    batch = reading.read(files, mappings_of(settings.mappings), [joint["joint"] for joint in alarmed])
    questions = []
    for records in by_joint(batch.records).values():
        known = baseline_of(baseline, records[0])
        if known is not None:
            nominal = healthy(records[0], known, models.for_joint(records[0].joint))
            questions.append(Question(tuple(records), nominal))
    try:
        return solve(questions, (), out, Crew(settings.jobs, settings.scheduler), progress).lines
    except GsfdiError as error:
        LOG.warning("reconcile: %s", error)
        return []


def _arrivals(settings: Night) -> Iterator[Arrival]:
    """Files of the inbox that have settled, oldest name first."""
    for path in sorted(path for path in settings.inbox.rglob("*") if path.is_file()):
        hidden = any(part.startswith(".") for part in path.relative_to(settings.inbox).parts)
        if hidden or path.suffix in (".part", ".tmp"):
            continue
        if time.time() - path.stat().st_mtime < settings.settle_s:
            LOG.info("%s: still arriving, left for the next run", path)
            continue
        with path.open("rb") as file:
            yield Arrival(path, file_digest(file, "sha256").hexdigest())


def _remember(out: Path) -> set[str]:
    """Bring the history up to the dated folders; gives the hashes of every file that they have done."""
    nights = {path.parent.name: json.loads(path.read_text(encoding="utf-8")) for path in sorted(out.glob(f"*/{NIGHT}"))}
    history = out / HISTORY
    lines = history.read_text(encoding="utf-8").splitlines() if history.exists() else []
    entries = [json.loads(line) for line in lines]
    recorded = {(entry["night"], entry["at"]) for entry in entries}
    missing = [name for name, night in nights.items() if night["joints"] and (name, night["at"]) not in recorded]
    if missing:
        entries = [entry for entry in entries if entry["night"] not in missing]
        entries += [entry for name in missing for entry in _entries(name, nights[name])]
        write_text(history, "".join(json.dumps(entry) + "\n" for entry in entries))
    return {file["sha256"] for night in nights.values() for file in night["files"]}


def _entries(name: str, night: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """One line of history per joint."""
    kept = ("robot", "joint", "verdict", "action", "component", "fault", "fault_probability", "due", "says")
    for joint in night["joints"]:
        yield {"night": name, "at": night["at"], **{key: joint[key] for key in kept if key in joint}}


def _free(out: Path, date: str) -> Path:
    """The date's folder, or the next one of that date that is free."""
    names = (date if number == 1 else f"{date}-{number}" for number in range(1, 10_000))
    return next(out / name for name in names if not (out / name).exists())
