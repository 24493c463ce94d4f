"""JSON messages to columns: a block of one layout through pyarrow's parser, anything else one by one."""

import io
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.json as pj

from gsfdi.mapping import Mapping
from gsfdi.wire import Columns
from gsfdi.wire.kernels import deepest
from gsfdi.wire.layout import MOST_BARREN, MOST_MESSAGE, READ, SILENT, Messages, Rows, ticks_to_ns
from gsfdi.wire.leaves import Leaf
from gsfdi.wire.select import Choice, choose

FEW = 16
"""Blocks of fewer messages are read one by one."""
MOST_LEAVES = 65_536
MOST_DEPTH = 32


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
        self.barren = 0
        self.fruitful = False
        self.backlog: Counter[str] = Counter()
        self.choices: dict[tuple[Leaf, ...], Choice] = {}

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
        if self.given_up:
            return out.columns(self.name, False, self.backlog)
        if len(messages.starts) < FEW or not self._at_once(messages, out):
            for row in range(len(messages.starts)):
                self._one(messages, row, out)
        return out.columns(self.name, self.fruitful, self.backlog)

    def _at_once(self, messages: Messages, out: Rows) -> bool:
        """Read a block whose messages all have the first one's layout; False if they do not."""
        whole = messages.data.tobytes()
        ends = (messages.starts + messages.sizes).tolist()
        lines = b"\n".join([whole[a:b] for a, b in zip(messages.starts.tolist(), ends, strict=True)])
        if lines.count(b"\n") != len(ends) - 1 or deepest(np.frombuffer(lines, dtype=np.uint8)) > MOST_DEPTH:
            return False
        try:
            table = pj.read_json(
                io.BytesIO(lines), pj.ReadOptions(use_threads=False, block_size=max(len(lines) + 1, 1 << 16))
            )
        except (pa.ArrowException, ValueError):
            return False
        if table.num_rows != len(ends):
            return False
        columns: dict[str, np.ndarray] = {}
        leaves: list[Leaf] = []
        for name in table.column_names:
            if not _flatten(_whole(table.column(name)), name, len(ends), columns, leaves):
                return False
        choice = self._choice(tuple(leaves))
        if any(leaf.path in choice.names and not _constant(columns[leaf.path]) for leaf in leaves):
            return False
        out.state[:] = READ if choice.picks else SILENT
        out.name(choice.joints, slice(None))
        if choice.picks:
            out.time_ns[:] = _times(choice, columns, messages, slice(None))
        for pick in choice.picks:
            out.column(pick.key)[:] = pick.factor * columns[pick.path].astype(np.float64) + pick.offset
        return True

    def _one(self, messages: Messages, row: int, out: Rows) -> None:
        start, size = int(messages.starts[row]), int(messages.sizes[row])
        if size > MOST_MESSAGE:
            return
        try:
            content = json.loads(messages.data[start : start + size].tobytes())
            found = list(_walk(content, "", 0))
        except (ValueError, RecursionError):
            self.barren += 1
            return
        choice = self._choice(tuple(Leaf(path, "text" if text else "f8", 0, 0, text) for path, _, text in found))
        values = {path: np.array([value]) for path, value, _ in found}
        out.state[row] = READ if choice.picks else SILENT
        out.name(choice.joints, slice(row, row + 1))
        if choice.picks:
            out.time_ns[row] = _times(choice, values, messages, slice(row, row + 1))[0]
        for pick in choice.picks:
            out.column(pick.key)[row] = pick.factor * float(values[pick.path][0]) + pick.offset

    def _choice(self, leaves: tuple[Leaf, ...]) -> Choice:
        """Choose once for each layout; a layout is its paths and what its names say."""
        if leaves not in self.choices:
            if len(self.choices) > 256:
                self.choices.clear()
            choice = choose(leaves, self.name, self.robot, self.mappings)
            self.barren += not choice.picks
            self.fruitful |= bool(choice.picks)
            self.choices[leaves] = choice
        return self.choices[leaves]


def _walk(content: Any, path: str, depth: int) -> Iterator[tuple[str, float | int, str]]:
    """Every number, and every string with its text, below a parsed message."""
    if depth > 16:
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
    elif content is None:
        yield path, float("nan"), ""
    elif isinstance(content, bool | int | float):
        yield path, float(content) if abs(content) >= 2**63 else content, ""


def _flatten(column: pa.Array, path: str, rows: int, columns: dict[str, np.ndarray], leaves: list[Leaf]) -> bool:
    """One column of a table to columns of numbers by path; False if its messages differ in layout."""
    kind = column.type
    if pa.types.is_struct(kind):
        if column.null_count:
            return False
        fields = [kind.field(i).name for i in range(kind.num_fields)]
        return all(
            _flatten(pc.struct_field(column, [i]), f"{path}.{f}", rows, columns, leaves) for i, f in enumerate(fields)
        )
    if pa.types.is_list(kind):
        lengths = pc.list_value_length(column)
        first = lengths[0].as_py()
        if column.null_count or first is None or not pc.all(pc.equal(lengths, first)).as_py() or first > MOST_LEAVES:
            return False
        flat = column.flatten()
        places = np.arange(len(flat)).reshape(len(column), first)
        return all(
            _flatten(flat.take(pa.array(places[:, i])), f"{path}[{i}]", rows, columns, leaves) for i in range(first)
        )
    if len(column) != rows:
        return False
    if pa.types.is_string(kind) or pa.types.is_timestamp(kind) or pa.types.is_null(kind):
        texts = column.cast(pa.string()) if not pa.types.is_null(kind) else pa.array([""] * rows)
        if texts.null_count:
            return False
        columns[path] = np.asarray(texts.dictionary_encode().indices)
        leaves.append(Leaf(path, "text", 0, 0, texts[0].as_py() or " "))
        return True
    if column.null_count:
        return False
    columns[path] = np.asarray(column)
    leaves.append(Leaf(path, "f8", 0, 0))
    return True


def _whole(column: pa.ChunkedArray) -> pa.Array:
    return column.chunk(0) if column.num_chunks == 1 else pa.concat_arrays(column.chunks)


def _constant(codes: np.ndarray) -> bool:
    return bool((codes == codes[0]).all())


def _times(choice: Choice, columns: dict[str, np.ndarray], messages: Messages, rows: slice) -> np.ndarray:
    clock = choice.clock
    if clock.seconds:
        whole = ticks_to_ns(columns[clock.seconds], 1_000_000_000)
        return whole + ticks_to_ns(columns[clock.nanos], 1)
    if clock.ticks:
        return ticks_to_ns(columns[clock.ticks], clock.tick_ns) + clock.epoch_ns
    return messages.published_ns[rows] if clock.published else messages.log_ns[rows]
