"""JSON messages to columns: parse one, then read the numbers of all that are the same between their numbers.

What stands between the numbers, names and all, must agree byte for byte; a message that differs becomes the next one to
be parsed.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from gsfdi.mapping import Mapping
from gsfdi.wire import Columns, Stamps
from gsfdi.wire.kernels import Bytes, Ints, packed, slots
from gsfdi.wire.layout import LONELY, MOST_BARREN, MOST_MESSAGE, READ, SILENT, Messages, Rows, ticks_to_ns
from gsfdi.wire.leaves import Leaf
from gsfdi.wire.select import Choice, choose

MOST_KEPT = 64
MOST_LEAVES = 65_536
MOST_DEPTH = 16
_TOKEN = re.compile(rb'"(?:[^"\\]|\\.)*"|(-?\d[-+.eE0-9]*)')


class _Skeleton(NamedTuple):
    """What stands between the numbers of a message, and which number is what.

    `slots` gives the number's place by path; what is no number (true, null, NaN) is the same in every message.
    """

    literals: Bytes
    edges: Ints
    slots: dict[str, int]
    constants: dict[str, float]
    choice: Choice


class Topic:
    """Reads the JSON messages of one topic.

    Parameters
    ----------
    name : str
    robot : str
        Whose joints they are, if no mapping says.
    mappings : sequence of Mapping
        Those that name the topic.
    """

    def __init__(self, name: str, robot: str, mappings: Sequence[Mapping]) -> None:
        self.name, self.robot, self.mappings = name, robot, mappings
        self.skeletons: list[_Skeleton] = []
        self.barren = 0
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
        out = Rows(messages)
        rows = np.arange(len(messages.starts))
        for skeleton in self.skeletons:
            rows = self._apply(skeleton, messages, rows, out)
        lonely = 0
        while len(rows) and not self.given_up:
            learnt = self._learn(messages, int(rows[0]))
            if learnt is None:
                rows = rows[1:]
            elif lonely > LONELY:
                self._apply(learnt, messages, rows[:1], out)
                rows = rows[1:]
            else:
                left = self._apply(learnt, messages, rows, out)
                lonely += len(rows) - len(left) <= 1
                if len(rows) - len(left) > 1 and len(self.skeletons) < MOST_KEPT:
                    self.skeletons.append(learnt)
                rows = left if len(left) < len(rows) else rows[1:]
        yield from out.columns(self.name, self.fruitful, self.backlog)

    def _learn(self, messages: Messages, row: int) -> _Skeleton | None:
        """Parse a message; None if it is no JSON, or not one whose numbers can be told from its text."""
        start, size = int(messages.starts[row]), int(messages.sizes[row])
        data = messages.data[start : start + min(size, MOST_MESSAGE + 1)].tobytes()
        try:
            if size > MOST_MESSAGE:
                raise ValueError("too long")
            found = list(_walk(json.loads(data), "", 0))
        except (ValueError, RecursionError):
            self.barren += 1
            return None
        numbers = [match.span(1) for match in _TOKEN.finditer(data) if match.group(1)]
        named = [path for path, value, _ in found if type(value) in (int, float) and np.isfinite(value)]
        texts = {path: text for path, _, text in found}
        named = [path for path in named if not texts[path]]
        if len(named) != len(numbers) or len(texts) != len(found):
            self.barren += 1  # a key twice, or a number that only Python would call one
            return None
        literals, at = [], 0
        for a, b in [*numbers, (len(data), len(data))]:
            literals.append(data[at:a])
            at = b
        choice = choose(
            [Leaf(path, "text" if text else "f8", 0, 0, text) for path, _, text in found],
            self.name,
            self.robot,
            self.mappings,
        )
        self.barren += not choice.picks
        self.fruitful |= bool(choice.picks)
        places = {path: k for k, path in enumerate(named)}
        constants = {path: float(value) for path, value, text in found if not text and path not in places}
        whole = np.frombuffer(b"".join(literals), dtype=np.uint8)
        edges = np.cumsum([len(literal) for literal in literals])
        return _Skeleton(whole, edges, places, constants, choice)

    def _apply(self, skeleton: _Skeleton, messages: Messages, rows: Ints, out: Rows) -> Ints:
        """Read the rows that share the skeleton; give back the others."""
        starts, sizes = messages.starts[rows], messages.sizes[rows]
        begins, lengths, agree = slots(messages.data, starts, sizes, skeleton.literals, skeleton.edges)
        picks = skeleton.choice.picks
        wanted = [skeleton.slots[pick.path] for pick in picks if pick.path in skeleton.slots]
        own = rows[agree]
        try:
            table = _numbers(messages.data, begins[agree][:, wanted], lengths[agree][:, wanted])
            times = self._times(skeleton, messages, own, begins[agree], lengths[agree])
        except pa.ArrowInvalid:  # something like 1-2, which only looks like a number
            return rows
        out.state[own] = READ if picks else SILENT
        out.name(skeleton.choice.joints, own)
        self.backlog["ragged"] += len(own) if skeleton.choice.ragged else 0
        if picks:
            out.time_ns[own] = times
        column = iter(table)
        for pick in picks:
            value = next(column) if pick.path in skeleton.slots else np.full(len(own), skeleton.constants[pick.path])
            out.fill(pick, own, value)
        others: Ints = rows[~agree]
        return others

    def _times(self, skeleton: _Skeleton, messages: Messages, own: Ints, begins: Ints, lengths: Ints) -> Stamps:
        clock = skeleton.choice.clock

        def read(path: str) -> np.ndarray:
            if path not in skeleton.slots:
                return np.full(len(own), skeleton.constants[path])
            at = skeleton.slots[path]
            whole: np.ndarray = _numbers(messages.data, begins[:, [at]], lengths[:, [at]], exact=True)[0]
            return whole

        if clock.seconds:
            return ticks_to_ns(read(clock.seconds), 1_000_000_000) + ticks_to_ns(read(clock.nanos), 1)
        if clock.ticks:
            return ticks_to_ns(read(clock.ticks), clock.tick_ns) + clock.epoch_ns
        return messages.published_ns[own] if clock.published else messages.log_ns[own]


def _numbers(data: Bytes, begins: Ints, lengths: Ints, exact: bool = False) -> np.ndarray:
    """The numbers that stand at some places of many messages, a row for each place; whole ones exact if asked."""
    text, edges = packed(data, begins.T.ravel(), lengths.T.ravel())
    buffers = [None, pa.py_buffer(edges), pa.py_buffer(text)]
    array = pa.Array.from_buffers(pa.string(), len(edges) - 1, buffers)
    if exact:
        try:
            return np.asarray(array.cast(pa.int64())).reshape(begins.shape[::-1])
        except pa.ArrowInvalid:
            pass  # fractions, or more than 64 bits
    return np.asarray(array.cast(pa.float64())).reshape(begins.shape[::-1])


def _walk(content: Any, path: str, depth: int) -> Iterator[tuple[str, float | int | bool, str]]:
    """Every value of a parsed message in the order of its text, and what a string says."""
    if depth > MOST_DEPTH:
        raise ValueError("nested too deeply")
    if isinstance(content, dict):
        for key, value in content.items():
            yield from _walk(value, f"{path}.{key}" if path else str(key), depth + 1)
    elif isinstance(content, list):
        if len(content) > MOST_LEAVES:
            raise ValueError("too many values")
        for i, value in enumerate(content):
            yield from _walk(value, f"{path}[{i}]", depth + 1)
    elif isinstance(content, str):
        yield path, 0.0, content or " "
    else:
        yield path, float("nan") if content is None else content, ""
