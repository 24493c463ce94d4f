"""What a command has to say when it is done, and what every command does with its inputs first."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gsfdi.errors import UnusableInputError, nearest, one_line
from gsfdi.ingest import load_mapping
from gsfdi.mapping import Mapping
from gsfdi.types import JointRecord, Level, Problem


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a command has to say.

    Parameters
    ----------
    result : dict
        What ``--json`` prints.
    lines : sequence of str
        What is printed otherwise.
    problems : sequence of Problem
        What was damaged, cut short or left out.
    levels : sequence of str
        The verdicts' levels, for ``--fail-on``.
    """

    result: dict[str, Any]
    lines: Sequence[str]
    problems: Sequence[Problem] = ()
    levels: Sequence[Level] = ()

    def log(self, notes: bool) -> list[str]:
        """One line per problem.

        Parameters
        ----------
        notes : bool
            Whether to give notes too, which cost no telemetry.
        """
        told = [problem for problem in self.problems if notes or problem.kind != "note"]
        return [one_line(f"{p.path}: {p.what}" + (f"; {p.mend}" if p.mend else "")) for p in told]

    @property
    def damaged(self) -> bool:
        """Whether a problem costs telemetry."""
        return any(problem.kind != "note" for problem in self.problems)


def need(found: Sequence[object], problems: Sequence[Problem]) -> None:
    """Refuse to go on when nothing of the input can be used, naming the first reason.

    Parameters
    ----------
    found : sequence
        What can be used.
    problems : sequence of Problem
        Why the rest cannot.
    """
    if not found:
        first = problems[0] if problems else Problem("input", "holds no joint telemetry")
        more = f" (and {len(problems) - 1} more like it)" if len(problems) > 1 else ""
        raise UnusableInputError(first.path, first.what + more, first.mend)


def absent(wanted: Sequence[str], found: Iterable[str]) -> list[Problem]:
    """Say which of the joints that were asked for are in none of the files.

    Parameters
    ----------
    wanted : sequence of str
        Joints asked for.
    found : iterable of str
        Joints that there are.
    """
    there = sorted(set(found))
    return [
        Problem(f"--joint {joint}", "is in none of the files", nearest(joint, there), "left_out")
        for joint in wanted
        if joint not in there
    ]


def mappings_of(paths: Sequence[Path]) -> tuple[Mapping, ...]:
    """Load mapping files.

    Parameters
    ----------
    paths : sequence of Path
        The files.
    """
    return tuple(load_mapping(path) for path in paths)


def key_of(record: JointRecord) -> str:
    """Name a joint uniquely: two arms may each have a wrist.

    Parameters
    ----------
    record : JointRecord
        Telemetry of the joint.
    """
    return f"{record.robot}/{record.joint}"


def by_joint(records: Iterable[JointRecord]) -> dict[str, list[JointRecord]]:
    """Sort records by the joint that they are of, in order of time.

    Parameters
    ----------
    records : iterable of JointRecord
        Of any number of joints.
    """
    found: dict[str, list[JointRecord]] = {}
    for record in sorted(records, key=lambda one: one.t0_ns):
        found.setdefault(key_of(record), []).append(record)
    return found
