"""The shelf of detectors: each file ends in ``DETECTOR = Detector(...)``, and nothing else lists them.

A detector gathers numbers in one pass over a batch, in pieces, so that a day is analysed without holding a day;
learns from the numbers of several fault-free batches; and looks at those of a new one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from gsfdi.nominal import Nominal, Watched
from gsfdi.types import Array, Finding

Numbers = Mapping[str, Array]
"""What a detector keeps, by name: plain arrays, so that a store can hold them."""


class Tally(Protocol):
    """Gathers a detector's numbers, stretch by stretch."""

    def add(self, watched: Watched) -> None:
        """Take in one more stretch."""

    def numbers(self) -> dict[str, Array]:
        """Everything gathered so far."""


@dataclass(frozen=True, slots=True)
class Detector:
    """A way to see a fault.

    Parameters
    ----------
    name : str
        What it is called in settings and evidence.
    method : {'signal', 'parity', 'smi'}
        The paper's family to which it belongs.
    needs : tuple of str
        Channels without which it stays silent, beside position and effort.
    settings : mapping of str to float
        Its knobs and their usual values.
    tally : callable
        ``tally(nominal, settings)`` starts a pass over a batch.
    learn : callable
        ``learn(gathered, settings)`` from several fault-free batches.
    look : callable
        ``look(numbers, learnt, rate, settings)`` gives findings whose false-alarm rate per batch is `rate`; none where
        it cannot judge.
    false_alarm_rate : float
        Share of the battery's promised rate that it takes.
    source : str
        Where the method is written down.
    """

    name: str
    method: Literal["signal", "parity", "smi"]
    needs: tuple[str, ...]
    settings: Mapping[str, float]
    tally: Callable[[Nominal, Mapping[str, float]], Tally]
    learn: Callable[[Sequence[Numbers], Mapping[str, float]], dict[str, Array]]
    look: Callable[[Numbers, Numbers, float, Mapping[str, float]], Finding | None]
    false_alarm_rate: float
    source: str
    units: Mapping[str, str] = field(default_factory=dict)


BINS = 2048
"""Most bins of time that a tally keeps; beyond them neighbours are merged."""


class Binned:
    """Sums over bins of time that merge in pairs when they grow too many; their memory is taken once and stays."""

    def __init__(self, width: float) -> None:
        self.width = width
        self._count = 0
        self._kept: dict[str, Array] = {}

    @property
    def sums(self) -> dict[str, Array]:
        """The sums of every bin so far."""
        return {name: kept[: self._count].copy() for name, kept in self._kept.items()}

    def place(self, t: Array) -> tuple[npt.NDArray[np.int64], int, int]:
        """Bin of each time, counted from that of the first; which bin that is; and how many there are."""
        while t[-1] / self.width >= BINS:
            self.width *= 2.0
            self._count = -(-self._count // 2)
            for kept in self._kept.values():
                kept[: BINS // 2] = kept[::2] + kept[1::2]
                kept[BINS // 2 :] = 0.0
        bins = np.floor(t / self.width).astype(np.int64)
        first = int(bins[0])
        return bins - first, first, int(bins[-1]) - first + 1

    def add(self, name: str, values: Array, first: int) -> None:
        """Add sums that begin at bin `first`."""
        if name not in self._kept:
            self._kept[name] = np.zeros((BINS, *values.shape[1:]))
        self._kept[name][first : first + len(values)] += values
        self._count = max(self._count, first + len(values))
