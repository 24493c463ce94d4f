"""JSON messages: parse one, then read the numbers of all that are the same between their numbers.

What stands between the numbers, names and all, must agree byte for byte.
"""

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from gsfdi.wire.kernels import Bytes, Ints, packed, slots
from gsfdi.wire.leaves import Leaf
from gsfdi.wire.rows import Messages
from gsfdi.wire.select import Choice
from gsfdi.wire.topic import Reading, stamps_of

MOST_LEAVES = 65_536
MOST_DEPTH = 16
_TOKEN = re.compile(rb'"(?:[^"\\]|\\.)*"|(-?\d[-+.eE0-9]*)')


@dataclass(frozen=True, slots=True)
class Json:
    """Messages of text, which may share a skeleton whatever their sizes."""

    most_kept: int = 64
    by_size: bool = False

    def take_apart(self, data: bytes, choose: Callable[[Sequence[Leaf]], Choice]) -> "Skeleton | None":
        """Parse a message; None if it is no JSON, or not one whose numbers can be told from its text.

        Parameters
        ----------
        data : bytes
        choose : callable
            What of its leaves is read.
        """
        try:
            found = list(_walk(json.loads(data), "", 0))
        except (ValueError, RecursionError):
            return None
        numbers = [match.span(1) for match in _TOKEN.finditer(data) if match.group(1)]
        texts = {path: text for path, _, text in found}
        named = [path for path, value, _ in found if type(value) in (int, float) and np.isfinite(value)]
        named = [path for path in named if not texts[path]]
        if len(named) != len(numbers) or len(texts) != len(found):
            return None  # a key twice, or a number that only Python would call one
        literals, at = [], 0
        for a, b in [*numbers, (len(data), len(data))]:
            literals.append(data[at:a])
            at = b
        choice = choose([Leaf(path, "text" if text else "f8", 0, 0, text) for path, _, text in found])
        places = {path: k for k, path in enumerate(named)}
        constants = {path: float(value) for path, value, text in found if not text and path not in places}
        whole = np.frombuffer(b"".join(literals), dtype=np.uint8)
        edges = np.cumsum([len(literal) for literal in literals])
        return Skeleton(choice, whole, edges, places, constants)


@dataclass(frozen=True, slots=True)
class Skeleton:
    """What stands between the numbers of a message, and which number is what.

    `slots` gives the number's place by path; what is no number (true, null, NaN) is the same in every message.
    """

    choice: Choice
    literals: Bytes
    edges: Ints
    slots: dict[str, int]
    constants: dict[str, float]

    def read(self, messages: Messages, rows: Ints) -> Reading:
        """Read the rows that share the skeleton.

        Parameters
        ----------
        messages : Messages
        rows : (n,) int array
        """
        starts, sizes = messages.starts[rows], messages.sizes[rows]
        begins, lengths, agree = slots(messages.data, starts, sizes, self.literals, self.edges)
        own, begins, lengths = rows[agree], begins[agree], lengths[agree]

        def number(path: str) -> np.ndarray:
            if path not in self.slots:
                return np.full(len(own), self.constants[path])
            at = self.slots[path]
            whole: np.ndarray = _numbers(messages.data, begins[:, [at]], lengths[:, [at]], exact=True)[0]
            return whole

        picks = self.choice.picks
        wanted = [self.slots[pick.path] for pick in picks if pick.path in self.slots]
        try:
            table = iter(_numbers(messages.data, begins[:, wanted], lengths[:, wanted]))
            time_ns = stamps_of(self.choice.clock, number, messages, own)
        except pa.ArrowInvalid:  # something like 1-2, which only looks like a number
            return Reading(np.zeros(len(rows), dtype=np.bool_), messages.log_ns[rows[:0]], ())
        picked = [(pick, next(table) if pick.path in self.slots else number(pick.path)) for pick in picks]
        return Reading(agree, time_ns, picked)


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
