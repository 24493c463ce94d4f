"""Finds the object that each file of a shelf offers, so that adding to a shelf touches one file."""

import importlib
import pkgutil
from functools import cache
from typing import Protocol, TypeVar


class Named(Protocol):
    """Anything that a shelf can hold."""

    @property
    def name(self) -> str:
        """What it is called in files and on the command line."""


T = TypeVar("T", bound=Named)


@cache
def shelf(package: str, kind: type[T]) -> dict[str, T]:
    """Every object of `kind` that the modules of `package` end in, by its ``name``.

    Parameters
    ----------
    package : str
        Dotted name of the shelf, for example ``"gsfdi.terms"``.
    kind : type
        Class of the frozen object that a shelf file offers.

    Returns
    -------
    dict of str to object
        Sorted by the name of the file.
    """
    home = importlib.import_module(package)
    found: dict[str, T] = {}
    for info in sorted(pkgutil.iter_modules(home.__path__), key=lambda module: module.name):
        module = importlib.import_module(f"{package}.{info.name}")
        for value in vars(module).values():
            if isinstance(value, kind):
                found[value.name] = value
    return found
