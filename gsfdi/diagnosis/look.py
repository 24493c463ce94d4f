"""What can be said of a batch while it passes by: names, time, and how much of it may be believed."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from gsfdi.clock import LEFT_OUT
from gsfdi.types import Array, JointRecord


class Look:
    """Watches the pieces of a batch pass by.

    Parameters
    ----------
    needs : sequence of str
        Channels that a verdict needs.
    """

    def __init__(self, needs: Sequence[str]) -> None:
        self.joint, self.end_ns = "", 0
        self.samples, self.believed = Counter[str](), Counter[str]()
        self.needs = needs
        self.missing: list[str] = []

    @property
    def share(self) -> float:
        """How much of the worst channel that a verdict needs may be believed, rows without a time counted in."""
        return min((self.believed[name] / rows for name, rows in self.samples.items() if rows), default=1.0)

    def take(self, piece: JointRecord) -> bool:
        """Count what of `piece` may be believed, and say whether it carries every channel needed."""
        self._count(piece)
        lacking = [name for name in self.needs if name not in piece]
        self.missing += [name for name in lacking if name not in self.missing]
        return not lacking

    def _count(self, piece: JointRecord) -> None:
        """Count what may be believed, and note how far it goes."""
        self.joint = piece.joint
        if len(piece.t):
            self.end_ns = piece.t0_ns + round(float(piece.t[-1]) * 1e9)
        clock = piece.quality.get("time", {})
        lost = round(sum(clock.get(kind, 0.0) for kind in LEFT_OUT))
        for name in {"position", piece.effort, *self.needs} & set(piece.channels):
            self.samples[name] += samples_of(piece.channels[name]) + lost
            self.believed[name] += int(np.isfinite(piece[name]).sum())


def samples_of(values: Array) -> int:
    """How many samples a channel should have: a slower one leaves even holes, samples lost leave uneven ones."""
    lacking = np.isnan(values)
    if not lacking.any():
        return len(values)
    steps = np.diff(np.flatnonzero(~lacking))
    even = len(steps) > 0 and float(np.mean(steps == np.median(steps))) > 0.8
    return len(steps) + 1 if even else len(values)
