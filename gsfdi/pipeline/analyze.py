"""``gsfdi analyze``: every joint of a batch judged against its baseline, in one pass and bounded memory."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

from gsfdi import ingest as reading
from gsfdi.atomic import write_text
from gsfdi.baseline import Baseline
from gsfdi.diagnosis import Limits
from gsfdi.modelfile import load_models
from gsfdi.pipeline.baseline import load
from gsfdi.pipeline.history import foretold, past
from gsfdi.pipeline.outcome import Outcome, absent, mappings_of, need
from gsfdi.pipeline.watching import Judged, Share, baseline_of, watch
from gsfdi.registry import shelf
from gsfdi.reports import Analysis
from gsfdi.reports import Report as Form
from gsfdi.store import Store
from gsfdi.workers import ALONE, Crew, Report, each, silent

LARGE = 64 << 20
"""Bytes of input from which more processes than one are worth their start."""
USUAL = ("json", "csv", "html")


def analyze(
    sources: Sequence[str],
    *,
    store: Path,
    out: Path,
    mappings: Sequence[Path] = (),
    joints: Sequence[str] = (),
    name: str = "default",
    model: Path | None = None,
    crew: Crew = ALONE,
    progress: Report = silent,
    reports: Sequence[str] = (),
    now: datetime | None = None,
    stale_after_s: float | None = None,
) -> Outcome:
    """Judge every joint of a batch, and write the reports.

    Parameters
    ----------
    sources : sequence of str
        Files, folders, globs: together one batch.
    store : Path
        The store that holds baseline and history.
    out : Path
        Folder for the reports.
    mappings : sequence of Path
        Mapping files.
    joints : sequence of str
        Joints wanted; all if empty.
    name : str
        Name of the baseline.
    model : Path, optional
        Model file, for reconcile to start from where a verdict lacks a cause.
    crew : Crew
        Who does the work.
    progress : callable
        Told how far the work has come.
    reports : sequence of str
        Reports beyond the usual three.
    now : datetime, optional
        When the analysis is; the present moment by default.
    stale_after_s : float, optional
        Age from which telemetry is stale [s]; never by default.
    """
    now = now or datetime.now(UTC)
    baseline, digest = load(store, name)
    paths = tuple(reading.gather(sources))
    size = sum(path.stat().st_size for path in paths)
    parts = min(crew.size, len(baseline.joints)) if crew.scheduler or size >= LARGE else 1
    loaded, models = mappings_of(mappings), load_models(model) if model else None
    shares = [
        Share(paths, loaded, tuple(joints), number, parts, baseline, models, now, stale_after_s)
        for number in range(parts)
    ]
    done = each(watch, shares, crew, progress, "analysis")
    judged = in_order([one for some, _, _ in done for one in some], baseline)
    problems = list(dict.fromkeys(problem for _, some, _ in done for problem in some))
    need(judged, problems)
    problems += absent(joints, (one.verdict.joint for one in judged))
    hashes = {path: sha for _, _, some in done for path, sha in some.items()}
    batch, keep = together(hashes), Store(store)
    judged = [
        replace(one, verdict=foretold(one.verdict, keep, one.record.robot, 1e-9 * one.record.t0_ns, batch, digest))
        for one in judged
    ]
    analysis = Analysis(
        batch_path=common(hashes),
        batch_sha256=batch,
        baseline_name=name,
        baseline_sha256=digest,
        made=now.isoformat(timespec="seconds"),
        verdicts=tuple(one.verdict for one in judged),
        records=tuple(one.record for one in judged),
        problems=tuple(problems),
        ledgers=tuple(
            tuple(past(keep, one.record.robot, one.verdict.joint, 1e-9 * one.record.t0_ns, digest)) for one in judged
        ),
        limit=Limits().distress,
    )
    written = write_reports(analysis, out, [*USUAL, *reports])
    several = len({one.record.robot for one in judged}) > 1
    lines = [
        f"{one.verdict.verdict:12} {f'{one.record.robot}: ' if several else ''}{one.verdict.says}" for one in judged
    ]
    result = json.loads((out / "verdicts.json").read_text(encoding="utf-8"))
    return Outcome(result, [*lines, *map(str, written)], problems, [one.verdict.verdict for one in judged])


def in_order(judged: Sequence[Judged], baseline: Baseline) -> list[Judged]:
    """Sort joints as the baseline has them, base to tip as a rule; those that it does not know come last.

    Parameters
    ----------
    judged : sequence of Judged
        In the order in which they came.
    baseline : Baseline
        What they were judged against.
    """
    places = {id(known): place for place, known in enumerate(baseline.joints.values())}
    return sorted(judged, key=lambda one: places.get(id(baseline_of(baseline, one.record)), len(places)))


def write_reports(analysis: Analysis, out: Path, names: Sequence[str]) -> list[Path]:
    """Write the reports called `names` into `out`.

    Parameters
    ----------
    analysis : Analysis
        What they tell.
    out : Path
        Folder.
    names : sequence of str
        Names on the shelf of reports.
    """
    forms = shelf("gsfdi.reports", Form)
    written = []
    for name in dict.fromkeys(names):
        path = out / forms[name].filename
        write_text(path, forms[name].write(analysis))
        written.append(path)
    return written


def common(hashes: Mapping[str, str]) -> str:
    """One path for a batch: its only file, or the folder that its files share.

    Parameters
    ----------
    hashes : mapping of str to str
        Path -> SHA-256.
    """
    paths = [Path(path) for path in hashes]
    folder = (
        paths[0]
        if len(paths) == 1
        else next((p for p in paths[0].parents if all(p in q.parents for q in paths)), Path())
    )
    return str(folder)


def together(hashes: Mapping[str, str]) -> str:
    """One hash for a batch: its only file's, or the hash over all its files' hashes.

    Parameters
    ----------
    hashes : mapping of str to str
        Path -> SHA-256.
    """
    digests = sorted(set(hashes.values()))
    return digests[0] if len(digests) == 1 else sha256("\n".join(digests).encode()).hexdigest()
