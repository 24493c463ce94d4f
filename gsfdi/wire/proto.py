"""Protobuf: messages taken apart by the descriptors that their file carries.

A field that proto3 leaves out because it is zero is a leaf without bytes; the bytes of numbers are free to change from
message to message while tags, lengths and the continuation bits of varints are structure.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from google.protobuf import descriptor_pb2
from google.protobuf.message import DecodeError

from gsfdi.wire.leaves import Anatomy, Kind, Leaf, UndecodableError

_Proto = descriptor_pb2.FieldDescriptorProto
_KINDS: dict[int, tuple[Kind, int]] = {
    _Proto.TYPE_DOUBLE: ("f8", 1),
    _Proto.TYPE_FLOAT: ("f4", 5),
    _Proto.TYPE_INT64: ("varint", 0),
    _Proto.TYPE_UINT64: ("varint", 0),
    _Proto.TYPE_INT32: ("varint", 0),
    _Proto.TYPE_UINT32: ("varint", 0),
    _Proto.TYPE_BOOL: ("varint", 0),
    _Proto.TYPE_ENUM: ("varint", 0),
    _Proto.TYPE_SINT32: ("zigzag", 0),
    _Proto.TYPE_SINT64: ("zigzag", 0),
    _Proto.TYPE_FIXED64: ("u8", 1),
    _Proto.TYPE_SFIXED64: ("i8", 1),
    _Proto.TYPE_FIXED32: ("u4", 5),
    _Proto.TYPE_SFIXED32: ("i4", 5),
}
"""Type of a field -> kind of its leaf, wire type."""
_SIZES = {1: 8, 5: 4}
MOST_LEAVES = 65_536
MOST_DEPTH = 16


class Field(NamedTuple):
    """A field of a message type; `inner` names the type of a sub-message."""

    name: str
    kind: Kind | None
    wire: int
    repeated: bool
    implicit: bool
    inner: str = ""


Types = Mapping[str, Mapping[int, Field]]


def schema_types(name: str, data: bytes) -> Types:
    """Parse the descriptors of a channel.

    Parameters
    ----------
    name : str
        The message's full name.
    data : bytes
        A serialised ``FileDescriptorSet``.

    Returns
    -------
    mapping of str to mapping of int to Field
        By full name; the message's own fields under ``""``.

    Raises
    ------
    UndecodableError
        The bytes are no descriptors, or do not define the message.
    """
    files = descriptor_pb2.FileDescriptorSet()
    try:
        files.ParseFromString(data)
    except DecodeError as error:
        raise UndecodableError("its schema is no set of descriptors") from error
    types: dict[str, dict[int, Field]] = {}
    for file in files.file:
        for message in file.message_type:
            _collect(types, f".{_text(file.package)}" if file.package else "", message, file.syntax == "proto3", 0)
    if f".{name}" not in types:
        raise UndecodableError(f"its schema does not define {name}")
    types[""] = types[f".{name}"]
    return types


def _collect(
    types: dict[str, dict[int, Field]], prefix: str, message: descriptor_pb2.DescriptorProto, proto3: bool, depth: int
) -> None:
    full = f"{prefix}.{_text(message.name)}"
    types[full] = {field.number: _field(field, proto3) for field in message.field}
    if depth < MOST_DEPTH:
        for nested in message.nested_type:
            _collect(types, full, nested, proto3, depth + 1)


def _field(field: descriptor_pb2.FieldDescriptorProto, proto3: bool) -> Field:
    repeated = field.label == _Proto.LABEL_REPEATED
    implicit = proto3 and not repeated and not field.proto3_optional and not field.HasField("oneof_index")
    if field.type in _KINDS:
        kind, wire = _KINDS[field.type]
        return Field(_text(field.name), kind, wire, repeated, implicit)
    if field.type == _Proto.TYPE_MESSAGE:
        return Field(_text(field.name), None, 2, repeated, False, _text(field.type_name))
    return Field(_text(field.name), "text" if field.type == _Proto.TYPE_STRING else None, 2, repeated, implicit)


def _text(name: str | bytes) -> str:
    """A name of a damaged descriptor is bytes where it is no UTF-8."""
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else name


def decoder(types: Types) -> Callable[[bytes], Anatomy]:
    """Make the function that takes messages of a schema apart.

    Parameters
    ----------
    types : mapping
        From `schema_types`.
    """

    def take_apart(data: bytes) -> Anatomy:
        message = _Message(types, data)
        message.read("", "", 0, len(data), 0)
        return Anatomy(message.leaves, message.mask)

    return take_apart


class _Message:
    """One message being taken apart."""

    def __init__(self, types: Types, data: bytes) -> None:
        self.types, self.data = types, data
        self.mask = bytearray(b"\xff" * len(data))
        self.leaves: list[Leaf] = []

    def read(self, type_name: str, path: str, at: int, end: int, depth: int) -> None:
        """Take the fields between two offsets apart."""
        if type_name not in self.types or depth > MOST_DEPTH:
            raise UndecodableError(f"its schema does not define {type_name}")
        known = self.types[type_name]
        counts: dict[int, int] = {}
        while at < end:
            tag, at = self._varint(at, end)
            number, wire = tag >> 3, tag & 7
            field = known.get(number)
            if field is None or number == 0:
                at = self._skip(wire, at, end) if number else end + 1
                continue
            here = f"{path}.{field.name}" if path else field.name
            index = counts.get(number, 0)
            counts[number] = index + 1
            if field.repeated:
                here = f"{here}[{index}]"
            if len(self.leaves) > MOST_LEAVES:
                raise UndecodableError("it has too many values")
            if wire == 2:
                length, at = self._varint(at, end)
                if length > end - at:
                    raise UndecodableError(f"{here} wants {length} bytes, {end - at} are left")
                counts[number] = index + self._delimited(field, here, index, at, at + length, depth)
                at += length
            elif wire == field.wire and field.kind:
                at = self._number(field.kind, here, wire, at, end)
            else:
                raise UndecodableError(f"{here} is encoded as type {wire}")
        if at != end:
            raise UndecodableError("a field runs past its message")
        for number, field in known.items():
            if field.implicit and number not in counts and (field.kind or field.inner):
                kind: Kind = "text" if field.kind == "text" else "zero"
                self.leaves.append(Leaf(f"{path}.{field.name}" if path else field.name, kind, 0, 0))

    def _delimited(self, field: Field, here: str, index: int, at: int, end: int, depth: int) -> int:
        """A sub-message, a string or packed numbers; says how many elements it was."""
        if field.inner:
            self.read(field.inner, here, at, end, depth + 1)
        elif field.kind == "text":
            text = self.data[at:end].decode("utf-8", "replace")
            self.mask[at:end] = bytes(end - at)
            self.leaves.append(Leaf(here, "text", at, end - at, text))
        elif field.kind is None:  # bytes
            self.mask[at:end] = bytes(end - at)
        elif not field.repeated:
            raise UndecodableError(f"{here} is encoded as a string")
        else:
            base, count = here.rsplit("[", 1)[0], 0
            if end - at > MOST_LEAVES * 8:
                raise UndecodableError(f"{here} has too many values")
            while at < end:
                at = self._number(field.kind, f"{base}[{index + count}]", field.wire, at, end)
                count += 1
            return count
        return 1

    def _number(self, kind: Kind, here: str, wire: int, at: int, end: int) -> int:
        start = at
        if wire == 0:
            _, at = self._varint(at, end)
            self.mask[start:at] = b"\x80" * (at - start)
        else:
            at += _SIZES[wire]
            if at > end:
                raise UndecodableError(f"{here} wants {_SIZES[wire]} bytes, {end - start} are left")
            self.mask[start:at] = bytes(at - start)
        self.leaves.append(Leaf(here, kind, start, at - start))
        return at

    def _varint(self, at: int, end: int) -> tuple[int, int]:
        value = shift = 0
        while at < end and shift < 70:
            byte = self.data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value, at
            shift += 7
        raise UndecodableError("a number runs past its message")

    def _skip(self, wire: int, at: int, end: int) -> int:
        """Pass over a field that the schema does not know; its bytes may be anything, its length may not."""
        if wire == 0:
            start = at
            _, at = self._varint(at, end)
            self.mask[start:at] = b"\x80" * (at - start)
            return at
        if wire == 2:
            length, at = self._varint(at, end)
        elif wire in _SIZES:
            length = _SIZES[wire]
        else:
            raise UndecodableError(f"a field is encoded as type {wire}")
        if length > end - at:
            raise UndecodableError("a field runs past its message")
        self.mask[at : at + length] = bytes(length)
        return at + length
