"""CSV, with a header or without: canonical columns as they are, other tables by a mapping.

A text file carries no checksum, so a row is believed only if it has as many fields as the others and lies clear of rows
whose values no joint can have: what breaks one row of a logger's memory breaks its neighbours too.
"""

import codecs
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pv

from gsfdi.errors import UnusableInputError
from gsfdi.mapping import Mapping
from gsfdi.quality import absurd
from gsfdi.readers import Reader
from gsfdi.types import Array, Mask, Problem
from gsfdi.wire import Columns, Item, Key
from gsfdi.wire.tables import Plan, columns_of, plans, read_as

HEAD = 1 << 16
BLOCK = 1 << 22
"""Bytes parsed at a time."""
REACH = 5
"""Rows on either side of an absurd one that are not believed either."""
MOST_COLUMNS = 4_096
_NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*|\s*[-+]?(nan|inf|infinity)\s*|", re.IGNORECASE)
_NUMBER_RE2 = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*$"


@dataclass(frozen=True, slots=True)
class Shape:
    """How a text table is laid out."""

    delimiter: str
    names: tuple[str, ...]
    header_rows: int
    end: int


def sniff(head: bytes) -> bool:
    """Whether these are the first bytes of a text table with numbers in it.

    Parameters
    ----------
    head : bytes
    """
    rows = _rows(head)
    if not rows:
        return False
    delimiter, width = _layout(rows)
    rows = [row.replace(",", ".") for row in rows] if delimiter == ";" else rows  # 1,5 is a number there
    cells = [row.split(delimiter) for row in rows if row.count(delimiter) == width - 1]
    return width >= 2 and any(_is_number(cell) and cell.strip() for row in cells[-3:] for cell in row)


def read(path: Path, mappings: Sequence[Mapping], whole: bool | None) -> Iterator[Item]:
    """Yield the table block by block, and name what was left out.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    whole : bool or None
        Whether the file's seal holds; this format has none.
    """
    shape = _shape(path)
    chosen = plans(path, shape.names, mappings)
    left_out = _LeftOut()
    with path.open("rb") as raw:
        try:
            for block in _blocks(raw, shape, chosen, left_out):
                for plan in chosen:
                    for columns in columns_of(_timed(block, plan, shape.delimiter == ";", left_out), plan, str(path)):
                        yield _trusted(columns, left_out)
        except (pa.ArrowException, ValueError) as error:
            yield Problem(str(path), f"is damaged: {error}; what was read before stands", "fetch the file again")
    yield from left_out.problems(path)
    yield from _ending(path, shape)


def describe(path: Path, mappings: Sequence[Mapping]) -> dict[str, object]:
    """Say what the table holds and how it would be read.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    """
    shape = _shape(path)
    return {
        "format": "csv",
        "integrity": "unverified: text carries no checksum",
        "header": bool(shape.header_rows),
        "columns": list(shape.names),
        "read_as": [read_as(plan) for plan in plans(path, shape.names, mappings)],
    }


@dataclass(slots=True)
class _LeftOut:
    """Rows passed over, and an example of each kind."""

    misshapen: int = 0
    first: str = ""
    damaged: int = 0
    worst: str = ""
    unreadable: int = 0
    seen: set[str] = field(default_factory=set)

    def odd_row(self, row: pv.InvalidRow) -> str:
        self.misshapen += 1
        where = f"line {row.number}" if row.number else "a line"
        self.first = self.first or f"{where} has {row.actual_columns} fields, {row.expected_columns} are usual"
        return "skip"

    def problems(self, path: Path) -> Iterator[Problem]:
        mend = "fetch the file again, or accept the rest"
        if self.misshapen:
            yield Problem(str(path), f"is damaged: {self.first}; {self.misshapen} such lines were left out", mend)
        if self.damaged:
            yield Problem(
                str(path), f"is corrupt: {self.worst}; {self.damaged} rows around such values were left out", mend
            )
        if self.unreadable:
            yield Problem(str(path), f"is damaged: {self.unreadable} fields are no numbers; they were masked", mend)


