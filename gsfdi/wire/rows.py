"""Messages of a topic within a block, and the columns that are being filled from them."""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from gsfdi.types import Array, Mask
from gsfdi.wire import Columns, Key, Stamps
from gsfdi.wire.kernels import Bytes, Ints
from gsfdi.wire.select import Pick


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
