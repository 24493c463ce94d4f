"""ROS 2's CDR: messages taken apart by the schema that their file carries, ros2msg or ros2idl.

A message is an encapsulation header of four bytes, then the fields in order, each aligned to its own size as counted
from the end of that header (to four at most in XCDR2). Padding may hold anything; recorders leave rubbish there.
"""

import re
import struct
from collections.abc import Callable, Mapping
from typing import NamedTuple

from gsfdi.wire.idl import idl_types
from gsfdi.wire.leaves import Anatomy, Kind, Leaf, UndecodableError

PRIMITIVES: dict[str, tuple[Kind, int]] = {
    "bool": ("u1", 1),
    "byte": ("u1", 1),
    "char": ("u1", 1),
    "float32": ("f4", 4),
    "float64": ("f8", 8),
    "int8": ("i1", 1),
    "uint8": ("u1", 1),
    "int16": ("i2", 2),
    "uint16": ("u2", 2),
    "int32": ("i4", 4),
    "uint32": ("u4", 4),
    "int64": ("i8", 8),
    "uint64": ("u8", 8),
}
_SINGLE_BYTES = {name for name, (_, size) in PRIMITIVES.items() if size == 1}
MOST_LEAVES = 65_536
MOST_DEPTH = 16
MOST_SMALL = 64


class Field(NamedTuple):
    """A field of a struct: its type and, for an array, its length (0 for one whose length the message gives)."""

    name: str
    type: str
    length: int | None = None


Types = Mapping[str, tuple[Field, ...]]


def schema_types(name: str, encoding: str, text: str) -> Types:
    """Parse the schema of a channel.

    Parameters
    ----------
    name : str
        The message's type, ``sensor_msgs/msg/JointState``.
    encoding : str
        ``ros2msg`` or ``ros2idl``.
    text : str
        The schema's text.

    Returns
    -------
    mapping of str to tuple of Field
        By ``package/Name``; the message's own fields under ``""``.

    Raises
    ------
    UndecodableError
        The text is no such schema.
    """
    types: dict[str, tuple[Field, ...]] = {"builtin_interfaces/Time": _TIME, "builtin_interfaces/Duration": _TIME}
    if encoding == "ros2idl":
        types |= {key: tuple(Field(*each) for each in fields) for key, fields in idl_types(text).items()}
    else:
        types |= _msg_types(short(name), text)
    if short(name) not in types:
        raise UndecodableError(f"its schema does not define {name}")
    types[""] = types[short(name)]
    return types


_TIME = (Field("sec", "int32"), Field("nanosec", "uint32"))


def short(name: str) -> str:
    """``package/Name`` of a type's name, however many parts stand between.

    Examples
    --------
    >>> short("sensor_msgs/msg/JointState")
    'sensor_msgs/JointState'
    """
    parts = name.replace("::", "/").split("/")
    return f"{parts[0]}/{parts[-1]}" if len(parts) > 1 else name


_LINE = re.compile(r"^([A-Za-z][\w/]*)(<=\d+)?(\[(<=)?(\d*)\])?\s+([A-Za-z]\w*)(?!\w)\s*(.*)$")


def _msg_types(name: str, text: str) -> dict[str, tuple[Field, ...]]:
    types: dict[str, tuple[Field, ...]] = {}
    for part in re.split(r"^=+\s*$", text, flags=re.MULTILINE):
        lines = part.strip().splitlines()
        if lines and lines[0].startswith("MSG:"):
            name = short(lines[0][4:].strip())
            lines = lines[1:]
        package = name.split("/")[0]
        types[name] = tuple(field for line in lines if (field := _msg_field(line, package)))
    return types


