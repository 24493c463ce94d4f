"""From numbers to places on paper: ticks, unit prefixes, decimation, and the text of a path."""

import math

import numpy as np
import numpy.typing as npt

from gsfdi.types import Array

FINE = 5
"""Steps of a path's integer grid in one unit of the drawing: a fifth of a pixel, and no decimal point to store."""

HUGE = 1e60
"""Beyond this a value is taken for damage and left out of the drawing, or an axis would show nothing else."""


def finite(values: npt.ArrayLike) -> Array:
    """Give `values` with NaN for whatever cannot be drawn.

    Examples
    --------
    >>> finite([1.0, float("inf"), 1e165]).tolist()
    [1.0, nan, nan]
    """
    array = np.asarray(values, dtype=np.float64).ravel()
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(array) < HUGE, array, np.nan)


def extent(*arrays: Array) -> tuple[float, float]:
    """Give the least and largest finite value of all `arrays`, opened where they coincide.

    Examples
    --------
    >>> extent(np.array([1.0, np.nan, 3.0]), np.array([2.0]))
    (1.0, 3.0)
    >>> extent(np.array([]))
    (0.0, 1.0)
    """
    kept = [array[np.isfinite(array)] for array in arrays]
    kept = [array for array in kept if array.size]
    if not kept:
        return 0.0, 1.0
    low, high = float(min(array.min() for array in kept)), float(max(array.max() for array in kept))
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        half = abs(low) * 0.05 or 1.0
        return low - half, high + half
    return low, high


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Choose at least two round numbers (1, 2 or 5 times a power of ten) between `low` and `high`, or just beside.

    Examples
    --------
    >>> ticks(0.0, 60.0)
    [0.0, 20.0, 40.0, 60.0]
    """
    raw = (high - low) / about
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= raw * 0.999)
    # A recording that ends one sample before 40 s has its tick at 40 s all the same.
    slack = 0.005 * (high - low) / step
    first, last = math.ceil(low / step - slack), math.floor(high / step + slack)
    if last <= first:
        return ticks(low, high, about + 2)
    return [round(k * step, 15 - math.floor(math.log10(step))) for k in range(first, last + 1)]


def decades(low: float, high: float, about: int = 5) -> list[float]:
    """Choose powers of ten between the exponents `low` and `high`, as exponents.

    Examples
    --------
    >>> decades(-2.3, 3.1)
    [-2.0, 0.0, 2.0]
    """
    stride = max(1, math.ceil((high - low) / about))
    first, last = math.ceil(low - 1e-9), math.floor(high + 1e-9)
    return [float(k) for k in range(first, last + 1) if k % stride == 0]


def tick_labels(values: list[float]) -> list[str]:
    """Write `values` with the decimals that their spacing asks for.

    Examples
    --------
    >>> tick_labels([0.0, 0.25, 0.5])
    ['0', '0.25', '0.50']
    """
    if len(values) < 2:
        return [f"{value:.4g}" for value in values]
    step = values[1] - values[0]
    if max(abs(value) for value in values) >= 1e6:
        return [f"{value:.3g}" for value in values]
    if step < 1e-6 and abs(values[0]) + abs(values[-1]) < 100 * step:
        return [f"{value:.3g}".replace("-", "−") for value in values]
    places = next((n for n in range(12) if abs(step * 10**n - round(step * 10**n)) < 1e-6 * step * 10**n), 12)
    return ["0" if value == 0 else f"{value:.{places}f}".replace("-", "−") for value in values]


PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
BARE = ("", "1", "%", "degC", "h", "min", "d")


def prefixed(unit: str, largest: float) -> tuple[float, str]:
    """Choose the prefix that makes `largest` easy to read; give the factor to multiply by, and the unit.

    Examples
    --------
    >>> prefixed("rad", 2.1e-4)
    (1000000.0, 'µrad')
    >>> prefixed("s", 86400.0)
    (0.0002777777777777778, 'h')
    """
    if unit == "s" and largest >= 600.0:
        return (1 / 3600.0, "h") if largest >= 7200.0 else (1 / 60.0, "min")
    if unit in BARE or not 0 < largest < math.inf or 0.1 <= largest < 1e4:
        return 1.0, unit
    size, letter = next(((s, p) for s, p in reversed(PREFIXES) if largest >= s), PREFIXES[0])
    return 1.0 / size, letter + unit


def decimate(x: Array, y: Array, columns: int) -> tuple[Array, Array]:
    """Keep of every one of `columns` stretches of `x` the least and the largest `y`, so that no spike is lost.

    A stretch without a single finite value stays NaN and breaks the line there. Where `x` runs back (a loop) samples
    are thinned evenly instead.

    Examples
    --------
    >>> x = np.arange(1000.0)
    >>> y = np.where(x == 333, 7.0, 0.0)
    >>> thin_x, thin_y = decimate(x, y, 20)
    >>> thin_x.size, float(thin_y.max())
    (40, 7.0)
    """
    if x.size <= 2 * columns:
        return x, y
    if np.any(np.diff(x) < 0):
        keep = np.linspace(0, x.size - 1, 4 * columns).astype(np.intp)
        return x[keep], y[keep]
    edges = np.linspace(x[0], x[-1], columns + 1)[:-1]
    starts = np.unique(np.searchsorted(x, edges))
    low, high = np.fmin.reduceat(y, starts), np.fmax.reduceat(y, starts)
    ends = np.append(starts[1:], x.size) - 1
    rising = y[starts] <= y[ends]
    pairs = np.where(rising, (low, high), (high, low))
    return np.column_stack((x[starts], x[ends])).ravel(), pairs.T.ravel()


def thinned(points: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Drop the points of an (n, 2) polyline that lie on the chord between their neighbours."""
    for _ in range(12):
        if len(points) < 3:
            break
        before, middle, after = points[:-2], points[1:-1], points[2:]
        chord, arm = after - before, middle - before
        off = np.abs(chord[:, 0] * arm[:, 1] - chord[:, 1] * arm[:, 0])
        forward = (arm * chord).sum(axis=1) >= 0
        drop = (off <= 1.0 * np.hypot(chord[:, 0], chord[:, 1])) & forward & ((arm**2).sum(1) <= (chord**2).sum(1))
        # Of two neighbours only one may go at a time, or a slow curve would vanish whole.
        drop[1:] &= ~drop[:-1]
        if not drop.any():
            break
        points = points[np.concatenate(([True], ~drop, [True]))]
    return points


def path_text(x: Array, y: Array) -> str:
    """Write a polyline as the ``d`` of a path on the integer grid of `FINE` steps; NaN lifts the pen.

    Examples
    --------
    >>> path_text(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 4.0, np.nan, 1.0]))
    'M0 0l5 20M15 5h1'
    """
    good = np.isfinite(x) & np.isfinite(y)
    runs = np.flatnonzero(np.diff(np.concatenate(([False], good, [False])).astype(np.int8)))
    parts = []
    for start, end in zip(runs[::2], runs[1::2], strict=True):
        grid = np.rint(np.column_stack((x[start:end], y[start:end])) * FINE).astype(np.int64)
        grid = thinned(grid)
        steps = np.diff(grid, axis=0)
        steps = steps[np.any(steps != 0, axis=1)]
        moves = " ".join(map(str, steps.ravel().tolist())).replace(" -", "-")
        parts.append(f"M{grid[0, 0]} {grid[0, 1]}" + (f"l{moves}" if moves else "h1"))
    return "".join(parts)
