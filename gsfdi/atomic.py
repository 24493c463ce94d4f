"""Files that are either whole or not there: written aside, synced to the disk, then renamed into place."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gsfdi.errors import UnusableInputError


@contextmanager
def aside(path: Path) -> Iterator[Path]:
    """Give a path to write to; on leaving without an exception it becomes `path`, else it is removed.

    Parameters
    ----------
    path : Path
        The file to be; its folder is made if need be.

    Yields
    ------
    Path
        An empty file beside `path`, hidden, on the same file system.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise UnusableInputError(path, f"cannot be written: {error.strerror}", "choose another folder") from error
    part = Path(name)
    try:
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        part.chmod(0o666 & ~_umask())
        part.replace(path)
        sync_folder(path.parent)
    finally:
        part.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` as UTF-8, whole or not at all.

    Parameters
    ----------
    path : Path
        The file to be.
    text : str
        All that it is to hold.
    """
    with aside(path) as part:
        part.write_text(text, encoding="utf-8")


def sync_folder(folder: Path) -> None:
    """Make a rename in `folder` survive a power cut, where the system has a way to."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
