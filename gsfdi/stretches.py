"""Evenly sampled stretches of a record: what every model-based method works on.

A sample that stands alone far off its neighbours is bridged and carries no weight: one flipped bit in a file without
checksums must not raise a verdict. What lasts is left in, since a fault lasts.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gsfdi.passes import alone, quantile, sampled
from gsfdi.types import Array, JointRecord, Mask, sealed

LONE = 30.0
"""A sample this many robust spreads off the mean of its neighbours stands alone."""
GAP = 8.0
"""A pause of more than this many usual spacings ends a stretch."""
JITTER = 0.02
"""Spacing that departs by more than this share from its median calls for interpolation."""


class Stretch(NamedTuple):
    """Channels at even spacing: `start` [s] in the record's time, `step` [s], and where every channel is trusted."""

    start: float
    step: float
    values: Mapping[str, Array]
    trusted: Mask

    @property
    def t(self) -> Array:
        """Time of each sample, in the record's time [s]."""
        return np.asarray(self.start + self.step * np.arange(len(self.trusted)), dtype=np.float64)

    def between(self, low: int, high: int) -> "Stretch":
        """Samples `low` up to before `high`."""
        values = {name: some[low:high] for name, some in self.values.items()}
        return Stretch(self.start + low * self.step, self.step, values, self.trusted[low:high])


def lone_samples(values: Array) -> Mask:
    """Where a single sample stands far off both of its neighbours, which agree with each other."""
    found = np.zeros(len(values), dtype=np.bool_)
    if len(values) < 5:
        return found
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(sampled(values[1:-1]) - 0.5 * (sampled(values[:-2]) + sampled(values[2:])))
        spread = 1.4826 * quantile(off, 0.5)
        if spread == 0.0:  # a channel that mostly rests on one quantum
            moving = off[off > 0]
            spread = np.median(moving) if len(moving) > 8 else 1e-9 * float(np.ptp(values) + 1e-30)
    alone(values, LONE * spread, False, found)
    return found


def sampling_step(records: Sequence[JointRecord]) -> float:
    """Usual spacing of the samples of several records [s]."""
    gaps = np.concatenate([np.diff(record.t) for record in records] or [np.zeros(0)])
    gaps = gaps[gaps > 0]
    return float(np.median(gaps)) if len(gaps) else float("nan")


def stretches(record: JointRecord, needs: Sequence[str], step: float, shortest: int = 50) -> Iterator[Stretch]:
    """Even stretches of a record in which every channel of `needs` runs on without a long pause.

    Parameters
    ----------
    record : JointRecord
    needs : sequence of str
        Channels; each is read where it may be believed.
    step : float
        Spacing wanted [s].
    shortest : int
        Stretches of fewer samples are passed over.
    """
    clocks: dict[bytes, tuple[Array, dict[str, Array]]] = {}
    rising = np.ones(len(record.t), dtype=np.bool_)
    rising[1:] = record.t[1:] > record.t[:-1]
    for name in needs:
        values = record[name]
        kept = np.isfinite(values) & rising
        lone = lone_samples(values if kept.all() else values[kept])
        if lone.any():
            kept[np.flatnonzero(kept)[lone]] = False
        whole = kept.all()  # as a rule, and then nothing is copied
        if kept.sum() < shortest:
            return
        clock = clocks.setdefault(kept.tobytes(), (record.t if whole else record.t[kept], {}))
        clock[1][name] = values if whole else values[kept]
    start, end = max(float(t[0]) for t, _ in clocks.values()), min(float(t[-1]) for t, _ in clocks.values())
    spans = [pause for t, _ in clocks.values() for pause in _pauses(t, step)]
    for low, high in _between(start, end, spans):
        if (high - low) / step + 1 >= shortest:
            yield _even(list(clocks.values()), low, high, step)


def _pauses(t: Array, step: float) -> list[tuple[float, float]]:
    """Where a clock stands still for long."""
    gaps = np.diff(t)
    longest = GAP * max(step, quantile(sampled(gaps), 0.5))
    return [(float(t[i]), float(t[i + 1])) for i in np.flatnonzero(gaps > longest)]


def _between(start: float, end: float, pauses: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Spans of ``[start, end]`` left when the pauses are cut out."""
    spans = []
    for low, high in sorted(pauses):
        if low > start:
            spans.append((start, min(low, end)))
        start = max(start, high)
        if start >= end:
            return spans
    spans.append((start, end))
    return spans


def _even(clocks: Sequence[tuple[Array, Mapping[str, Array]]], low: float, high: float, step: float) -> Stretch:
    """Channels between two times on an even grid, each as it was read where its clock is that grid."""
    count = int(np.floor((high - low) / step + 1e-6)) + 1
    grid: Array = low + step * np.arange(count, dtype=np.float64)
    trusted = np.ones(count, dtype=np.bool_)
    values: dict[str, Array] = {}
    for t, channels in clocks:
        inside = slice(*np.searchsorted(t, [low - 0.5 * step, high + 0.5 * step]))
        seen, known = t[inside], {name: some[inside] for name, some in channels.items()}
        there = _there(seen, grid, step)
        if there is None:
            # Read-only as those as read are: the compiled loops would else be compiled for either.
            values |= {name: sealed(np.interp(grid, seen, some)) for name, some in known.items()}
            after = np.clip(np.searchsorted(seen, grid), 1, max(len(seen) - 1, 1))
            width = seen[after] - seen[after - 1]
            trusted &= width < 1.9 * max(step, float(np.median(np.diff(seen))))
        elif there.all():
            values |= known
        else:
            values |= {name: sealed(_bridged(grid, there, some)) for name, some in known.items()}
            trusted[1:] &= there[1:] & there[:-1]
    return Stretch(low, step, values, trusted)


def _there(seen: Array, grid: Array, step: float) -> Mask | None:
    """Places of the grid that a clock has, where it is that grid with at most a few samples left out; else None."""
    at = np.rint((seen - grid[0]) / step).astype(np.intp)
    if not len(at) or at[0] != 0 or at[-1] != len(grid) - 1 or (np.diff(at) < 1).any():
        return None
    if np.any(np.abs(seen - grid[at]) >= JITTER * step):
        return None
    there = np.zeros(len(grid), dtype=np.bool_)
    there[at] = True
    return there


def _bridged(grid: Array, there: Mask, known: Array) -> Array:
    """Known samples at their places, and straight lines between them over those left out."""
    values = np.empty(len(grid))
    values[there] = known
    values[~there] = np.interp(grid[~there], grid[there], known)
    return values
