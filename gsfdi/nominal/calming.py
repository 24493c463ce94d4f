"""Takes noise out of what directions are evaluated on."""

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from gsfdi.types import Array


def calm(values: Array, step: float, ceiling: float) -> Array:
    """Low-pass columns of `values` at `ceiling` [Hz], without delay and without kinks at the ends."""
    n = len(values)
    side = min(n - 1, max(int(2.0 / (ceiling * step)), 16))
    first, last = values[:1], values[-1:]
    before, after = 2 * first - values[side:0:-1], 2 * last - values[-2 : -side - 2 : -1]
    rest = next_fast_len(n + 2 * side, real=True) - n - 2 * side
    after = np.concatenate([after, np.repeat(after[-1:], rest, axis=0)])
    whole = np.concatenate([before, values, after])
    frequency = np.fft.rfftfreq(len(whole), step)
    gain = 0.5 * (1.0 + np.cos(np.pi * np.clip((frequency - ceiling) / (0.5 * ceiling), 0.0, 1.0)))
    spectrum = rfft(whole, axis=0)
    low = irfft(spectrum * gain.reshape(-1, *[1] * (values.ndim - 1)), len(whole), axis=0)
    return np.asarray(low[side : side + n], dtype=np.float64)


def ceiling_of(values: Array, step: float) -> float:
    """Frequency above which a channel holds little but noise [Hz], from its own spectrum."""
    n = next_fast_len(len(values), real=True)
    power = np.abs(rfft((values - values.mean()) * np.hanning(len(values)), n)) ** 2
    frequency = np.fft.rfftfreq(n, step)
    top = frequency[-1]
    floor = float(np.mean(power[frequency > 0.6 * top]))
    edges = np.geomspace(max(4.0 * frequency[1], top / 500.0), top, 40)
    for low, high in zip(edges[-2::-1], edges[:0:-1], strict=True):
        inside = power[(frequency >= low) & (frequency < high)]
        if len(inside) > 3 and inside.mean() > 30.0 * floor:
            return float(min(1.3 * high, top))
    return float(edges[4])
