"""Files in, records out: whole, or piece by piece where they are long."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from gsfdi.errors import GsfdiError, UnusableInputError
from gsfdi.ingest.held import Held
from gsfdi.ingest.sources import reader_of
from gsfdi.mapping import Mapping
from gsfdi.seal import digests
from gsfdi.types import Batch, JointRecord, Problem

PIECE = 4_000_000
"""Values held before `stream` hands a piece on."""
_CHECK = "check its permissions and the disk"
MOST_HELD = 200_000_000
"""Values of one file that `read` holds at most: four days of one joint's five channels at 100 Hz."""


def read(paths: Iterable[Path | str], mappings: Sequence[Mapping] = (), joints: Sequence[str] = ()) -> Batch:
    """Read recordings whole.

    Parameters
    ----------
    paths : iterable of Path
    mappings : sequence of Mapping
    joints : sequence of str
        Joints wanted; all if empty.

    Returns
    -------
    Batch
        A record per file, robot and joint, and everything left out and why. A file that cannot be used is a problem
        of the batch; the others are read all the same.
    """
    records: list[JointRecord] = []
    problems: list[Problem] = []
    for path in paths:
        whole = Batch(())
        for piece in _file(Path(path), mappings, joints, piece=None):
            whole = piece
        records += whole.records
        problems += whole.problems
    return Batch(tuple(records), tuple(problems))


def stream(
    paths: Iterable[Path | str], mappings: Sequence[Mapping] = (), joints: Sequence[str] = (), piece: int = PIECE
) -> Iterator[Batch]:
    """Read recordings of any length piece by piece.

    Parameters
    ----------
    paths : iterable of Path
    mappings : sequence of Mapping
    joints : sequence of str
        Joints wanted; all if empty.
    piece : int
        Values held at most before a piece is handed on.

    Yields
    ------
    Batch
        Consecutive stretches; the last of a file carries its problems.
    """
    for path in paths:
        yield from _file(Path(path), mappings, joints, piece)


def _file(path: Path, mappings: Sequence[Mapping], joints: Sequence[str], piece: int | None) -> Iterator[Batch]:
    """Pieces of one file; a file that cannot be used is a batch of one problem."""
    problems: list[Problem] = []
    try:
        reader = reader_of(path)
        seen = digests(path)
        held = Held(path, seen.sha256, joints)
        for item in reader.read(path, mappings, seen.whole):
            if isinstance(item, Problem):
                problems.append(item)
                continue
            held.add(item)
            if held.size >= (piece or MOST_HELD):
                if piece is None:
                    what = f"is too long to be held at once: more than {MOST_HELD:,} values"
                    raise UnusableInputError(path, what, "cut it, or ingest and analyze it, which go piece by piece")
                yield Batch(held.records())
        last = held.records()
        yield Batch(last, (*problems, *held.problems()))
    except GsfdiError as error:
        yield Batch((), (*problems, Problem(str(path), error.what, error.mend, "unusable")))
    except OSError as error:
        yield Batch(
            (), (*problems, Problem(str(path), f"cannot be read: {error.strerror or error}", _CHECK, "unusable"))
        )
