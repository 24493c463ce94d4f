"""The records of an MCAP file, in the order of its bytes, with every length checked and nothing decompressed unbounded.

The file is walked from its start, so it needs no index and may be cut short. What is read is handed on as `Block`:
bytes in which whole records stand side by side, from one chunk or from between the chunks.
"""

import zlib
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeAlias

import numpy as np
from mcap.opcode import Opcode

from gsfdi.errors import UnusableInputError
from gsfdi.types import Problem
from gsfdi.wire.kernels import Bytes, Ints, hop
from gsfdi.wire.tail import MAGIC, Cursor, Tail, checksum, read_tail
from gsfdi.wire.unpack import unpack

WINDOW = 1 << 22
"""Bytes of the file read at a time."""
MOST_CHUNK = 128 << 20
"""A chunk that would unpack to more is left out; recorders write 1 to 16 MB."""
MOST_RATIO, MOST_FREE = 200, 64 << 20
"""A whole file may unpack to this many times its size, and this many bytes on top."""
MOST_HOPS = 65_536
"""Records listed at a time."""
_LOOSE = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
_SKIPPED = (Opcode.ATTACHMENT, Opcode.MESSAGE_INDEX, Opcode.HEADER)


@dataclass(frozen=True, slots=True)
class Block:
    """Records side by side, and whether a checksum vouches for them; a cut block ends where the file does."""

    data: Bytes
    verified: bool
    cut: bool = False


@dataclass(frozen=True, slots=True)
class Note:
    """A metadata record."""

    name: str
    entries: Mapping[str, str]


Piece: TypeAlias = Block | Note | Problem


class Hops(NamedTuple):
    """Records of a buffer: opcode, start and length of each body."""

    opcodes: Bytes
    starts: Ints
    sizes: Ints


