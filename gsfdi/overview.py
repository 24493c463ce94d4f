"""What is kept of a long recording for its page: every sample of a short one, evenly thinned ones of a long one."""

from collections.abc import Mapping

import numpy as np

from gsfdi.types import Array, JointRecord, frozen

MOST = 30_000
"""From this many to twice as many samples are kept: five minutes at 100 Hz are kept whole."""


class Overview:
    """Successive pieces of one joint, kept in bounded memory.

    The thinning keeps every k-th sample; k doubles whenever twice `MOST` samples have come together, so that what is
    kept is even over the whole time.
    """

    def __init__(self) -> None:
        self._stride = 1
        self._samples = 0
        self._parts: list[JointRecord] = []
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
        for name, counts in piece.quality.items():
            kept = self._quality.setdefault(name, {})
            for kind, count in counts.items():
                merge = max if kind.startswith(("longest", "rate")) else float.__add__
                kept[kind] = float(merge(float(kept.get(kind, 0.0)), float(count)))
        self._parts.append(_every(piece, -self._samples % self._stride, self._stride))
        self._samples += len(piece.t)
        while sum(len(part.t) for part in self._parts) > 2 * MOST:
            self._stride *= 2
            self._parts = [_every(self.record(), 0, 2)]

    def record(self) -> JointRecord:
        """All that was kept, as one record."""
        first = self._parts[0]
        t = [part.t + (part.t0_ns - first.t0_ns) * 1e-9 for part in self._parts]
        names = list(dict.fromkeys(name for part in self._parts for name in part.channels))
        channels = {name: np.concatenate([_channel(part, name) for part in self._parts]) for name in names}
        valid = {
            name: np.concatenate([part.valid.get(name, np.ones(len(part.t), bool)) for part in self._parts])
            for name in dict.fromkeys(name for part in self._parts for name in part.valid)
        }
        return JointRecord(
            first.robot, first.joint, first.t0_ns, np.concatenate(t), channels, first.axis, valid, first.source,
            first.sha256, _frozen(self._quality),
        )  # fmt: skip


def _every(record: JointRecord, start: int, stride: int) -> JointRecord:
    if stride == 1 and start == 0:
        return record
    pick = slice(start, None, stride)
    return JointRecord(
        record.robot, record.joint, record.t0_ns, frozen(record.t[pick]),  # copies, so that the whole can go
        {name: frozen(values[pick]) for name, values in record.channels.items()}, record.axis,
        {name: mask[pick].copy() for name, mask in record.valid.items()}, record.source, record.sha256, record.quality,
    )  # fmt: skip


def _channel(record: JointRecord, name: str) -> Array:
    return record.channels[name] if name in record.channels else np.full(len(record.t), np.nan)


def _frozen(quality: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    return {name: dict(counts) for name, counts in quality.items()}
