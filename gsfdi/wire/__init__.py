"""From the bytes of a log to columns of numbers: what the readers share, and the decoders of each encoding."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from gsfdi.channels import Axis
from gsfdi.types import Array, Problem

Stamps: TypeAlias = npt.NDArray[np.int64]


class Key(NamedTuple):
    """Whose channel a column of numbers is; a channel read twice is taken from the source of lowest `rank`."""

    robot: str
    joint: str
    channel: str
    axis: Axis = "rotary"
    rank: int = 0


@dataclass(frozen=True, slots=True)
class Columns:
    """Rows that share a clock, in the order of the file.

    Parameters
    ----------
    origin : str
        Topic or file that the rows come from.
    time_ns : (n,) array of int64
        Stamps as the file has them [ns].
    values : mapping of Key to (n,) array
        In SI; NaN where a row says nothing.
    faults : mapping of str to int
        Rows that could not be read, by kind.
    """

    origin: str
    time_ns: Stamps
    values: Mapping[Key, Array]
    faults: Mapping[str, int] = field(default_factory=dict)


Item: TypeAlias = Columns | Problem
