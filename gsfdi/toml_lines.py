"""In which line of a TOML file a key stands, and complaints that say so."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gsfdi.errors import UnusableInputError, nearest

Key = tuple[str | int, ...]
_HEADER = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_ENTRY = re.compile(r"""^\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")
_PART = re.compile(r"""[\w-]+|"[^"]*"|'[^']*'""")


def read(path: Path) -> tuple[dict[str, Any], dict[Key, int]]:
    """Read a TOML file.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    document : dict
        What it holds.
    lines : dict of tuple to int
        Line of every table and key, from 1; entries of an array of tables are numbered from 0.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise UnusableInputError(path, error.strerror or "cannot be read", "check the path") from None
    except UnicodeDecodeError:
        raise UnusableInputError(path, "is not a text file", "give a TOML file in UTF-8") from None
    try:
        return tomllib.loads(text), lines_of(text)
    except tomllib.TOMLDecodeError as error:
        raise UnusableInputError(path, f"is not TOML: {error}", "mend that line") from None


def lines_of(text: str) -> dict[Key, int]:
    r"""Find the line of every table and key.

    Examples
    --------
    >>> lines_of('name = "a"\n[plant]\ngear_ratio = 2\n[[physics]]\nterm = "cogging"')
    {('name',): 1, ('plant',): 2, ('plant', 'gear_ratio'): 3, ('physics', 0): 4, ('physics', 0, 'term'): 5}
    """
    lines: dict[Key, int] = {}
    table: Key = ()
    counts: dict[Key, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = tuple(part.strip("\"'") for part in _PART.findall(header[2]))
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
            elif table[:-1] in counts:  # a table within the latest entry of an array
                table = (*table[:-1], counts[table[:-1]], table[-1])
            lines.setdefault(table, number)
        elif entry := _ENTRY.match(line):
            key = (*table, *(part.strip("\"'") for part in _PART.findall(entry[1])))
            lines.setdefault(key, number)
    return lines


class Place:
    """A table of a TOML file that is being checked: its values, where they stand, and how to complain of one.

    Parameters
    ----------
    path : Path
        The file.
    table : mapping
        The values.
    lines : dict of tuple to int
        From `read`.
    key : tuple
        Where in the document the table is.
    """

    def __init__(self, path: Path, table: Mapping[str, Any], lines: dict[Key, int], key: Key = ()) -> None:
        self.path, self.table, self.lines, self.key = path, table, lines, key

    def error(self, key: str | None, what: str, mend: str) -> UnusableInputError:
        """Say what is wrong with `key`, or with the whole table, in which line."""
        at = self.key if key is None else (*self.key, key)
        while at and at not in self.lines:
            at = at[:-1]
        line = f":{self.lines[at]}" if at else ""
        name = ".".join(str(part) for part in (*self.key, *([] if key is None else [key])))
        return UnusableInputError(f"{self.path}{line}", f"{name}: {what}" if name else what, mend)

    def inside(self, key: str) -> "Place":
        """Go into the table called `key`; it is empty where the file has none."""
        value = self.table.get(key, {})
        if not isinstance(value, dict):
            raise self.error(key, "is not a table", f"write it as [{'.'.join(map(str, (*self.key, key)))}]")
        return Place(self.path, value, self.lines, (*self.key, key))

    def entries(self, key: str) -> list["Place"]:
        """Go into each entry of the array of tables called `key`."""
        value = self.table.get(key, [])
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            raise self.error(key, "is not an array of tables", f"write each entry under [[{key}]]")
        return [Place(self.path, entry, self.lines, (*self.key, key, i)) for i, entry in enumerate(value)]

    def known(self, names: "list[str] | tuple[str, ...]") -> None:
        """Refuse keys that are not among `names`."""
        for key in self.table:
            if key not in names:
                raise self.error(key, "no such key", nearest(key, names))

    def number(self, key: str, low: float, high: float, *, above: bool = False) -> float:
        """Read the number `key` within [low, high]; `above` refuses `low` itself."""
        value = self.table[key]
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, f"{value!r} is not a number", "write a plain number in the unit that the name says")
        if not low <= value <= high or (above and value == low):
            least = f"above {low:g}" if above else f"at least {low:g}"
            raise self.error(key, f"{value!r} is impossible", f"give a value {least} and at most {high:g}")
        return float(value)

    def choice(self, key: str, options: tuple[str, ...], default: str | None = None) -> str:
        """Read `key` as one of `options`."""
        value = self.table.get(key, default)
        if value not in options:
            raise self.error(key, f"{value!r} is not known", nearest(str(value), options))
        return str(value)