def _blocks(raw: io.BufferedReader, shape: Shape, chosen: list[Plan], left_out: _LeftOut) -> Iterator[pa.RecordBatch]:
    """Blocks of the wanted columns, numbers as float64."""
    wanted = list(dict.fromkeys(column for plan in chosen for column in plan.columns))
    texts = {plan.joint for plan in chosen} | {plan.time for plan in chosen}
    stream = pv.open_csv(
        pa.PythonFile(_UpTo(raw, shape.end), mode="r"),
        read_options=pv.ReadOptions(
            use_threads=False, block_size=BLOCK, column_names=list(shape.names), skip_rows=shape.header_rows
        ),
        parse_options=pv.ParseOptions(delimiter=shape.delimiter, invalid_row_handler=left_out.odd_row),
        convert_options=pv.ConvertOptions(
            include_columns=wanted, column_types=dict.fromkeys(wanted, pa.string()), check_utf8=False
        ),
    )
    for batch in stream:
        columns = []
        for name in wanted:
            column = batch.column(name)
            columns.append(column if name in texts else _to_numbers(column, shape.delimiter == ";", left_out))
        yield pa.record_batch(columns, names=wanted)


def _to_numbers(column: pa.Array, comma: bool, left_out: _LeftOut) -> pa.Array:
    """Text to float64; what is no number becomes null and is counted."""
    column = pc.utf8_trim_whitespace(column) if comma else column
    if comma:
        column = pc.replace_substring(column, ",", ".")
    try:
        return column.cast(pa.float64())
    except pa.ArrowInvalid:
        good = pc.match_substring_regex(column, _NUMBER_RE2)
        blank = pc.match_substring_regex(column, r"(?i)^\s*[-+]?(nan|inf|infinity|null|none|na|n/a)?\s*$")
        left_out.unreadable += int(np.sum(~np.asarray(good.fill_null(True)) & ~np.asarray(blank.fill_null(True))))
        return pc.utf8_trim_whitespace(pc.if_else(good, column, None)).cast(pa.float64())


def _timed(block: pa.RecordBatch, plan: Plan, comma: bool, left_out: _LeftOut) -> pa.RecordBatch:
    """Read stamps, which are text: dates, else whole nanoseconds in canonical telemetry and ticks by a mapping."""
    at = block.schema.get_field_index(plan.time)
    column = pc.utf8_trim_whitespace(block.column(at))
    dated = pc.match_substring_regex(column, r"^\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(\.\d{1,9})?(Z|[-+]\d\d:?\d\d)?$")
    if pc.any(dated).as_py():
        text = pc.if_else(dated, column, None)
        zoned = pc.match_substring_regex(text, r"(Z|[-+]\d\d:?\d\d)$")
        text = pc.if_else(zoned, text, pc.binary_join_element_wise(text, "Z", ""))
        return block.set_column(at, plan.time, text.cast(pa.timestamp("ns", tz="UTC")))
    if plan.tick_ns is None:
        whole = pc.match_substring_regex(column, r"^\d{17,19}$")
        return block.set_column(at, plan.time, pc.if_else(whole, column, None).cast(pa.int64()))
    return block.set_column(at, plan.time, _to_numbers(column, comma, left_out))


def _trusted(columns: Columns, left_out: _LeftOut) -> Columns:
    """Leave out the rows around absurd values, unless a channel is absurd as a rule; then quality masks it."""
    n = len(columns.time_ns)
    bad = np.zeros(n, dtype=np.bool_)
    for key, values in columns.values.items():
        wild = absurd(values, key.channel)
        if 0 < wild.sum() < max(0.05 * n, 2):
            bad |= wild
            left_out.worst = left_out.worst or f"{key.joint} {key.channel} is {values[np.argmax(wild)]:.3g}"
    if not bad.any():
        return columns
    reached: Mask = np.convolve(bad, np.ones(2 * REACH + 1), mode="same") > 0 if n > 2 * REACH else np.ones(n, np.bool_)
    left_out.damaged += int(reached.sum())
    kept: dict[Key, Array] = {key: values[~reached] for key, values in columns.values.items()}
    return Columns(
        columns.origin, columns.time_ns[~reached], kept, {**columns.faults, "corrupt_row": int(reached.sum())}
    )


