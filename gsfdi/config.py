"""The night's settings: a TOML file in, frozen and checked settings out.

Paths are taken from the folder of the file, so that cron's working folder does not matter.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gsfdi.options import LEVELS
from gsfdi.toml_lines import Place, read

SCHEMA = "gsfdi/nightly/1"


@dataclass(frozen=True, slots=True)
class Night:
    """What ``gsfdi nightly`` works with.

    Parameters
    ----------
    inbox : Path
        Folder in which new recordings appear; nothing in it is changed.
    out : Path
        Folder that gets one dated folder a night, and the history.
    store : Path
        The store.
    mappings : tuple of Path
        Mapping files of odd logs.
    model : Path or None
        Model of the arm; reconcile needs it.
    baseline : str
        Name of the baseline to judge against.
    joints : tuple of str
        Joints wanted; all if empty.
    jobs : int or None
        Processes at most; as many as there are processors unless given.
    scheduler : str or None
        Address of a Dask cluster.
    fail_on : str or None
        Level of a verdict from which the exit status is 1.
    settle_s : float
        A file changed less than this ago is left for the next run, as it may still be arriving [s].
    stale_after_days : float or None
        A joint of the baseline whose newest telemetry is older than this is ``stale`` [d]; None for never.
    reconcile : bool
        Whether joints that alarm are handed to reconcile, so that the verdict names a cause.
    reports : tuple of str
        Reports beyond the usual three, by name.
    """

    inbox: Path
    out: Path
    store: Path = Path("store")
    mappings: tuple[Path, ...] = ()
    model: Path | None = None
    baseline: str = "default"
    joints: tuple[str, ...] = ()
    jobs: int | None = None
    scheduler: str | None = None
    fail_on: str | None = None
    settle_s: float = 0.0
    stale_after_days: float | None = None
    reconcile: bool = True
    reports: tuple[str, ...] = ()


YEAR = 366.0


def load_night(path: Path) -> Night:
    """Read the night's settings.

    Parameters
    ----------
    path : Path
        A TOML file.

    Returns
    -------
    Night
        Settings with paths made absolute.

    Raises
    ------
    UnusableInputError
        The file cannot be read, or a key or value in it cannot be used: with file, line, key and what would mend it.
    """
    content, lines = read(path)
    place = Place(path, content, lines)
    place.known(["schema", *Night.__dataclass_fields__])
    place.choice("schema", (SCHEMA,), SCHEMA)
    home = path.absolute().parent
    found: dict[str, Any] = {"store": home / "store"}
    for key in content.keys() - {"schema"}:
        found[key] = _value(place, key, home)
    for key in ("inbox", "out"):
        if key not in found:
            raise place.error(key, "is missing", f'write {key} = "a folder"')
    return Night(**found)


def _value(place: Place, key: str, home: Path) -> Any:
    if key in ("inbox", "out", "store", "model"):
        return home / Path(_text(place, key)).expanduser()
    if key == "mappings":
        return tuple(home / Path(one).expanduser() for one in _texts(place, key))
    if key in ("joints", "reports"):
        return _texts(place, key)
    if key == "jobs":
        return int(place.number(key, 1, 1024))
    if key == "settle_s":
        return place.number(key, 0, 86400.0)
    if key == "stale_after_days":
        return place.number(key, 0, 100 * YEAR, above=True)
    if key == "fail_on":
        return place.choice(key, LEVELS)
    if key == "reconcile":
        if not isinstance(place.table[key], bool):
            raise place.error(key, f"{place.table[key]!r} is neither true nor false", "write true or false")
        return place.table[key]
    return _text(place, key)


def _text(place: Place, key: str) -> str:
    value = place.table[key]
    if not isinstance(value, str) or not value:
        raise place.error(key, f"{value!r} is not a text", "write it in quotes")
    return value


def _texts(place: Place, key: str) -> tuple[str, ...]:
    value = place.table[key]
    if not isinstance(value, list) or not all(isinstance(item, str) and item for item in value):
        raise place.error(key, f"{value!r} is not a list of texts", 'write ["one", "another"]')
    return tuple(value)
