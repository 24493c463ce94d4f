"""Messages of one topic to columns: take one apart, then read all that share its layout at once.

Every structural bit of every message is compared with the one that was taken apart; a message that differs becomes the
next one to be taken apart, so odd messages cost time but are never read by the wrong layout.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from gsfdi.mapping import Mapping
from gsfdi.types import Array, Mask
from gsfdi.wire import Columns, Key, Stamps
from gsfdi.wire.kernels import Bytes, Ints, doubles, fields, matching
from gsfdi.wire.leaves import Anatomy, Leaf, UndecodableError
from gsfdi.wire.select import Choice, Clock, Pick, choose

MOST_KEPT = 256
"""Layouts remembered for a topic."""
MOST_BARREN = 32
"""A topic whose first layouts hold no telemetry, this many of them, is given up."""
MOST_MESSAGE = 1 << 20
LONELY = 8
"""After so many layouts of a block that fitted one message only, the others of a size are taken one by one."""


class Messages(NamedTuple):
    """Messages of one topic within a block."""

    data: Bytes
    starts: Ints
    sizes: Ints
    log_ns: Stamps
    published_ns: Stamps


READ, SILENT, UNDECODABLE = 0, 1, 2


class Rows:
    """Columns being filled from the messages of a block, message by message or many at once."""

    def __init__(self, messages: Messages) -> None:
        self.messages = messages
        self.time_ns = np.zeros(len(messages.starts), dtype=np.int64)
        self.state = np.full(len(messages.starts), UNDECODABLE, dtype=np.int8)
        self.values: dict[Key, Array] = {}
        self.named: dict[tuple[str, str], Mask] = {}

    def column(self, key: Key) -> Array:
        """The column of a key, NaN where nothing was read into it yet."""
        if key not in self.values:
            self.values[key] = np.full(len(self.time_ns), np.nan)
        return self.values[key]

    def fill(self, pick: Pick, rows: Ints | slice, read: np.ndarray) -> None:
        """Put what a pick reads in some messages into its column, in SI."""
        column = self.column(pick.key)
        with np.errstate(invalid="ignore", over="ignore"):  # damaged numbers may be anything
            column[rows] = read if (pick.factor, pick.offset) == (1.0, 0.0) else pick.factor * read + pick.offset

    def name(self, joints: Iterable[tuple[str, str]], rows: Ints | slice) -> None:
        """Note that these messages name these joints."""
        for joint in joints:
            if joint not in self.named:
                self.named[joint] = np.zeros(len(self.time_ns), dtype=np.bool_)
            self.named[joint][rows] = True

    def columns(self, origin: str, fruitful: bool, backlog: Counter[str]) -> Iterator[Columns]:
        """What was read, joints that the same messages name side by side.

        Messages that say nothing are faults as soon as others of the topic say something.
        """
        read = self.state == READ
        backlog.update(undecodable=int(np.sum(self.state == UNDECODABLE)), empty=int(np.sum(self.state == SILENT)))
        faults = dict(+backlog) if fruitful else {}
        if fruitful:
            backlog.clear()
        time_ns = self.time_ns
        if read.any() and not time_ns[read].any():
            time_ns = self.messages.log_ns  # a driver that leaves every stamp at zero
        groups: dict[bytes, list[tuple[str, str]]] = {}
        for joint, rows in self.named.items():
            groups.setdefault(rows.tobytes(), []).append(joint)
        for joints in groups.values():
            rows = self.named[joints[0]]
            own = {key: column for key, column in self.values.items() if key[:2] in joints}
            if not rows.all():
                own = {key: column[rows] for key, column in own.items()}
            yield Columns(origin, time_ns[rows], own, faults)
            faults = {}
        if faults:
            yield Columns(origin, time_ns[:0], {}, faults)


class _Layout(NamedTuple):
    places: Ints
    expected: Bytes
    mask: Bytes
    leaves: dict[str, Leaf]
    big_endian: bool
    choice: Choice


class Topic:
    """Reads the messages of one topic.

    Parameters
    ----------
    name : str
    robot : str
        Whose joints they are, if no mapping says.
    take_apart : callable
        Decoder of one message.
    mappings : sequence of Mapping
        Those that name the topic.
    """

    def __init__(
        self, name: str, robot: str, take_apart: Callable[[bytes], Anatomy], mappings: Sequence[Mapping]
    ) -> None:
        self.name, self.robot, self.take_apart, self.mappings = name, robot, take_apart, mappings
        self.layouts: dict[int, list[_Layout]] = {}
        self.kept = self.barren = 0
        self.fruitful = False
        self.backlog: Counter[str] = Counter()

    @property
    def given_up(self) -> bool:
        """Whether nothing in the topic looks like telemetry."""
        return not self.fruitful and self.barren >= MOST_BARREN

    def columns(self, messages: Messages) -> Iterator[Columns]:
        """Read messages, in the order given.

        Parameters
        ----------
        messages : Messages
        """
        rows = Rows(messages)
        for size in np.unique(messages.sizes).tolist():
            self._of_size(messages, int(size), rows)
        return rows.columns(self.name, self.fruitful, self.backlog)

    def _of_size(self, messages: Messages, size: int, out: Rows) -> None:
        rows = np.flatnonzero(messages.sizes == size)
        known = self.layouts.setdefault(size, [])
        for layout in known:
            rows = self._apply(layout, messages, rows, out)
        lonely = 0
        while len(rows):
            learnt = None if size > MOST_MESSAGE or self.given_up else self._learn(messages, int(rows[0]), size)
            if learnt is None:
                hopeless = size > MOST_MESSAGE or self.given_up
                out.state[rows if hopeless else rows[:1]] = UNDECODABLE
                rows = rows[len(rows) if hopeless else 1 :]
                continue
            if lonely > LONELY:
                self._apply(learnt, messages, rows[:1], out)
                rows = rows[1:]
                continue
            left = self._apply(learnt, messages, rows, out)
            lonely += len(rows) - len(left) == 1
            if len(rows) - len(left) > 1 and self.kept < MOST_KEPT:
                known.append(learnt)
                self.kept += 1
            rows = left

    def _learn(self, messages: Messages, row: int, size: int) -> _Layout | None:
        start = int(messages.starts[row])
        data = messages.data[start : start + size]
        try:
            anatomy = self.take_apart(data.tobytes())
        except UndecodableError:
            self.barren += 1
            return None
        choice = choose(anatomy.leaves, self.name, self.robot, self.mappings)
        mask = np.frombuffer(bytes(anatomy.mask), dtype=np.uint8).copy()
        for leaf in anatomy.leaves:
            if leaf.path in choice.names:
                mask[leaf.offset : leaf.offset + leaf.size] = 0xFF
        self.fruitful |= bool(choice.picks)
        self.barren += not choice.picks
        places = np.flatnonzero(mask)
        by_path = {leaf.path: leaf for leaf in anatomy.leaves}
        return _Layout(places, data[places], mask[places], by_path, anatomy.big_endian, choice)

    def _apply(self, layout: _Layout, messages: Messages, rows: Ints, out: Rows) -> Ints:
        """Read the rows that share the layout; give back the others."""
        same = matching(messages.data, messages.starts[rows], layout.places, layout.expected, layout.mask)
        own = rows[same]
        if len(own):
            out.state[own] = READ if layout.choice.picks else SILENT
            if layout.choice.picks:
                out.time_ns[own] = _times(layout.choice.clock, layout, messages, own)
            out.name(layout.choice.joints, own)
            self.backlog["ragged"] += len(own) if layout.choice.ragged else 0
            for pick, read in _read(layout, messages.data, messages.starts[own]):
                out.fill(pick, own, read)
        others: Ints = rows[~same]
        return others


def _read(layout: _Layout, data: Bytes, starts: Ints) -> Iterator[tuple[Pick, np.ndarray]]:
    """What the picks of a layout say in many messages; doubles, which most are, in one go."""
    picked = [(pick, layout.leaves[pick.path]) for pick in layout.choice.picks]
    wide = [(pick, leaf.offset) for pick, leaf in picked if leaf.kind == "f8"]
    copied = doubles(data, starts, np.array([offset for _, offset in wide], dtype=np.int64))
    numbers = copied.view(">f8" if layout.big_endian else "<f8")[:, :, 0]
    yield from zip((pick for pick, _ in wide), numbers, strict=True)
    for pick, leaf in picked:
        if leaf.kind != "f8":
            yield pick, _values(data, starts, leaf, layout.big_endian)


def _times(clock: Clock, layout: _Layout, messages: Messages, own: Ints) -> Stamps:
    def whole(path: str) -> Stamps:
        leaf = layout.leaves[path]
        read = _values(messages.data, messages.starts[own], leaf, layout.big_endian)
        return np.asarray(read).astype(np.int64)

    if clock.seconds:
        return whole(clock.seconds) * 1_000_000_000 + whole(clock.nanos)
    if clock.ticks:
        leaf = layout.leaves[clock.ticks]
        ticks = _values(messages.data, messages.starts[own], leaf, layout.big_endian)
        return ticks_to_ns(ticks, clock.tick_ns) + clock.epoch_ns
    return messages.published_ns[own] if clock.published else messages.log_ns[own]


def ticks_to_ns(ticks: np.ndarray, tick_ns: int) -> Stamps:
    """Ticks of a clock, whole or not, in nanoseconds; -1 s for what is no time.

    Parameters
    ----------
    ticks : (n,) array
    tick_ns : int
    """
    if ticks.dtype.kind in "iu":
        fits = np.abs(ticks.astype(np.float64)) < 2.0**62 / tick_ns
        return np.where(fits, ticks, 0).astype(np.int64) * tick_ns
    known = np.isfinite(ticks) & (np.abs(np.nan_to_num(ticks)) < 2.0**62 / tick_ns)
    usable = np.where(known, ticks, 0.0).astype(np.float64)
    return np.floor(usable).astype(np.int64) * tick_ns + np.round((usable % 1.0) * tick_ns).astype(np.int64)


def _values(data: Bytes, starts: Ints, leaf: Leaf, big_endian: bool) -> np.ndarray:
    """One field of many messages, in its own type."""
    if leaf.kind == "zero":
        return np.zeros(len(starts))
    raw = fields(data, starts, leaf.offset, leaf.size)
    if leaf.kind in ("varint", "zigzag"):
        whole = np.zeros(len(starts), dtype=np.uint64)
        for i in range(min(leaf.size, 10)):
            whole |= (raw[:, i].astype(np.uint64) & np.uint64(0x7F)) << np.uint64(7 * i)
        if leaf.kind == "zigzag":
            return (whole >> np.uint64(1)).astype(np.int64) ^ -(whole & np.uint64(1)).astype(np.int64)
        return whole.view(np.int64)
    numbers: np.ndarray = raw.view((">" if big_endian else "<") + leaf.kind)
    return numbers[:, 0]
