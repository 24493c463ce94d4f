"""MCAP: ROS 2 CDR, Protobuf and JSON messages with the schemas that the file carries."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode

from gsfdi.mapping import Mapping
from gsfdi.readers import Reader
from gsfdi.types import UNNAMED, Problem
from gsfdi.wire import Item, Stamps, cdr, proto
from gsfdi.wire.jsons import Json
from gsfdi.wire.kernels import Bytes, Ints, fields
from gsfdi.wire.layout import Binary
from gsfdi.wire.leaves import UndecodableError
from gsfdi.wire.records import Block, Note, hops, walk
from gsfdi.wire.rows import Messages
from gsfdi.wire.tail import MAGIC, Cursor, Tail, read_tail
from gsfdi.wire.topic import Topic

MOST_TOPICS = 4_096
_STATE_TOPICS = ("joint_states", "joint_state", "dynamic_joint_states")


@dataclass(frozen=True, slots=True)
class Schema:
    """A schema record."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel record; `schema` is None for one that has none, or whose schema the file lacks."""

    topic: str
    encoding: str
    schema: Schema | None


@dataclass(slots=True)
class Contents:
    """What a file was found to hold so far, and the topics that its index states beforehand."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    counts: Counter[int] = field(default_factory=Counter)
    conflicts: list[str] = field(default_factory=list)
    robot: str = ""
    tail: Tail = field(default_factory=Tail)
    stated: frozenset[str] = frozenset()
    bare: int = 0
    blocks: int = 0
    unverified: int = 0


def sniff(head: bytes) -> bool:
    """Whether these are the first bytes of an MCAP file."""
    return head[:8] == MAGIC


def read(path: Path, mappings: Sequence[Mapping], whole: bool | None) -> Iterator[Item]:
    """Yield the joint telemetry block by block, and what is wrong with the file.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    whole : bool or None
        Whether the file's seal holds; this format has none.
    """
    contents = _opened(path)
    readers: dict[int, Topic | None] = {}
    problems: dict[str, Problem] = {}
    for item in walk(path):
        if isinstance(item, Problem):
            problems[item.what] = item
            continue
        if isinstance(item, Note):
            contents.robot = item.entries.get("robot", "") if item.name == "gsfdi" else contents.robot
            continue
        for channel, messages in _messages(item, contents):
            if channel not in readers:
                readers[channel] = _topic(contents, channel, mappings)
            topic = readers[channel]
            if topic is not None and not topic.given_up:
                yield from topic.columns(messages)
    yield from problems.values()
    yield from _remarks(path, contents, mappings, whole=not problems)


def describe(path: Path, mappings: Sequence[Mapping]) -> dict[str, object]:
    """Say what the file holds and how it would be read.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    """
    contents = _opened(path)
    readers: dict[int, Topic | None] = {}
    found: dict[int, set[tuple[str, str, str]]] = {}
    problems: dict[str, None] = {}
    span: list[int] = []
    for item in walk(path):
        if isinstance(item, Problem):
            problems[item.what] = None
            continue
        if isinstance(item, Note):
            continue
        for channel, messages in _messages(item, contents):
            span = [*span[:1], int(messages.log_ns.min()), int(messages.log_ns.max()), *span[1:]]
            span = [min(span), max(span)]
            if channel not in readers:
                readers[channel] = _topic(contents, channel, mappings)
            topic = readers[channel]
            if topic is not None and not found.get(channel):
                few = Messages(messages.data, *(part[:64] for part in messages[1:]))
                found[channel] = {key[:3] for columns in topic.columns(few) for key in columns.values}
    topics = [
        {
            "topic": channel.topic,
            "encoding": channel.encoding,
            "schema": channel.schema.name if channel.schema else None,
            "messages": contents.counts[number],
            "read_as": [f"{robot}/{joint} {name}" for robot, joint, name in sorted(found.get(number, ()))],
        }
        for number, channel in sorted(contents.channels.items())
    ]
    return {
        "format": "mcap",
        "integrity": _integrity(contents),
        "topics": topics,
        "log_time_ns": span,
        "problems": list(problems),
        "joint_telemetry": _told(any(topic["read_as"] for topic in topics)),
    }


def _told(found: bool) -> str:
    return "yes" if found else "none: no topic is of a shape that gsfdi knows, or that a mapping names"


def message_counts(path: Path) -> Counter[str]:
    """Count the messages of each topic that can be walked to.

    Parameters
    ----------
    path : Path
    """
    contents = Contents()
    for item in walk(path):
        if isinstance(item, Block):
            for _ in _messages(item, contents):
                pass
    counts: Counter[str] = Counter()
    for number, count in contents.counts.items():
        counts[contents.channels[number].topic] += count
    return counts


def _opened(path: Path) -> Contents:
    with path.open("rb") as file:
        tail = read_tail(file, path.stat().st_size)
    index = Contents()
    for opcode, body in tail.definitions:
        _note(opcode, body, index)
    return Contents(tail=tail, stated=frozenset(channel.topic for channel in index.channels.values()))


def _messages(block: Block, contents: Contents) -> Iterator[tuple[int, Messages]]:
    """Messages of a block by channel; schemas and channels are noted as they come."""
    contents.blocks += 1
    contents.unverified += not block.verified
    at = 0
    while at < len(block.data):
        records, following = hops(block.data, at)
        if following == at:
            contents.bare += not block.cut
            return
        at = following
        for i in np.flatnonzero((records.opcodes == Opcode.SCHEMA) | (records.opcodes == Opcode.CHANNEL)).tolist():
            start, size = int(records.starts[i]), int(records.sizes[i])
            _note(int(records.opcodes[i]), block.data[start : start + min(size, 1 << 24)].tobytes(), contents)
        chosen = (records.opcodes == Opcode.MESSAGE) & (records.sizes >= 22)
        contents.bare += int(np.sum((records.opcodes == Opcode.MESSAGE) & ~chosen))
        starts, sizes = records.starts[chosen], records.sizes[chosen]
        numbers = fields(block.data, starts, 0, 2).view("<u2")[:, 0]
        for number in np.unique(numbers).tolist():
            own = numbers == number
            if number not in contents.channels:
                contents.bare += int(own.sum())
                continue
            contents.counts[number] += int(own.sum())
            yield number, _of_channel(block.data, starts[own], sizes[own])


def _of_channel(data: Bytes, starts: Ints, sizes: Ints) -> Messages:
    log_ns: Stamps = fields(data, starts, 6, 8).view("<i8")[:, 0]
    published_ns: Stamps = fields(data, starts, 14, 8).view("<i8")[:, 0]
    return Messages(data, starts + 22, sizes - 22, log_ns, published_ns)


def _note(opcode: int, body: bytes, contents: Contents) -> None:
    cursor = Cursor(body)
    try:
        number = cursor.number(2)
        if opcode == Opcode.SCHEMA:
            schema = Schema(cursor.text(), cursor.text(), cursor.take(cursor.number(4)))
            if contents.schemas.setdefault(number, schema) != schema:
                contents.conflicts.append(f"schema {number} is defined twice, differently")
            return
        schema_number = cursor.number(2)
        channel = Channel(cursor.text(), cursor.text(), contents.schemas.get(schema_number))
        if len(contents.channels) >= MOST_TOPICS:
            contents.conflicts.append(f"more than {MOST_TOPICS} channels")
        elif contents.channels.setdefault(number, channel) != channel:
            contents.conflicts.append(f"channel {number} is defined twice, differently")
    except ValueError as error:
        contents.conflicts.append(f"a definition is damaged: {error}")


def _topic(contents: Contents, number: int, mappings: Sequence[Mapping]) -> Topic | None:
    """The reader of a channel's messages; None if they are not read."""
    channel = contents.channels[number]
    own = [mapping for mapping in mappings if channel.topic in mapping.topics()]
    known = contents.stated | {each.topic for each in contents.channels.values()}
    if not own and any(mapping.topics() & known for mapping in mappings):
        return None  # a mapping that fits the file says all that is wanted of it
    robot = contents.robot or robot_of(channel.topic)
    schema = channel.schema
    try:
        if channel.encoding == "json":
            return Topic(channel.topic, robot, Json(), own)
        if schema is not None and channel.encoding == "cdr" and schema.encoding in ("ros2msg", "ros2idl"):
            types = cdr.schema_types(schema.name, schema.encoding, schema.data.decode("utf-8", "replace"))
            return Topic(channel.topic, robot, Binary(cdr.decoder(types)), own)
        if schema is not None and channel.encoding == "protobuf" and schema.encoding == "protobuf":
            form = Binary(proto.decoder(proto.schema_types(schema.name, schema.data)))
            return Topic(channel.topic, robot, form, own)
    except UndecodableError as error:
        if own:
            contents.conflicts.append(f"topic {channel.topic} cannot be read: {error}")
    return None


