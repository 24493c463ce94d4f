"""SHA-256 of a file, and the seal that the file may carry: both from one pass over its bytes.

A seal is the digest of all bytes of a file with the seal itself as zeros. It stands in the footer, so that what both
digests share is nearly everything.
"""

import hashlib
from io import BufferedRandom, BufferedReader
from pathlib import Path
from typing import NamedTuple

NAME = b"gsfdi.seal"
BLANK = b"0" * 64
_FOOTER = 4 << 20
"""Bytes at the end of a file among which a seal may stand."""


class Digests(NamedTuple):
    """SHA-256 of a file as it is, and whether the seal that it carries holds; None where it carries none."""

    sha256: str
    whole: bool | None


def digests(path: Path) -> Digests:
    """Take a file's SHA-256, and check its seal.

    Parameters
    ----------
    path : Path
    """
    with path.open("rb") as file:
        plain, sealed, kept = _digests(file)
    return Digests(plain, None if kept is None else sealed.encode() == kept)


def seal(path: Path) -> None:
    """Put the digest where the zeros stand.

    Parameters
    ----------
    path : Path
        A file that was written with `BLANK` as its seal.
    """
    with path.open("rb+") as file:
        _, digest, kept = _digests(file)
        if kept != BLANK:
            raise RuntimeError(f"{path}: the seal's place was not found")
        file.seek(_place(file))
        file.write(digest.encode())


def _digests(file: BufferedReader | BufferedRandom) -> tuple[str, str, bytes | None]:
    """SHA-256 as the bytes are and with the seal as zeros, and the seal as it stands (None without one)."""
    at = _place(file)
    file.seek(0)
    if at < 0:
        plain = hashlib.file_digest(file, "sha256").hexdigest()
        return plain, plain, None
    whole = hashlib.sha256()
    block, left = memoryview(bytearray(1 << 18)), at
    while left > 0 and (size := file.readinto(block[: min(left, len(block))])):
        whole.update(block[:size])
        left -= size
    blanked = whole.copy()
    kept = file.read(len(BLANK))
    rest = file.read()
    whole.update(kept + rest)
    blanked.update(BLANK + rest)
    return whole.hexdigest(), blanked.hexdigest(), kept


def _place(file: BufferedReader | BufferedRandom) -> int:
    """Offset of the seal's digest: the last one in the file's footer, after its key and a thrift length byte."""
    file.seek(0, 2)
    size = file.tell()
    file.seek(max(0, size - _FOOTER))
    base = file.tell()
    tail = file.read()
    at = tail.rfind(NAME)
    # Thrift's compact protocol: key, field header 0x18, length 64, value.
    return base + at + len(NAME) + 2 if at >= 0 else -1
