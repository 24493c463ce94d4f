"""The night's settings: a TOML file in, frozen and checked settings out.

Paths are taken from the folder of the file, so that cron's working folder does not matter.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

from gsfdi.errors import UnusableInputError, nearest

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
    stale_after_days : float
        A joint of the baseline whose newest telemetry is older than this is ``stale`` [d].
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
    stale_after_days: float = 7.0
    reconcile: bool = True
    reports: tuple[str, ...] = ()


_PATHS = ("inbox", "out", "store", "model")
_KINDS: Mapping[str, tuple[type, ...]] = {
    "jobs": (int,),
    "settle_s": (int, float),
    "stale_after_days": (int, float),
    "reconcile": (bool,),
    "mappings": (list,),
    "joints": (list,),
    "reports": (list,),
}
"""What TOML gives for a key; text for all others."""
_SPOKEN = {int: "a whole number", float: "a number", bool: "true or false", list: "a list of texts", str: "a text"}
LEVELS = ("warning", "distress", "critical")


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
        The file cannot be read, or a key or value in it cannot be used.
    """
    content = read_toml(path)
    schema = content.pop("schema", SCHEMA)
    if schema != SCHEMA:
        raise UnusableInputError(path, f"schema {schema!r} is not {SCHEMA!r}", f"write schema = {SCHEMA!r}")
    known = {field.name: field for field in fields(Night)}
    for key in content:
        if key not in known:
            raise UnusableInputError(path, f"no setting is called {key!r}", nearest(key, known))
    for key, field in known.items():
        if field.default is MISSING and key not in content:
            raise UnusableInputError(path, f"{key!r} is missing", f'write {key} = "a folder"')
    home = path.absolute().parent
    values = {key: _value(path, home, key, value) for key, value in content.items()}
    return Night(**{"store": home / "store", **values})


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file, or say in which line it goes wrong.

    Parameters
    ----------
    path : Path
        The file.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UnusableInputError(path, f"cannot be read: {error.strerror}", "check the path") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UnusableInputError(path, f"is no TOML: {error}", "mend that line") from error


def _value(path: Path, home: Path, key: str, value: Any) -> Any:
    kinds = _KINDS.get(key, (str,))
    if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
        raise UnusableInputError(path, f"{key} = {value!r} is not {_SPOKEN[kinds[-1]]}", "mend that value")
    if isinstance(value, list):
        if not all(isinstance(item, str) for item in value):
            raise UnusableInputError(path, f"{key} = {value!r} is not a list of texts", "mend that value")
        return tuple(home / item if key == "mappings" else item for item in value)
    if key in _PATHS:
        return home / Path(value).expanduser()
    if key == "fail_on" and value not in LEVELS:
        raise UnusableInputError(path, f"no level is called {value!r}", nearest(value, LEVELS))
    if isinstance(value, int | float) and (value < 0 or (key == "jobs" and value < 1)):
        raise UnusableInputError(path, f"{key} = {value} is too small", "give a larger one")
    return value