def robot_of(topic: str) -> str:
    """Whose joints a topic speaks of, by its namespace.

    Parameters
    ----------
    topic : str

    Examples
    --------
    >>> robot_of("/left/joint_states"), robot_of("/joint_states"), robot_of("/arm/trajectory_controller/state")
    ('left', 'robot', 'arm')
    """
    parts = [part for part in topic.split("/") if part]
    if not parts:
        return UNNAMED
    if parts[-1] in ("state", "controller_state"):
        parts = parts[:-2]
    elif parts[-1] in _STATE_TOPICS:
        parts = parts[:-1]
    return ".".join(parts) or UNNAMED


def _integrity(contents: Contents) -> str:
    if not contents.blocks:
        return "nothing to verify"
    if not contents.unverified:
        return "verified by checksums"
    if contents.unverified == contents.blocks:
        return "unverified: the recorder wrote no checksums"
    return f"unverified in {contents.unverified} of {contents.blocks} parts, which carry no checksum"


def _remarks(path: Path, contents: Contents, mappings: Sequence[Mapping], whole: bool) -> Iterator[Problem]:
    tail = contents.tail
    for opcode, body in tail.definitions:
        _note(opcode, body, contents)
    if whole and tail.messages not in (None, contents.counts.total()):
        what = f"is damaged: its index speaks of {tail.messages} messages, {contents.counts.total()} are there"
        yield Problem(str(path), what, "fetch the file again")
    for what in dict.fromkeys(contents.conflicts[:5]):
        yield Problem(str(path), f"is damaged: {what}", "fetch the file again")
    if contents.bare:
        yield Problem(str(path), f"is damaged: {contents.bare} records fit no channel or no length", "fetch it again")
    if contents.unverified:
        yield Problem(str(path), f"integrity {_integrity(contents)}", "let the recorder write chunk CRCs", "note")
    topics = {channel.topic for channel in contents.channels.values()}
    named = {topic for mapping in mappings for topic in mapping.topics()}
    if named and not named & topics:
        what = f"has none of the topics that the mappings name ({', '.join(sorted(named))}); read by its own schemas"
        yield Problem(str(path), what, f"its topics: {', '.join(sorted(topics)[:12])}", "note")
    for mapping in mappings:
        absent = sorted(mapping.topics() - topics)
        if absent and mapping.topics() & topics:
            what = f"has no topic {', '.join(absent)}, which {mapping.path} names"
            yield Problem(str(path), what, "correct the mapping", "left_out")


READER = Reader("mcap", sniff, read, describe)
