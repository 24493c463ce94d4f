"""Subspace identification without the Hankel matrix: its Gram from lagged products, in one pass.

With ``w_k = [u_k, y_k]`` the block Hankel matrix of L block rows has the Gram ``G[i, j] = Σ_k w_{k+i} w_{k+j}ᵀ``. Its
first block row is all that has to be summed over the data; the others follow from it by displacement,
``G[i+1, j+1] = G[i, j] - w_i w_jᵀ + w_{N+i} w_{N+j}ᵀ``: the cost is that of L lagged products, the memory that of G.
A Gram squares the condition number: where it has become too large (noise-free data) the triangular factor comes from a
QR decomposition in blocks instead.

References
----------
Verhaegen 1994 (PO-MOESP); Chiuso 2007 (PBSIDopt); Björck & Golub 1973 and Knyazev & Argentati 2002 (angles).
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


class Observability(NamedTuple):
    """Orthonormal basis ``(s p, n)`` of the observability matrix, all singular values, and how they were found."""

    basis: Array
    singular_values: Array
    fast: bool


def moesp(u: Array | Sequence[Array], y: Array | Sequence[Array], rows: int, order: int) -> Observability:
    """Extended observability matrix by PO-MOESP (past inputs and outputs as instruments).

    Parameters
    ----------
    u : (n, m) array, or a sequence of them
    y : (n, p) array, or a sequence of them
    rows : int
        Block rows of past and of future.
    order : int
        Order of the system.

    Notes
    -----
    Consistent in open loop only: under feedback the future inputs know the noise, and more data does not help.
    """
    us = [u] if isinstance(u, np.ndarray) else list(u)
    ys = [y] if isinstance(y, np.ndarray) else list(y)
    m, p = us[0].shape[1], ys[0].shape[1]
    w = [np.ascontiguousarray(np.column_stack([a, b]).T) for a, b in zip(us, ys, strict=True)]
    index = np.arange(2 * rows * (m + p)).reshape(2 * rows, m + p)
    past, future = index[:rows], index[rows:]
    order_of = np.concatenate([future[:, :m].ravel(), past[:, :m].ravel(), past[:, m:].ravel(), future[:, m:].ravel()])
    needed = rows * (2 * m + p)
    found = factor(w, 2 * rows, order_of, needed)
    middle = found.R[rows * m : needed, needed:]
    left, values, _ = linalg.svd(middle.T, full_matrices=False, check_finite=False)
    return Observability(left[:, :order], values, found.fast)


class StateSpace(NamedTuple):
    """``x⁺ = A x + B u + K e, y = C x + e``."""

    A: Array
    B: Array
    C: Array
    K: Array


def pbsid(G: Array, inputs: int, outputs: int, future: int, order: int) -> StateSpace:
    """Closed-loop identification (PBSIDopt) from a lagged Gram.

    A long autoregression of the outputs on past inputs and outputs is unbiased under feedback, since the past does not
    know the present noise; its coefficients make up the product of observability and controllability of the predictor.

    Parameters
    ----------
    G : (lags c, lags c) array
        From :func:`lagged_gram`, channels ``[u, y]``; its last lag is the present.
    inputs, outputs : int
        Number of each.
    future : int
        Block rows of the observability matrix, at most ``lags - 1``.
    order : int
    """
    c = inputs + outputs
    span = len(G) - c  # the past
    now_u, now_y = np.arange(span, span + inputs), np.arange(span + inputs, len(G))
    Z = slice(0, span)
    ridge = 1e-13 * np.diag(np.diag(G[Z, Z]))
    root = linalg.cholesky(G[Z, Z] + ridge, lower=True, check_finite=False)
    regression = linalg.cho_solve((root, True), G[Z][:, now_y], check_finite=False).T
    product = np.zeros((future * outputs, span))
    for j in range(future):
        product[j * outputs : (j + 1) * outputs, j * c :] = regression[:, : span - j * c]
    left, values, _ = linalg.svd(product @ root, full_matrices=False, check_finite=False)
    T = (left[:, :order] / np.sqrt(values[:order])).T @ product
    stack = len(G)
    X, ahead = np.zeros((order, stack)), np.zeros((order, stack))
    X[:, :span], ahead[:, c:] = T, T
    Y, U = np.eye(stack)[now_y], np.eye(stack)[now_u]
    C = linalg.lstsq(X @ G @ X.T, X @ G @ Y.T)[0].T
    E = Y - C @ X
    regressors = np.vstack([X, U, E])
    ABK = linalg.lstsq(regressors @ G @ regressors.T, regressors @ G @ ahead.T)[0].T
    return StateSpace(ABK[:, :order], ABK[:, order : order + inputs], C, ABK[:, order + inputs :])


def observability(A: Array, C: Array, rows: int) -> Array:
    """Orthonormal basis of the extended observability matrix of `rows` block rows."""
    blocks, power = [], np.eye(len(A))
    for _ in range(rows):
        blocks.append(C @ power)
        power = power @ A
    return np.asarray(linalg.qr(np.vstack(blocks), mode="economic")[0])


def angles(first: Array, second: Array) -> Array:
    """Principal angles between two subspaces, small ones by their sines [rad].

    The cosine of a small angle is one to rounding: below about 1e-8 it says nothing, and the sine says all.

    Parameters
    ----------
    first, second : (n, k) arrays
        Orthonormal bases.

    Examples
    --------
    >>> a = np.eye(4)[:, :2]
    >>> b, _ = np.linalg.qr(a + 1e-12 * np.ones((4, 2)))
    >>> bool(1e-12 < angles(a, b)[0] < 3e-12)
    True
    """
    cosines = linalg.svd(first.T @ second, compute_uv=False)
    sines = linalg.svd(second - first @ (first.T @ second), compute_uv=False)
    cosines, sines = np.clip(cosines, 0.0, 1.0), np.sort(np.clip(sines, 0.0, 1.0))
    found = np.where(sines < np.sqrt(0.5), np.arcsin(sines), np.arccos(cosines))
    return np.asarray(np.sort(found)[::-1])


def aligned(model: StateSpace, reference: StateSpace, rows: int) -> StateSpace:
    """Bring a model to the reference's basis of states, ``T = Γ⁺ Γ₀``; only then may the B be compared."""

    def gamma(one: StateSpace) -> Array:
        blocks, power = [], np.eye(len(one.A))
        for _ in range(rows):
            blocks.append(one.C @ power)
            power = power @ one.A
        return np.vstack(blocks)

    T = linalg.lstsq(gamma(model), gamma(reference))[0]
    inverse = linalg.inv(T)
    return StateSpace(inverse @ model.A @ T, inverse @ model.B, model.C @ T, inverse @ model.K)


def markov(model: StateSpace, count: int) -> Array:
    """First `count` Markov parameters ``C Aᵏ B``, ``(count, p, m)``; they do not depend on the basis."""
    found, state = [], model.B
    for _ in range(count):
        found.append(model.C @ state)
        state = model.A @ state
    return np.array(found)


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
