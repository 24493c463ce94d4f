"""``gsfdi ingest``: telemetry into the store, with a quality line for every joint."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from gsfdi import ingest as reading
from gsfdi.errors import GsfdiError
from gsfdi.pipeline.outcome import Outcome, absent, mappings_of, need
from gsfdi.pipeline.quality_lines import quality_line
from gsfdi.store import Store
from gsfdi.types import Batch, JointRecord, Problem
from gsfdi.workers import Report, silent


def describe(sources: Sequence[str], mappings: Sequence[Path]) -> Outcome:
    """Say what files hold and how they would be read.

    Parameters
    ----------
    sources : sequence of str
        Files, folders, globs.
    mappings : sequence of Path
        Mapping files.
    """
    loaded = mappings_of(mappings)
    found: list[Mapping[str, object]] = []
    problems: list[Problem] = []
    for path in reading.gather(sources):
        try:
            found.append(reading.describe(path, loaded))
        except GsfdiError as error:
            problems.append(Problem(str(path), error.what, error.mend, "unusable"))
    need(found, problems)
    result = {"schema": "gsfdi/description/1", "files": found, "problems": [asdict(problem) for problem in problems]}
    return Outcome(result, [line for about in found for line in outline(about)], problems)


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
    loaded, keep = mappings_of(mappings), Store(store)
    paths = reading.gather(sources)
    rows: list[dict[str, object]] = []
    problems: list[Problem] = []
    added = 0
    for done, path in enumerate(paths):
        progress(done, len(paths), "files")
        written: list[Path] = []
        found = reading.summary(_kept(reading.stream([path], loaded, joints), keep, written, problems))
        rows += [{"source": str(path), "new": bool(written), **row} for row in found]
        added += bool(written)
    need(rows, problems)
    problems += absent(joints, (str(row["joint"]) for row in rows))
    result = {
        "schema": "gsfdi/ingest/1",
        "store": str(store),
        "files": len(paths),
        "new": added,
        "joints": rows,
        "problems": [asdict(problem) for problem in problems],
    }
    return Outcome(result, [quality_line(row) for row in rows], problems)


def _kept(pieces: Iterable[Batch], keep: Store, written: list[Path], problems: list[Problem]) -> Iterator[JointRecord]:
    """Records of a file of any length: each is in the store before the next is read."""
    for batch in pieces:
        problems += batch.problems
        written += keep.add(batch)
        yield from batch.records


def outline(about: Mapping[str, object], indent: str = "") -> list[str]:
    """Write nested facts as indented lines.

    Parameters
    ----------
    about : mapping
        Facts; values may be mappings and lists of mappings.
    indent : str
        What each line begins with.

    Examples
    --------
    >>> outline({"rows": 3, "read_as": [{"joint": "SH1", "channel": "position"}]})
    ['rows: 3', 'read_as:', '  - joint: SH1', '    channel: position']
    """
    lines = []
    for key, value in about.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{key}:", *outline(value, indent + "  ")]
        elif isinstance(value, list | tuple) and any(isinstance(item, Mapping) for item in value):
            lines.append(f"{indent}{key}:")
            for item in value:
                first, *rest = outline(item, indent + "    ")
                lines += [f"{indent}  - {first.strip()}", *rest]
        elif isinstance(value, list | tuple):
            lines.append(f"{indent}{key}: {', '.join(map(str, value)) or 'none'}")
        else:
            lines.append(f"{indent}{key}: {value}")
    return lines
