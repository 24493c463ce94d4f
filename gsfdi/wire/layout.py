"""Binary messages whose numbers lie at fixed places: every structural bit is compared, then all are read at once."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gsfdi.wire.kernels import Bytes, Ints, doubles, fields, matching
from gsfdi.wire.leaves import Anatomy, Leaf, UndecodableError
from gsfdi.wire.rows import Messages
from gsfdi.wire.select import Choice, Pick
from gsfdi.wire.topic import Reading, stamps_of


@dataclass(frozen=True, slots=True)
class Binary:
    """Messages that a decoder takes apart; only those of one size can share a layout.

    Parameters
    ----------
    anatomy_of : callable
        Decoder of one message.
    """

    anatomy_of: Callable[[bytes], Anatomy]
    most_kept: int = 256
    by_size: bool = True

    def take_apart(self, data: bytes, choose: Callable[[Sequence[Leaf]], Choice]) -> "Layout | None":
        """Learn a layout from a message; None if it cannot be decoded.

        Parameters
        ----------
        data : bytes
        choose : callable
            What of its leaves is read.
        """
        try:
            anatomy = self.anatomy_of(data)
        except UndecodableError:
            return None
        choice = choose(anatomy.leaves)
        mask = np.frombuffer(bytes(anatomy.mask), dtype=np.uint8).copy()
        for leaf in anatomy.leaves:
            if leaf.path in choice.names:
                mask[leaf.offset : leaf.offset + leaf.size] = 0xFF
        places = np.flatnonzero(mask)
        by_path = {leaf.path: leaf for leaf in anatomy.leaves}
        expected = np.frombuffer(data, dtype=np.uint8)[places]
        return Layout(choice, places, expected, mask[places], by_path, anatomy.big_endian)


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the numbers of a message lie, and what must stand in between."""

    choice: Choice
    places: Ints
    expected: Bytes
    mask: Bytes
    leaves: dict[str, Leaf]
    big_endian: bool

    def read(self, messages: Messages, rows: Ints) -> Reading:
        """Read the rows that share the layout.

        Parameters
        ----------
        messages : Messages
        rows : (n,) int array
        """
        agree = matching(messages.data, messages.starts[rows], self.places, self.expected, self.mask)
        own = rows[agree]
        starts = messages.starts[own]
        if not len(own):
            return Reading(agree, messages.log_ns[own], ())

        def number(path: str) -> np.ndarray:
            return _values(messages.data, starts, self.leaves[path], self.big_endian)

        time_ns = stamps_of(self.choice.clock, number, messages, own)
        return Reading(agree, time_ns, self._picked(messages.data, starts))

    def _picked(self, data: Bytes, starts: Ints) -> Iterator[tuple[Pick, np.ndarray]]:
        """What the picks say in many messages; doubles, which most are, in one go."""
        picked = [(pick, self.leaves[pick.path]) for pick in self.choice.picks]
        wide = [(pick, leaf.offset) for pick, leaf in picked if leaf.kind == "f8"]
        copied = doubles(data, starts, np.array([offset for _, offset in wide], dtype=np.int64))
        numbers = copied.view(">f8" if self.big_endian else "<f8")[:, :, 0]
        yield from zip((pick for pick, _ in wide), numbers, strict=True)
        for pick, leaf in picked:
            if leaf.kind != "f8":
                yield pick, _values(data, starts, leaf, self.big_endian)


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
