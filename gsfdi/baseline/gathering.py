"""One pass of all detectors over a batch, in pieces, so that a day is judged without holding a day."""

from collections.abc import Iterable, Iterator, Mapping
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


def gather(
    pieces: Iterable[JointRecord],
    nominal: Nominal,
    settings: Mapping[str, Mapping[str, float]] | None = None,
    usual: float | None = None,
) -> tuple[dict[str, dict[str, Array]], float]:
    """One pass over a batch, in pieces: every detector's numbers, and the seconds they saw.

    Parameters
    ----------
    pieces : iterable of JointRecord
        Successive pieces of one batch of one joint; ``t0_ns`` of each places it in time.
    nominal : Nominal
        The joint's nominal model.
    settings : mapping of str to mapping of str to float, optional
        Changed knobs by detector.
    usual : float, optional
        Mean weighted square of the fault-free innovations. With it, what lies beyond the first `WHOLE` seconds is
        scored in part only: every fiftieth slab, and each whose innovations are not as usual.
    """
    run = observer(nominal)
    quick = screen(run)
    tallies: dict[str, Tally] = {
        name: one.tally(nominal, {**one.settings, **((settings or {}).get(name) or {})})
        for name, one in detectors().items()
    }
    seconds = scored = 0.0
    for slab in slabs_of(pieces, nominal):
        length = slab.step * len(slab.trusted)
        seconds += length
        beyond = scored > WHOLE + SHARE * seconds
        if usual is not None and beyond and loudness(nominal, quick, slab, BY_KEY) < UNUSUAL * usual:
            continue
        scored += length
        seen = watch(nominal, run, slab, BY_KEY)
        for tally in tallies.values():
            tally.add(seen)
    return {name: tally.numbers() for name, tally in tallies.items()}, seconds


def slabs_of(pieces: Iterable[JointRecord], nominal: Nominal) -> Iterator[Stretch]:
    """Slabs of a batch on which the nominal joint's observer can run, with time counted from its first piece."""
    first = None
    for piece in pieces:
        first = piece.t0_ns if first is None else first
        late = (piece.t0_ns - first) * 1e-9
        extra = tuple(name for name in EXTRA if name in piece and np.isfinite(piece[name]).any())
        for part in cut(piece, nominal, extra):
            yield from slabs(part._replace(start=part.start + late))


def slabs(part: Stretch) -> Iterator[Stretch]:
    """Cut a long stretch into slabs of `SLAB` seconds, the last one longer."""
    size, n = max(round(SLAB / part.step), 400), len(part.trusted)
    edges = [*range(0, max(n - size, 1), size), n]
    for low, high in pairwise(edges):
        values = {name: some[low:high] for name, some in part.values.items()}
        yield Stretch(part.start + low * part.step, part.step, values, part.trusted[low:high])
