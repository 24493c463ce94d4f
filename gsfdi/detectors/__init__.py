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
    """Sums over bins of time that merge in pairs when they grow too many, so that memory stays flat."""

    def __init__(self, width: float) -> None:
        self.width = width
        self.sums: dict[str, Array] = {}

    def place(self, t: Array) -> tuple[npt.NDArray[np.int64], int]:
        """Bin of each time, and how many bins there are now."""
        while t[-1] / self.width >= BINS:
            self.width *= 2.0
            self.sums = {
                name: np.add.reduceat(kept, np.arange(0, len(kept), 2), axis=0) for name, kept in self.sums.items()
            }
        bins = np.floor(t / self.width).astype(np.int64)
        return bins, int(bins[-1]) + 1

    def add(self, name: str, values: Array) -> None:
        """Add sums that begin at bin 0."""
        kept = self.sums.get(name)
        if kept is None:
            self.sums[name] = values.copy()
        elif len(kept) >= len(values):
            kept[: len(values)] += values
        else:
            grown = values.copy()
            grown[: len(kept)] += kept
            self.sums[name] = grown
