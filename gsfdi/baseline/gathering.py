"""One pass of all detectors over a batch, in pieces, so that a day is judged without holding a day."""

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from gsfdi.detectors import Detector, Tally
from gsfdi.healthy import BY_KEY, EXTRA, cut
from gsfdi.nominal import Nominal, loudness, observer, screen, watch
from gsfdi.registry import shelf
from gsfdi.stretches import Stretch
from gsfdi.types import Array, JointRecord

SLAB = 60.0
"""Long stretches are taken in slabs of this length [s]."""
WHOLE = 900.0
"""Seconds of a batch that are always scored in full."""
SHARE = 0.02
"""Share of a longer batch that is scored in full however usual it is.

A batch cannot be judged more surely than the baseline was learnt: the error of a fault's size goes with the root of one
over the seconds scored plus one over those learnt from, of which there are minutes. Every fiftieth minute of a day, and
the first quarter of an hour, are already more than that."""
UNUSUAL = 1.25
"""Times the usual power of the innovations at which a slab is scored whatever the length of the batch.

Chance alone moves the power of six thousand samples by about one hundredth, a fault of fifty deviations in the slab by
a quarter. What is fainter and lasts is found in the slabs that are scored anyway."""


def detectors() -> dict[str, Detector]:
    """Every detector of the shelf, by name."""
    return shelf("gsfdi.detectors", Detector)


class Gathering:
    """One joint's batch as it comes in, piece by piece: every detector's numbers, and the seconds they saw.

    Parameters
    ----------
    nominal : Nominal
        The joint's nominal model.
    settings : mapping of str to mapping of str to float, optional
        Changed knobs by detector.
    usual : float, optional
        Mean weighted square of the fault-free innovations. With it, what lies beyond the first `WHOLE` seconds is
        scored in part only: every fiftieth slab, and each whose innovations are not as usual.
    """

    def __init__(
        self,
        nominal: Nominal,
        settings: Mapping[str, Mapping[str, float]] | None = None,
        usual: float | None = None,
    ) -> None:
        self._nominal, self._usual = nominal, usual
        self._run = observer(nominal)
        self._quick = screen(self._run)
        self._tallies: dict[str, Tally] = {
            name: one.tally(nominal, {**one.settings, **((settings or {}).get(name) or {})})
            for name, one in detectors().items()
        }
        self._first_ns: int | None = None
        self._scored = 0.0
        self.seconds = 0.0

    def add(self, piece: JointRecord) -> None:
        """Take in one more piece; its ``t0_ns`` places it in time.

        Parameters
        ----------
        piece : JointRecord
            Later than all before it.
        """
        self._first_ns = piece.t0_ns if self._first_ns is None else self._first_ns
        for part in parts_of(piece, self._nominal, self._first_ns):
            for slab in self._chosen(part):
                seen = watch(self._nominal, self._run, slab, BY_KEY)
                for tally in self._tallies.values():
                    tally.add(seen)

    def numbers(self) -> dict[str, dict[str, Array]]:
        """What every detector has gathered so far."""
        return {name: tally.numbers() for name, tally in self._tallies.items()}

    def _chosen(self, part: Stretch) -> Iterator[Stretch]:
        """Slabs of a stretch that are scored: all until enough was, then some, and those that are not quiet."""
        edges = edges_of(part)
        loud: Array | None = None
        for place, (low, high) in enumerate(pairwise(edges)):
            length = part.step * (high - low)
            self.seconds += length
            if self._usual is not None and self._scored > WHOLE + SHARE * self.seconds:
                loud = loudness(self._nominal, self._quick, part, BY_KEY, edges) if loud is None else loud
                if loud[place] < UNUSUAL * self._usual:
                    continue
            self._scored += length
            yield part.between(low, high)


def parts_of(piece: JointRecord, nominal: Nominal, since_ns: int) -> Iterator[Stretch]:
    """Stretches of a piece on which the nominal joint's observer can run, with time counted from `since_ns`.

    Parameters
    ----------
    piece : JointRecord
    nominal : Nominal
    since_ns : int
        Start of the batch [ns].
    """
    late = (piece.t0_ns - since_ns) * 1e-9
    extra = tuple(name for name in EXTRA if name in piece and np.isfinite(piece[name]).any())
    for part in cut(piece, nominal, extra):
        yield part._replace(start=part.start + late)


def edges_of(part: Stretch) -> list[int]:
    """Where a stretch is cut into slabs of `SLAB` seconds, the last one longer.

    Parameters
    ----------
    part : Stretch
    """
    size, n = max(round(SLAB / part.step), 400), len(part.trusted)
    return [*range(0, max(n - size, 1), size), n]
