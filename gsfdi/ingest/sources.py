"""Which files a call means, and the reader that each is for."""

import glob
from collections.abc import Sequence
from pathlib import Path

from gsfdi.errors import UnusableInputError
from gsfdi.mapping import Mapping
from gsfdi.readers import Reader
from gsfdi.registry import shelf

HEAD = 1 << 16
"""First bytes of a file, by which its reader knows it."""


def gather(sources: Sequence[str]) -> list[Path]:
    """Name the files that files, folders and globs stand for.

    Parameters
    ----------
    sources : sequence of str

    Returns
    -------
    list of Path
        Each once, sorted within a source. Of a folder only what a reader knows.

    Raises
    ------
    UnusableInputError
        A source stands for nothing.
    """
    found: dict[Path, None] = {}
    for source in sources:
        path = Path(source)
        if path.is_dir():
            files = sorted(p for p in path.rglob("*") if p.is_file() and not _hidden(p, path) and _sniffed(p))
        elif path.exists():
            files = [path]
        else:
            files = sorted(Path(name) for name in glob.glob(source, recursive=True) if Path(name).is_file())
        if not files:
            what = "holds no MCAP, Parquet or CSV" if path.is_dir() else "does not exist"
            raise UnusableInputError(source, what, "name a recording, a folder of them or a glob")
        found |= dict.fromkeys(files)
    return list(found)


def describe(path: Path | str, mappings: Sequence[Mapping] = ()) -> dict[str, object]:
    """Say what a file holds and how it would be read.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    """
    path = Path(path)
    reader = reader_of(path)
    return {"path": str(path), "bytes": path.stat().st_size, **reader.describe(path, mappings)}


def reader_of(path: Path) -> Reader:
    """Find the reader of a file; one that none can read is refused."""
    reader = _sniffed(path)
    if reader is None:
        size = path.stat().st_size
        what = f"is none of MCAP, Parquet, CSV ({size} bytes)" if size else "is empty"
        raise UnusableInputError(path, what, "give MCAP, Parquet or CSV")
    return reader


def _sniffed(path: Path) -> Reader | None:
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise UnusableInputError(path, f"cannot be read: {error.strerror}", "check its permissions") from error
    return next((reader for reader in shelf("gsfdi.readers", Reader).values() if reader.sniff(head)), None)


def _hidden(path: Path, root: Path) -> bool:
    return any(part.startswith((".", "_")) for part in path.relative_to(root).parts)