class _UpTo(io.RawIOBase):
    """The first `end` bytes of a file, what is not UTF-8 shown as question marks: pyarrow stumbles over it."""

    def __init__(self, raw: io.BufferedReader, end: int) -> None:
        self._raw, self._left = raw, end
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        room = self._left if size < 0 else min(max(size - 4, 1), self._left)  # a character may be split between reads
        data = self._raw.read(room)
        self._left -= len(data)
        if data.isascii() and not self._decoder.getstate()[0]:
            return data
        return self._decoder.decode(data, final=not self._left).replace("\ufffd", "?").encode()


def _ending(path: Path, shape: Shape) -> Iterator[Problem]:
    """A last line without its line feed was left out: it may be cut in the middle of a number."""
    with path.open("rb") as file:
        file.seek(shape.end)
        last = file.read(BLOCK).decode("utf-8", "replace")
    width = last.count(shape.delimiter) + 1
    if last.strip() and width != len(shape.names):
        what = f"is corrupt: its last line is cut after {width} of {len(shape.names)} fields and was left out"
        yield Problem(str(path), what, "fetch the file again, or accept the rest")
    elif last.strip():
        what = "ends without a line feed; its last line may be cut and was left out"
        yield Problem(str(path), what, "let the logger end each line", "note")


def _shape(path: Path) -> Shape:
    with path.open("rb") as file:
        head = file.read(HEAD)
        size = file.seek(0, 2)
        file.seek(max(0, size - BLOCK))
        tail = file.read()
    rows = _rows(head)
    if not rows:
        raise UnusableInputError(path, "holds no rows of text", "leave the file out")
    delimiter, width = _layout(rows)
    if width > MOST_COLUMNS:
        raise UnusableInputError(path, f"has {width} columns; {MOST_COLUMNS} at most are read", "split the table")
    comments = next(i for i, row in enumerate(rows) if not row.startswith("#"))
    first = [cell.strip().strip('"') for cell in rows[comments].split(delimiter)]
    header = len(first) == width and not any(_is_number(cell) and cell for cell in first)
    names = _unique(first) if header else tuple(str(i) for i in range(width))
    end = size - len(tail) + tail.rfind(b"\n") + 1 if b"\n" in tail else size
    return Shape(delimiter, names, comments + header, end)


def _rows(head: bytes) -> list[str]:
    """Whole lines at the start of a text file; none if it is not text."""
    if b"\0" in head or not head.strip():
        return []
    lines = head.decode("utf-8-sig", "replace").splitlines()
    whole = lines if head.endswith(b"\n") or len(head) < HEAD else lines[:-1]
    kept = [line for line in whole[:400] if line.strip()]
    return kept if any(not line.startswith("#") for line in kept) else []


def _layout(rows: list[str]) -> tuple[str, int]:
    """Delimiter and usual number of fields."""
    best = (",", 1, 0)
    for delimiter in (",", ";", "\t", "|"):
        widths = [row.count(delimiter) + 1 for row in rows if not row.startswith("#")]
        width = max(set(widths), key=widths.count)
        if width > 1 and widths.count(width) > best[2]:
            best = (delimiter, width, widths.count(width))
    return best[0], best[1]


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None


def _unique(names: list[str]) -> tuple[str, ...]:
    """Names, with repeated ones told apart by their number."""
    return tuple(f"{name}#{i}" if name in names[:i] or not name else name for i, name in enumerate(names))


READER = Reader("csv", sniff, read, describe)
