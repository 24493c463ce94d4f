"""What is kept of a long recording for its page: every sample of a short one, evenly thinned ones of a long one."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gsfdi.types import Array, JointRecord, Mask

MOST = 30_000
"""From this many to twice as many samples are kept: five minutes at 100 Hz are kept whole."""


class Overview:
    """Successive pieces of one joint, kept in bounded memory.

    The thinning keeps every k-th sample; k doubles whenever more than twice `MOST` samples would come together, so that
    what is kept is even over the whole time. Its memory is taken once: the few samples that each piece of a week leaves
    would else lie scattered over the heap, and hold more of it than is in them.
    """

    def __init__(self) -> None:
        self._stride, self._samples, self._count = 1, 0, 0
        self._head: JointRecord | None = None
        self._t = np.empty(2 * MOST)
        self._channels: dict[str, Array] = {}
        self._valid: dict[str, Mask] = {}
        self._quality: dict[str, dict[str, float]] = {}

    @property
    def samples(self) -> int:
        """Samples that went by."""
        return self._samples

    def add(self, piece: JointRecord) -> None:
        """Take in one more piece.

        Parameters
        ----------
        piece : JointRecord
            Later than all before it.
        """
        if self._head is None:
            self._head = replace(piece, t=np.empty(0), channels={}, valid={}, quality={})
        self._tell(piece.quality)
        while self._count + len(self._picked(piece)) > len(self._t):
            self._halve()
        at = self._picked(piece)
        pick, place = slice(at.start, None, at.step), slice(self._count, self._count + len(at))
        self._t[place] = piece.t[pick] + (piece.t0_ns - self._head.t0_ns) * 1e-9
        _put(self._channels, piece.channels, pick, place, np.nan)
        _put(self._valid, piece.valid, pick, place, True)
        self._count += len(at)
        self._samples += len(piece.t)

    def record(self) -> JointRecord:
        """All that was kept, as one record."""
        if self._head is None:
            raise ValueError("nothing was added yet")
        kept = slice(self._count)
        return replace(
            self._head, t=self._t[kept], channels={name: values[kept] for name, values in self._channels.items()},
            valid={name: mask[kept] for name, mask in self._valid.items()},
            quality={name: dict(counts) for name, counts in self._quality.items()},
        )  # fmt: skip

    def _picked(self, piece: JointRecord) -> range:
        """Places of the samples of a piece that the thinning keeps."""
        return range(-self._samples % self._stride, len(piece.t), self._stride)

    def _halve(self) -> None:
        """Keep every other sample of what was kept."""
        left = -(-self._count // 2)
        for kept in (self._t, *self._channels.values(), *self._valid.values()):
            kept[:left] = kept[: self._count : 2].copy()
        self._stride, self._count = 2 * self._stride, left

    def _tell(self, quality: Mapping[str, Mapping[str, float]]) -> None:
        """Add what is told of a piece to what was told before."""
        for name, counts in quality.items():
            kept = self._quality.setdefault(name, {})
            for kind, count in counts.items():
                merge = max if kind.startswith(("longest", "rate")) else float.__add__
                kept[kind] = float(merge(float(kept.get(kind, 0.0)), float(count)))


def _put(
    kept: dict[str, npt.NDArray[Any]], new: Mapping[str, npt.NDArray[Any]], pick: slice, place: slice, none: float
) -> None:
    """Put picked samples of every name in their place, and `none` where a name was not or is not there."""
    for name, values in new.items():
        if name not in kept:
            kept[name] = np.empty(2 * MOST, values.dtype)
            kept[name][: place.start] = none
    for name, held in kept.items():
        held[place] = new[name][pick] if name in new else none
