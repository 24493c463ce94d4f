"""What the end of an MCAP file says about the rest: checksums, where chunks start, how many messages there are."""

import struct
import zlib
from dataclasses import dataclass
from typing import BinaryIO

from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
MOST_SUMMARY = 16 << 20
"""Longest index that is read."""


@dataclass(frozen=True, slots=True)
class Tail:
    """What the end of the file says about the rest."""

    whole: bool = False
    data_crc: int = 0
    data_end: int = 0
    chunk_starts: tuple[int, ...] = ()
    messages: int | None = None
    definitions: tuple[tuple[int, bytes], ...] = ()
    damaged: str = ""


class Cursor:
    """Reads a record's body and never past its end."""

    def __init__(self, body: bytes) -> None:
        self.body, self.at = body, 0

    def take(self, size: int) -> bytes:
        """The next `size` bytes; ValueError where there are fewer."""
        if size > len(self.body) - self.at:
            raise ValueError(f"{size} bytes wanted, {len(self.body) - self.at} left")
        self.at += size
        return self.body[self.at - size : self.at]

    def number(self, size: int) -> int:
        """An unsigned little-endian number."""
        return int.from_bytes(self.take(size), "little")

    def text(self) -> str:
        """A string after its length."""
        return self.take(self.number(4)).decode("utf-8", "replace")


def read_tail(file: BinaryIO, size: int) -> Tail:
    """Read the footer, and through it the summary, as far as they can be believed.

    Parameters
    ----------
    file : binary file
    size : int
        Its length [bytes].
    """
    footer = 9 + 20 + 8
    if size < 8 + footer:
        return Tail()
    file.seek(size - footer)
    end = file.read(footer)
    if end[-8:] != MAGIC or end[:9] != struct.pack("<BQ", Opcode.FOOTER, 20):
        return Tail()
    start, _, crc = struct.unpack("<QQI", end[9:29])
    if start == 0:
        file.seek(size - footer - 13)
        data_end = _data_end(file.read(13))
        damaged = "" if crc in (0, zlib.crc32(end[:25])) else "the checksum over its end fails"
        return Tail(True, data_end or 0, size - footer - 13, damaged=damaged)
    if not 21 <= start <= size - footer or size - footer - start > MOST_SUMMARY:
        return Tail(damaged="its footer points nowhere")
    file.seek(start)
    summary = file.read(size - footer - start)
    if crc and zlib.crc32(end[:25], zlib.crc32(summary)) != crc:
        return Tail(damaged="the checksum over its index fails; its data were read without it")
    file.seek(start - 13)
    data_end = _data_end(file.read(13))
    if data_end is None:
        return Tail(damaged="its data section does not end where its footer says")
    return _summary(summary, data_end, start - 13)


def _summary(summary: bytes, data_crc: int, data_end: int) -> Tail:
    """What the index says: where chunks start, how many messages there are, schemas and channels once more."""
    starts: list[int] = []
    definitions: list[tuple[int, bytes]] = []
    messages = None
    at = 0
    while at + 9 <= len(summary):
        opcode, size = struct.unpack_from("<BQ", summary, at)
        body = summary[at + 9 : at + 9 + size]
        if opcode == Opcode.CHUNK_INDEX and len(body) >= 24:
            starts.append(struct.unpack_from("<Q", body, 16)[0])
        elif opcode == Opcode.STATISTICS and len(body) >= 8:
            messages = struct.unpack_from("<Q", body)[0]
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            definitions.append((opcode, body))
        at += 9 + size
    return Tail(True, data_crc, data_end, tuple(sorted(starts)), messages, tuple(definitions))


def _data_end(record: bytes) -> int | None:
    """The data section's checksum, from the record that ends it."""
    if len(record) != 13 or record[:9] != struct.pack("<BQ", Opcode.DATA_END, 4):
        return None
    return int(struct.unpack_from("<I", record, 9)[0])


def checksum(file: BinaryIO, end: int) -> int:
    """CRC-32 of a file's first bytes, up to `end`."""
    file.seek(0)
    crc, left = 0, end
    while left > 0:
        block = file.read(min(left, 1 << 22))
        crc = zlib.crc32(block, crc)
        left -= len(block)
    return crc