def walk(path: Path) -> Iterator[Piece]:
    """Yield the file's records in bounded pieces, and what is wrong with it.

    Parameters
    ----------
    path : Path
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        tail = read_tail(file, size)
        trusted: bool | None = None
        if tail.whole and tail.data_crc:
            trusted = checksum(file, tail.data_end) == tail.data_crc
            if not trusted:
                yield Problem(str(path), "is damaged: the checksum over its data fails", _MEND)
        if tail.damaged:
            yield Problem(str(path), f"is damaged: {tail.damaged}", _MEND)
        file.seek(0)
        if file.read(8) != MAGIC:
            raise UnusableInputError(path, "does not begin as MCAP does", "fetch the file again")
        yield from _Walk(path, file, size, tail, trusted).blocks()


_MEND = "fetch the file again; the rest is used as it is"


class _Walk:
    """One pass over a file."""

    def __init__(self, path: Path, file: BinaryIO, size: int, tail: Tail, trusted: bool | None) -> None:
        self.path, self.file, self.tail, self.trusted = path, file, tail, trusted
        self.end = tail.data_end if tail.whole else size
        self.budget = MOST_RATIO * size + MOST_FREE
        self.at = 8

    def blocks(self) -> Iterator[Piece]:
        """Whole records from window to window; what does not fit a window is read by itself."""
        while self.at < self.end:
            self.file.seek(self.at)
            window = np.frombuffer(self.file.read(min(WINDOW, self.end - self.at)), dtype=np.uint8)
            records, used = hops(window, 0)
            ended = yield from self._records(window, records)
            if ended:
                return
            self.at += used
            if not used:
                yield from self._long(window)
        if not self.tail.whole and not self.tail.damaged:
            yield self._problem("is cut short: it ends without a footer")

    def _records(self, window: Bytes, records: Hops) -> Generator[Piece, None, bool]:
        loose = 0  # start of a run of records that stand outside any chunk
        for opcode, start, size in zip(
            records.opcodes.tolist(), records.starts.tolist(), records.sizes.tolist(), strict=True
        ):
            if opcode in _LOOSE:
                continue
            yield from self._loose(window[loose : start - 9])
            loose = start + size
            if opcode == Opcode.CHUNK:
                yield from self._chunk(window[start : start + size].tobytes())
            elif opcode == Opcode.DATA_END and not (self.tail.whole and self.at + loose < self.end):
                if not self.tail.whole and not self.tail.damaged:
                    yield self._problem("is cut short: it ends without a footer")
                return True
            elif opcode == Opcode.METADATA:
                yield from _metadata(window[start : start + size].tobytes())
            elif opcode not in _SKIPPED and opcode < 0x80:
                yield self._problem(f"holds a record of unknown kind {opcode}")
        yield from self._loose(
            window[loose : int(records.starts[-1] + records.sizes[-1]) if len(records.starts) else 0]
        )
        return False

    def _long(self, window: Bytes) -> Iterator[Piece]:
        """The record at hand, which is longer than the window or than the file."""
        opcode, size = (int(window[0]), int.from_bytes(window[1:9].tobytes(), "little")) if len(window) >= 9 else (0, 0)
        whole = len(window) >= 9 and size <= self.end - self.at - 9
        body = b""
        if opcode in (*_LOOSE, Opcode.CHUNK) and (size <= MOST_CHUNK or not whole):
            self.file.seek(self.at + 9)
            body = self.file.read(min(size, MOST_CHUNK, self.end - self.at - 9))
        if not whole:
            yield from self._broken(opcode, body)
            return
        self.at += 9 + size
        if opcode == Opcode.CHUNK and body:
            yield from self._chunk(body)
        elif opcode in _LOOSE and body:
            yield from self._loose(np.frombuffer(window[:9].tobytes() + body, dtype=np.uint8))
        elif opcode in (*_LOOSE, Opcode.CHUNK):
            yield self._problem(f"holds a record of {size} bytes; {MOST_CHUNK} at most are read")
        elif opcode not in (*_SKIPPED, Opcode.METADATA) and opcode < 0x80:
            yield self._problem(f"holds a record of unknown kind {opcode}")

    def _broken(self, opcode: int, body: bytes) -> Iterator[Piece]:
        """A record that claims more bytes than there are: the file was cut here, or its length is wrong."""
        if self.tail.whole:
            following = [start for start in self.tail.chunk_starts if start > self.at]
            yield self._problem(f"has a record at byte {self.at} that claims more bytes than there are")
            self.at = following[0] if following else self.end
            return
        if opcode == Opcode.CHUNK:
            yield from self._chunk(body, cut=True)
        self.at = self.end

    def _loose(self, data: Bytes) -> Iterator[Block]:
        if len(data) and self.trusted is not False:
            yield Block(data, self.trusted is True)

    def _chunk(self, body: bytes, cut: bool = False) -> Iterator[Piece]:
        cursor = Cursor(body)
        try:
            cursor.take(16)
            size, crc, compression = cursor.number(8), cursor.number(4), cursor.text()
            packed = cursor.number(8)
            if packed != len(body) - cursor.at and not cut:
                raise ValueError(f"its records should take {packed} bytes, not {len(body) - cursor.at}")
            if size > MOST_CHUNK or size > self.budget:
                raise ValueError(f"it would unpack to {size} bytes, more than a recorder writes")
            self.budget -= size
            data = unpack(compression, body[cursor.at :], size, cut)
            if not cut and crc and zlib.crc32(data) != crc:
                raise ValueError("its checksum fails")
        except ValueError as error:
            if not cut:
                yield self._problem(f"has a damaged chunk, which was left out: {error}")
            return
        if crc or self.trusted is not False:
            yield Block(np.frombuffer(data, dtype=np.uint8), bool(crc and not cut) or self.trusted is True, cut)

    def _problem(self, what: str) -> Problem:
        return Problem(str(self.path), what if what.startswith(("is ", "does ")) else f"is damaged: it {what}", _MEND)


def _metadata(body: bytes) -> Iterator[Note]:
    cursor = Cursor(body)
    try:
        name, left = cursor.text(), Cursor(cursor.take(cursor.number(4)))
        entries = {}
        while left.at < len(left.body):
            key = left.text()
            entries[key] = left.text()
        yield Note(name, entries)
    except ValueError:
        return  # notes say nothing of the data


def hops(data: Bytes, at: int) -> tuple[Hops, int]:
    """Whole records of a buffer from `at` on, a bounded number of them, and where the next one starts.

    Parameters
    ----------
    data : (n,) array of uint8
    at : int
    """
    most = min(MOST_HOPS, max((len(data) - at) // 9, 1))
    opcodes, starts, sizes = np.empty(most, np.uint8), np.empty(most, np.int64), np.empty(most, np.int64)
    count, following, _ = hop(data, at, opcodes, starts, sizes)
    return Hops(opcodes[:count], starts[:count], sizes[:count]), following