def _msg_field(line: str, package: str) -> Field | None:
    """One line of a .msg file; None for a comment or a constant."""
    line = line.split("#", 1)[0].strip()
    if not line:
        return None
    found = _LINE.match(line)
    if not found or found.group(7)[:1] in ("!", "{", "(", ";"):
        raise UndecodableError(f"its schema has the line {line[:60]!r}")
    kind, _, array, bounded, length, name, rest = found.groups()
    if rest.startswith("="):
        return None
    if kind == "Header":
        kind = "std_msgs/Header"
    elif kind not in PRIMITIVES and kind not in ("string", "wstring"):
        kind = short(kind) if "/" in kind else f"{package}/{kind}"
    return Field(name, kind, None if array is None else 0 if bounded or not length else int(length))


def decoder(types: Types) -> Callable[[bytes], Anatomy]:
    """Make the function that takes messages of a schema apart.

    Parameters
    ----------
    types : mapping of str to tuple of Field
        From `schema_types`.
    """
    return lambda data: _Message(types, data).anatomy()


class _Message:
    """One message being taken apart."""

    def __init__(self, types: Types, data: bytes) -> None:
        if data[:2] not in (b"\0\0", b"\0\1", b"\0\6", b"\0\7") or len(data) < 4:
            raise UndecodableError(f"its first bytes {data[:4].hex()} announce no plain CDR")
        self.types, self.data, self.at = types, data, 4
        self.big = data[1] in (0, 6)
        self.widest = 4 if data[1] in (6, 7) else 8
        self.mask = bytearray(len(data))
        self.mask[0:2] = b"\xff\xff"
        self.leaves: list[Leaf] = []
        self.slack = 7  # serialisers reserve room for alignment that an empty array then does not need

    def anatomy(self) -> Anatomy:
        self._struct("", "", 0)
        if len(self.data) - self.at > self.slack:
            raise UndecodableError(f"{len(self.data) - self.at} bytes are left over")
        return Anatomy(self.leaves, self.mask, self.big)

    def _struct(self, type_name: str, path: str, depth: int) -> None:
        if type_name not in self.types or depth > MOST_DEPTH:
            raise UndecodableError(f"its schema does not define {type_name}")
        fields = self.types[type_name]
        if not fields:
            self.at += 1  # an empty struct holds one byte
        for field in fields:
            here = f"{path}.{field.name}" if path else field.name
            if field.length is None:
                self._one(field.type, here, depth)
                continue
            length = field.length or self._length()
            self.slack += 7 * (length == 0)
            if field.type in _SINGLE_BYTES and length > MOST_SMALL:  # a picture or a blob, no joints
                self._room(length, here)
                self.at += length
                continue
            if len(self.leaves) + length > MOST_LEAVES:
                raise UndecodableError(f"{here} has {length} elements")
            for i in range(length):
                self._one(field.type, f"{here}[{i}]", depth)

    def _one(self, type_name: str, path: str, depth: int) -> None:
        if type_name in PRIMITIVES:
            kind, size = PRIMITIVES[type_name]
            self._align(min(size, self.widest))
            self._room(size, path)
            self.leaves.append(Leaf(path, kind, self.at, size))
            self.at += size
        elif type_name == "string":
            size = self._length()
            self._room(size, path)
            text = self.data[self.at : self.at + size]
            if size and text[-1]:
                raise UndecodableError(f"the string {path} does not end in a zero")
            if size:
                self.mask[self.at + size - 1] = 0xFF
            self.leaves.append(Leaf(path, "text", self.at, max(size - 1, 0), text[:-1].decode("utf-8", "replace")))
            self.at += size
        elif type_name == "wstring":
            raise UndecodableError(f"{path} is a wstring, which is not read")
        else:
            self._struct(type_name, path, depth + 1)

    def _length(self) -> int:
        self._align(4)
        self._room(4, "a length")
        self.mask[self.at : self.at + 4] = b"\xff\xff\xff\xff"
        length: int = struct.unpack_from(">I" if self.big else "<I", self.data, self.at)[0]
        self.at += 4
        return length

    def _align(self, size: int) -> None:
        self.at += -(self.at - 4) % size

    def _room(self, size: int, path: str) -> None:
        if size > len(self.data) - self.at:
            raise UndecodableError(f"{path} wants {size} bytes, {max(len(self.data) - self.at, 0)} are left")
