"""The Gram of a block Hankel matrix from lagged products, and the triangular factor that it gives.

With ``w_k = [u_k, y_k]`` the block Hankel matrix of L block rows has the Gram ``G[i, j] = Σ_k w_{k+i} w_{k+j}ᵀ``. Its
first block row is all that has to be summed over the data; the others follow from it by displacement,
``G[i+1, j+1] = G[i, j] - w_i w_jᵀ + w_{N+i} w_{N+j}ᵀ``: the cost is that of L lagged products, the memory that of G.
A Gram squares the condition number: where it has become too large (noise-free data) the triangular factor comes from a
QR decomposition in blocks instead.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np
from scipy import linalg

from gsfdi.types import Array

BLOCK = 1024
"""Samples per block: what fits the processor's first caches."""
THIN_PIVOT = 1e-10
"""Share of a row's own power below which its pivot has drowned in rounding, and the Gram may not be used."""


def lagged_gram(w: Array, lags: int) -> Array:
    """Gram of the block Hankel matrix of `lags` block rows.

    Parameters
    ----------
    w : (c, n) array
        Channels by samples.
    lags : int
        Number of block rows.

    Returns
    -------
    (lags c, lags c) array
        Rows ordered by lag, then by channel. Grams of several stretches add.
    """
    c, n = w.shape
    more = -lags % 8
    padded = np.zeros((c, n + more))
    padded[:, :n] = w
    return np.asarray(_displaced(_lagged(padded, lags + more, n - lags + 1)[:lags], padded[:, :n]))


@numba.njit(cache=True, fastmath=True)
def _lagged(w: Array, lags: int, count: int) -> Array:  # pragma: no cover
    """Products ``Σ_k w_a[k] w_b[k+j]`` over `count` windows, for every lag below `lags`, a multiple of eight.

    Eight lags at a time share each value that is loaded; their eight sums keep the vector units busy.
    """
    c = w.shape[0]
    out = np.zeros((lags, c, c))
    for low in range(0, count, BLOCK):
        size = min(BLOCK, count - low)
        for a in range(c):
            here = w[a, low : low + size]
            for b in range(c):
                for j in range(0, lags, 8):
                    there = w[b, low + j : low + j + size + 7]
                    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
                    for k in range(size):
                        x = here[k]
                        s0 += x * there[k]
                        s1 += x * there[k + 1]
                        s2 += x * there[k + 2]
                        s3 += x * there[k + 3]
                        s4 += x * there[k + 4]
                        s5 += x * there[k + 5]
                        s6 += x * there[k + 6]
                        s7 += x * there[k + 7]
                    out[j, a, b] += s0
                    out[j + 1, a, b] += s1
                    out[j + 2, a, b] += s2
                    out[j + 3, a, b] += s3
                    out[j + 4, a, b] += s4
                    out[j + 5, a, b] += s5
                    out[j + 6, a, b] += s6
                    out[j + 7, a, b] += s7
    return out


@numba.njit(cache=True)
def _displaced(first: Array, w: Array) -> Array:  # pragma: no cover
    """Whole Gram from its first block row, by displacement."""
    lags, c, _ = first.shape
    n = w.shape[1]
    count = n - lags + 1
    G = np.zeros((lags * c, lags * c))
    for j in range(lags):
        for a in range(c):
            for b in range(c):
                G[a, j * c + b] = first[j, a, b]
    for i in range(lags - 1):
        for j in range(i, lags - 1):
            for a in range(c):
                for b in range(c):
                    G[(i + 1) * c + a, (j + 1) * c + b] = (
                        G[i * c + a, j * c + b] - w[a, i] * w[b, j] + w[a, count + i] * w[b, count + j]
                    )
    for i in range(lags * c):
        for j in range(i):
            G[i, j] = G[j, i]
    return G


class Factor(NamedTuple):
    """Upper triangular factor with columns in the order asked for, and whether it came from the Gram."""

    R: Array
    fast: bool


def factor(w: Sequence[Array], lags: int, order: Array, needed: int) -> Factor:
    """Triangular factor of the reordered Hankel matrix of one or several stretches.

    Parameters
    ----------
    w : sequence of (c, n) arrays
        Stretches.
    lags : int
    order : (lags c,) int array
        Columns in the order of the factor.
    needed : int
        Leading columns whose pivots must be trustworthy.
    """
    G = np.sum([lagged_gram(one, lags) for one in w], axis=0)[np.ix_(order, order)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(G), 1e-300))
    try:
        R = linalg.cholesky(scale[:, None] * G * scale, check_finite=False)
        if np.min(np.diag(R)[:needed] ** 2) > THIN_PIVOT:
            return Factor(np.asarray(R / scale), True)
    except linalg.LinAlgError:
        pass
    stacked = np.vstack([hankel_factor(one, lags)[:, order] for one in w])
    return Factor(np.asarray(linalg.qr(stacked, mode="r", check_finite=False)[0][: len(order)]), False)


def hankel_factor(w: Array, lags: int) -> Array:
    """Triangular factor R of the block Hankel matrix, ``G = RᵀR``, by QR in blocks; exact where the Gram is not."""
    c, n = w.shape
    R = np.zeros((0, lags * c))
    for low in range(0, n - lags + 1, 4 * BLOCK):
        high = min(low + 4 * BLOCK, n - lags + 1)
        windows = np.lib.stride_tricks.sliding_window_view(w[:, low : high + lags - 1], lags, axis=1)
        rows = windows.transpose(1, 2, 0).reshape(high - low, lags * c)
        R = linalg.qr(np.vstack([R, rows]), mode="r", overwrite_a=True, check_finite=False)[0][: lags * c]
    return np.asarray(R)


def excitation(G: Array, channels: int, windows: float) -> float:
    """How briskly the first channel moves: root mean square of its second difference, from a lagged Gram.

    Smooth commands leave nothing for a subspace method to hold against the noise, and then its angles are noise.

    Parameters
    ----------
    G : (lags c, lags c) array
        From :func:`lagged_gram`, of at least three lags.
    channels : int
        Channels of the Gram.
    windows : float
        Number of windows that it sums over.
    """
    now, one, two = 0, channels, 2 * channels
    power = G[now, now] + 4.0 * G[one, one] + G[two, two] - 4.0 * G[now, one] - 4.0 * G[one, two] + 2.0 * G[now, two]
    return float(np.sqrt(max(power, 0.0) / max(windows, 1.0)))
