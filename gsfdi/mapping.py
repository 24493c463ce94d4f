"""Mapping files: which topic, field or column of a log holds each canonical column, and in which unit.

A mapping belongs to one robot. Units convert here and nowhere else, so past the readers everything is SI.

Beside what every mapping has (``robot``, ``time``, and a table for each canonical column) a file may say:

- ``joint = "name"`` with ``column = "pos"`` in the tables: a long text table, one row per joint and sample;
- ``time_epoch_name = "ur-%y_%m_%d"``: the clock's epoch stands in the file's name;
- ``columns = { J1 = "position[0]" }`` beside a ``topic``: single fields of a message;
- ``offset``: added after unit and scale.
"""

import dataclasses
import datetime as dt
import re
import tomllib
from collections.abc import Mapping as Map
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gsfdi.channels import CHANNEL_OF_COLUMN, CHANNELS, Axis
from gsfdi.errors import UnusableInputError, nearest
from gsfdi.types import UNNAMED

SCHEMA = "gsfdi/mapping/1"

_TURN = 6.283185307179586
_UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "rad": {"rad": (1, 0), "deg": (_TURN / 360, 0), "mrad": (1e-3, 0), "urad": (1e-6, 0), "rev": (_TURN, 0)},
    "rad/s": {
        "rad/s": (1, 0),
        "deg/s": (_TURN / 360, 0),
        "mrad/s": (1e-3, 0),
        "rpm": (_TURN / 60, 0),
        "rev/s": (_TURN, 0),
    },
    "m": {"m": (1, 0), "cm": (1e-2, 0), "mm": (1e-3, 0), "um": (1e-6, 0), "in": (0.0254, 0)},
    "m/s": {"m/s": (1, 0), "cm/s": (1e-2, 0), "mm/s": (1e-3, 0), "um/s": (1e-6, 0), "in/s": (0.0254, 0)},
    "A": {"A": (1, 0), "mA": (1e-3, 0), "uA": (1e-6, 0)},
    "N m": {"N m": (1, 0), "Nm": (1, 0), "N·m": (1, 0), "N*m": (1, 0), "mNm": (1e-3, 0), "kNm": (1e3, 0)},
    "N": {"N": (1, 0), "mN": (1e-3, 0), "kN": (1e3, 0)},
    "degC": {"degC": (1, 0), "C": (1, 0), "K": (1, -273.15), "degF": (5 / 9, -160 / 9)},
}
"""SI unit -> spelling in a mapping -> (factor, offset)."""

TIME_UNITS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}


@dataclass(frozen=True, slots=True)
class Source:
    """Where one channel comes from, and what turns its numbers into SI: ``factor * raw + offset``.

    Parameters
    ----------
    topic, field, names : str or None
        For messages: the topic, the field (``[]`` runs along the joints) and the field that names the joints.
    columns : mapping of str to (str or int)
        For tables: joint -> column, by name or by number from 0. With a topic: joint -> field, ``position[3]`` say.
    rename : mapping of str to str
        The log's name of a joint -> the name wanted.
    """

    topic: str | None = None
    field: str | None = None
    names: str | None = None
    columns: Map[str, str | int] = dataclasses.field(default_factory=dict)
    rename: Map[str, str] = dataclasses.field(default_factory=dict)
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Mapping:
    """How the logs of one robot are read.

    `time_ns` is the length of a tick of a numeric clock [ns], `epoch_ns` its epoch; `epoch_name` says how the epoch is
    written in a file's name (``time_epoch_name = "ur-%y_%m_%d"``), for loggers that count from their own start.
    """

    path: str
    robot: str
    sources: Map[str, Source]
    axis: Axis = "rotary"
    time: str | int | None = None
    time_ns: int = 1_000_000_000
    epoch_ns: int = 0
    joint: str | int | None = None
    epoch_name: str = ""

    def epoch_of(self, path: str) -> int:
        """Epoch of a file's clock [ns]: the date in its name where the mapping says how that is written.

        Parameters
        ----------
        path : str

        Examples
        --------
        >>> Mapping("m.toml", "arm", {}, epoch_name="ur-%y_%m_%d").epoch_of("data/ur-19_09_27-p1.csv")
        1569542400000000000
        """
        if not self.epoch_name:
            return self.epoch_ns
        pattern = re.sub(r"%[Yymd%HMS]", lambda found: _DIGITS[found.group()], re.escape(self.epoch_name))
        found = re.search(pattern, Path(path).stem)
        try:
            return _epoch_ns(dt.datetime.strptime(found.group() if found else "", self.epoch_name), path)
        except ValueError as error:
            what = f"has no date written {self.epoch_name!r} in its name"
            raise UnusableInputError(path, what, "rename it, or give time_epoch instead of time_epoch_name") from error

    def topics(self) -> set[str]:
        """Topics that the mapping names."""
        return {source.topic for source in self.sources.values() if source.topic}

    @property
    def tabular(self) -> bool:
        """Whether the mapping speaks of columns."""
        return any(source.columns and not source.topic for source in self.sources.values()) or self.joint is not None


