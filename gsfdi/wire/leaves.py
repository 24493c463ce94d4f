"""A message taken apart: every number and string in it, its path, and where its bytes stand."""

import re
from typing import Literal, NamedTuple

Kind = Literal["f8", "f4", "i8", "i4", "i2", "i1", "u8", "u4", "u2", "u1", "varint", "zigzag", "zero", "text"]


class Leaf(NamedTuple):
    """One primitive value of a message.

    `offset` and `size` are its bytes within the message; a field that the encoding leaves out because it is zero has
    none. `text` is what a string says.
    """

    path: str
    kind: Kind
    offset: int
    size: int
    text: str = ""


class Anatomy(NamedTuple):
    """A message's leaves, and which of its bits are structure: bits that any message of the same layout shares."""

    leaves: list[Leaf]
    mask: bytearray
    big_endian: bool = False


class UndecodableError(ValueError):
    """The bytes are no message of the schema."""


_INDEX = re.compile(r"\[(\d+)\]")


def pattern(path: str) -> tuple[str, tuple[int, ...]]:
    """A path with its indices taken out, and the indices.

    Examples
    --------
    >>> pattern("joints[3].axes[0]")
    ('joints[].axes[]', (3, 0))
    """
    return _INDEX.sub("[]", path), tuple(int(index) for index in _INDEX.findall(path))
