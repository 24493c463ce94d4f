"""One telemetry format per file; each ends in a frozen `READER`.

A reader yields `gsfdi.wire.Columns`, as the file has them. What may be believed is judged later, once for all formats.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from gsfdi.mapping import Mapping
from gsfdi.wire import Item


@dataclass(frozen=True, slots=True)
class Reader:
    """A format.

    Parameters
    ----------
    name : str
        What it is called.
    sniff : callable
        First bytes of a file -> whether it is of this format.
    read : callable
        Path, mappings, and whether the file's seal holds (None without one) -> blocks and problems, in bounded memory.
    describe : callable
        Path and mappings -> what the file holds and how it would be read.
    """

    name: str
    sniff: Callable[[bytes], bool]
    read: Callable[[Path, Sequence[Mapping], bool | None], Iterator[Item]]
    describe: Callable[[Path, Sequence[Mapping]], dict[str, object]]