def load_mapping(path: str | Path) -> Mapping:
    """Read a mapping file.

    Parameters
    ----------
    path : str or Path
        A TOML file, ``schema = "gsfdi/mapping/1"``.

    Returns
    -------
    Mapping

    Raises
    ------
    UnusableInputError
        The file cannot be read, or an entry is unknown or of the wrong kind.
    """
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UnusableInputError(path, f"cannot be read: {error.strerror}", "check the path") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UnusableInputError(path, f"is not TOML: {error}", "correct the line named") from error
    return parse(content, str(path))


def parse(content: Map[str, Any], path: str = "mapping") -> Mapping:
    """Turn the content of a mapping file into a `Mapping`.

    Parameters
    ----------
    content : mapping
        As `tomllib` reads it.
    path : str
        What to call it in complaints.
    """
    if content.get("schema") != SCHEMA:
        raise UnusableInputError(path, f"schema is {content.get('schema')!r}", f"write schema = {SCHEMA!r}")
    tables = {key: value for key, value in content.items() if isinstance(value, dict)}
    for key in content:
        known = [*_HEAD, *CHANNEL_OF_COLUMN]
        if key not in known or (key in CHANNEL_OF_COLUMN and key not in tables):
            raise UnusableInputError(path, f"knows no entry {key!r}", nearest(key, known))
    if not tables:
        raise UnusableInputError(path, "maps no column", "add a table such as [position_rad]")
    axes = {axis for axis in (CHANNEL_OF_COLUMN[column][1] for column in tables) if axis}
    if len(axes) > 1:
        raise UnusableInputError(path, "mixes rotary and linear columns", "write one mapping for each kind of joint")
    axis = axes.pop() if axes else "rotary"
    if content.get("time_unit", "s") not in TIME_UNITS:
        raise UnusableInputError(path, f"time_unit is {content['time_unit']!r}", f"use one of {', '.join(TIME_UNITS)}")
    return Mapping(
        path=path,
        robot=str(content.get("robot", UNNAMED)),
        sources={CHANNEL_OF_COLUMN[column][0]: _source(table, column, axis, path) for column, table in tables.items()},
        axis=axis,
        time=content.get("time"),
        time_ns=TIME_UNITS[content.get("time_unit", "s")],
        epoch_ns=_epoch_ns(content.get("time_epoch", 0), path),
        joint=content.get("joint"),
        epoch_name=str(content.get("time_epoch_name", "")),
    )


_DIGITS = {f"%{code}": r"\d{2}" for code in "ymdHMS"} | {"%Y": r"\d{4}", "%%": "%"}
_HEAD = ("schema", "robot", "time", "time_unit", "time_epoch", "time_epoch_name", "joint")
_KEYS = ("topic", "field", "names", "unit", "scale", "offset", "rename", "columns", "column")


def _source(table: Map[str, Any], column: str, axis: Axis, path: str) -> Source:
    for key in table:
        if key not in _KEYS:
            raise UnusableInputError(path, f"[{column}] knows no entry {key!r}", nearest(key, _KEYS))
    columns = table.get("columns", {})
    if "column" in table:  # a long table: one column for all joints, told apart by the column `joint`
        columns = {"": table["column"]}
    if not columns and not ("topic" in table and "field" in table):
        raise UnusableInputError(
            path, f"[{column}] says neither topic and field nor columns", "give topic and field, or columns"
        )
    if not isinstance(columns, dict) or not all(isinstance(value, (str, int)) for value in columns.values()):
        raise UnusableInputError(
            path, f"[{column}] columns is {columns!r}", "write columns = { J1 = 'name' } or a number"
        )
    unit = CHANNELS[CHANNEL_OF_COLUMN[column][0]].unit(axis)
    spellings = _UNITS[unit]
    given = str(table.get("unit", unit))
    if given not in spellings:
        raise UnusableInputError(path, f"[{column}] unit is {given!r}", nearest(given, spellings))
    factor, offset = spellings[given]
    scale = float(table.get("scale", 1.0))
    return Source(
        topic=table.get("topic"),
        field=table.get("field"),
        names=table.get("names"),
        columns=columns,
        rename=table.get("rename", {}),
        factor=factor * scale,
        offset=offset * scale + float(table.get("offset", 0.0)),
    )


def _epoch_ns(value: object, path: str) -> int:
    """Epoch of a table's clock [ns]: a date, or seconds since 1970."""
    try:
        if isinstance(value, str):
            value = dt.datetime.fromisoformat(value)
        if isinstance(value, dt.datetime):
            whole = value if value.tzinfo else value.replace(tzinfo=dt.UTC)
            since = whole - dt.datetime(1970, 1, 1, tzinfo=dt.UTC)
            return (since.days * 86_400 + since.seconds) * 1_000_000_000 + since.microseconds * 1_000
        if isinstance(value, dt.date):
            return (value - dt.date(1970, 1, 1)).days * 86_400_000_000_000
        return round(float(str(value)) * 1e9)
    except ValueError as error:
        raise UnusableInputError(
            path, f"time_epoch is {value!r}", "write a date such as 2026-11-21T00:00:00Z"
        ) from error
