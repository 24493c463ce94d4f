"""Tables, canonical or mapped, to columns of numbers: what Parquet and CSV have in common."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from gsfdi.canonical import axis_of
from gsfdi.channels import CHANNEL_OF_COLUMN, Axis
from gsfdi.errors import UnusableInputError
from gsfdi.mapping import Mapping as LogMapping
from gsfdi.mapping import Source
from gsfdi.types import UNNAMED, Array, Mask
from gsfdi.wire import Columns, Key, Stamps


class Pick(NamedTuple):
    """A column, and what it is; the joint is empty in a long table, where a column says it."""

    joint: str
    channel: str
    axis: Axis
    column: str
    source: Source


@dataclass(frozen=True, slots=True)
class Plan:
    """Which columns of one table are read, and as what; `joint` names the column that tells joints apart."""

    robot: str
    time: str
    tick_ns: int | None
    epoch_ns: int
    joint: str | None
    picks: tuple[Pick, ...]

    @property
    def columns(self) -> list[str]:
        """Every column of the table that is needed, once."""
        named = [self.time, *([self.joint] if self.joint else []), *(pick.column for pick in self.picks)]
        return list(dict.fromkeys(named))


def plans(path: object, names: Sequence[str], mappings: Sequence[LogMapping], robot: str = "") -> list[Plan]:
    """How a table with these columns is read: by each mapping that speaks of tables, else as canonical telemetry.

    Parameters
    ----------
    path : object
        What to call the table in complaints.
    names : sequence of str
        Its columns.
    mappings : sequence of Mapping
    robot : str
        Robot that the table itself states, for canonical telemetry.
    """
    if is_canonical(names):
        usual = axis_of(names)
        known = [(name, *CHANNEL_OF_COLUMN[name]) for name in names if name in CHANNEL_OF_COLUMN]
        picks = tuple(Pick("", channel, axis or usual, name, Source()) for name, channel, axis in known)
        return [Plan(robot or UNNAMED, "timestamp", None, 0, "joint", picks)]
    tabular = [mapping for mapping in mappings if mapping.tabular]
    if not tabular:
        shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
        raise UnusableInputError(
            path,
            f"is no canonical telemetry; its {len(names)} columns: {shown}",
            "give a --mapping that names the columns of each joint",
        )
    found, misfits = [], []
    for mapping in tabular:
        try:
            found.append(_plan(path, names, mapping))
        except UnusableInputError as error:
            misfits.append(error)  # a mapping meant for another of the files
    if not found:
        raise misfits[0]
    return found


def is_canonical(names: Sequence[str]) -> bool:
    """Whether a table with these columns is canonical telemetry."""
    return {"timestamp", "joint"} <= set(names) and any(name in CHANNEL_OF_COLUMN for name in names)


def _plan(path: object, names: Sequence[str], mapping: LogMapping) -> Plan:
    def find(wanted: str | int, what: str) -> str:
        if isinstance(wanted, int) and 0 <= wanted < len(names):
            return names[wanted]
        if isinstance(wanted, str) and wanted in names:
            return wanted
        raise UnusableInputError(
            path,
            f"has no column {wanted!r}, which {mapping.path} names for {what}; its {len(names)} columns: "
            f"{', '.join(names[:12])}",
            "correct the mapping, or leave the file out",
        )

    if mapping.time is None:
        raise UnusableInputError(mapping.path, "names no time column", "add time = 'the column' and time_unit")
    picks = tuple(
        Pick(
            source.rename.get(joint, joint),
            channel,
            mapping.axis,
            find(column, f"{channel} of {joint or 'all joints'}"),
            source,
        )
        for channel, source in mapping.sources.items()
        for joint, column in source.columns.items()
    )
    joint = None if mapping.joint is None else find(mapping.joint, "joint")
    time = find(mapping.time, "time")
    return Plan(mapping.robot, time, mapping.time_ns, mapping.epoch_of(str(path)), joint, picks)


def read_as(plan: Plan) -> dict[str, object]:
    """The plan in words, for a person."""
    channels = [f"{pick.channel} of {pick.joint or 'each joint'} from {pick.column}" for pick in plan.picks]
    return {"robot": plan.robot, "time": plan.time, "joints": plan.joint or "a column each", "channels": channels}


def columns_of(table: pa.RecordBatch, plan: Plan, origin: str) -> Iterator[Columns]:
    """Read one block of a table.

    Parameters
    ----------
    table : pyarrow.RecordBatch
        A block with the plan's columns.
    plan : Plan
    origin : str
        File that it comes from.
    """
    time_ns, known = stamps(table.column(plan.time), plan)
    lost = {"no_stamp": int(np.sum(~known))} if not known.all() else {}
    numbers = {pick.column: _numbers(table.column(pick.column)) for pick in plan.picks}
    if plan.joint is None:
        values = {
            Key(plan.robot, pick.joint, pick.channel, pick.axis): _in_si(numbers[pick.column][known], pick.source)
            for pick in plan.picks
        }
        yield Columns(origin, time_ns[known], values, lost)
        return
    for joint, rows in _joints(table.column(plan.joint)):
        mask = known & rows
        here = slice(None) if mask.all() else mask  # a block of one joint is the rule, and need not be copied
        values = {}
        for pick in plan.picks:
            found = _in_si(numbers[pick.column][here], pick.source)
            if not _empty(found):  # a long table leaves the columns of the other kind of joint empty
                values[Key(plan.robot, pick.source.rename.get(joint, joint), pick.channel, pick.axis)] = found
        yield Columns(origin, time_ns[here], values, lost)
        lost = {}


def _in_si(values: Array, source: Source) -> Array:
    return values if (source.factor, source.offset) == (1.0, 0.0) else source.factor * values + source.offset


def stamps(column: pa.Array, plan: Plan) -> tuple[Stamps, Mask]:
    """Stamps of a time column [ns], and where there is one."""
    kind = column.type
    if pa.types.is_timestamp(kind):
        whole = column.cast(pa.timestamp("ns", tz=kind.tz), safe=False)
        return _filled(whole.cast(pa.int64()), 0), _known(whole)
    if pa.types.is_integer(kind) and not pa.types.is_uint64(kind):
        known, ticks = _known(column), _filled(column.cast(pa.int64()), 0)
        tick = plan.tick_ns or 1
        fits = known & (np.abs(ticks) < 2**62 // tick) & (abs(plan.epoch_ns) < 2**61)
        return np.where(fits, ticks, 0) * tick + plan.epoch_ns, fits
    ticks = _numbers(column)
    tick = plan.tick_ns or 1_000_000_000
    known = np.isfinite(ticks) & (np.abs(np.nan_to_num(ticks)) < 2.0**62 / tick)
    ticks = np.where(known, ticks, 0.0)
    whole_ticks = np.floor(ticks)
    return whole_ticks.astype(np.int64) * tick + np.round((ticks - whole_ticks) * tick).astype(
        np.int64
    ) + plan.epoch_ns, known


def _numbers(column: pa.Array) -> Array:
    """A column as float64, NaN for nulls and for what is no number."""
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type) or pa.types.is_boolean(column.type)):
        return np.full(len(column), np.nan)
    return np.asarray(_filled(column.cast(pa.float64(), safe=False), np.nan), dtype=np.float64)


def _filled(column: pa.Array, value: float) -> np.ndarray:
    """A column's numbers, without a copy where none is missing."""
    return np.asarray(pc.fill_null(column, value) if column.null_count else column)


def _known(column: pa.Array) -> Mask:
    """Where a column says something."""
    return np.asarray(pc.is_valid(column)) if column.null_count else np.ones(len(column), dtype=np.bool_)


def _empty(values: Array) -> bool:
    return not len(values) or bool(np.isnan(values[0]) and np.isnan(values).all())


def _joints(column: pa.Array) -> Iterator[tuple[str, Mask | bool]]:
    """The joints that a column names, and the rows of each."""
    if not pa.types.is_dictionary(column.type) or len(column.dictionary) != 1 or column.null_count:
        column = column.cast(pa.string()).dictionary_encode()
    codes = np.asarray(pc.fill_null(column.indices, -1))
    names = [str(name) for name in column.dictionary.to_pylist()]
    for code, name in enumerate(names):
        yield name, True if len(names) == 1 and not column.null_count else codes == code
