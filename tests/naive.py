"""Loop-by-loop transcriptions, slow and plain, that the fast code must match."""

import numpy as np
import numpy.typing as npt

from gsfdi.nominal import Watched
from gsfdi.nominal.scoring import Entries
from gsfdi.observer import Filter

Array = npt.NDArray[np.float64]


def hankel(w: Array, lags: int) -> Array:
    """Block Hankel matrix, one window per column."""
    c, n = w.shape
    H = np.zeros((lags * c, n - lags + 1))
    for i in range(lags):
        for k in range(n - lags + 1):
            H[i * c : (i + 1) * c, k] = w[:, k + i]
    return H


def angles(a: Array, b: Array) -> Array:
    """Principal angles as the paper has them: arc cosines of singular values."""
    return np.arccos(np.clip(np.linalg.svd(a.T @ b, compute_uv=False), -1.0, 1.0))[::-1]


def parity_residual(A: Array, B: Array, C: Array, V: Array, y: Array, u: Array, k: int, s: int) -> Array:
    """Eq. 2-3 with its brackets mended, for the window of `s` samples that ends at `k`."""
    Y, U = np.zeros(s * len(C)), np.zeros(s * B.shape[1])
    T = np.zeros((len(Y), len(U)))
    for i in range(s):
        Y[i * len(C) : (i + 1) * len(C)] = y[k - s + 1 + i]
        U[i * B.shape[1] : (i + 1) * B.shape[1]] = u[k - s + 1 + i]
        for j in range(i):
            power = np.linalg.matrix_power(A, i - j - 1)
            T[i * len(C) : (i + 1) * len(C), j * B.shape[1] : (j + 1) * B.shape[1]] = C @ power @ B
    return V @ (Y - T @ U)


def scored(run: Filter, entry: Entries, seen: Watched, size: Array) -> tuple[Array, Array, Array]:
    """Scores, information and joint information of all directions, one sample and one direction after another."""
    n, m = size.shape
    shown = np.zeros((n, m, len(run.C)))
    for j in range(m):
        z = np.zeros(len(run.Ad))
        for i in range(len(run.C)):
            z[i] = -entry.sensed[j, i] * size[0, j] / run.C[i, i]
        for k in range(n):
            shown[k, j] = entry.sensed[j] * size[k, j] + run.C @ z
            if seen.used[k]:
                z = z - run.gains[min(seen.age[k], len(run.gains) - 1)] @ shown[k, j]
            z = run.Ad @ z + entry.early[j] * size[k, j] + entry.late[j] * size[min(k + 1, n - 1), j]
            if j < len(entry.exact):
                z = z + entry.exact[j] @ seen.states[k] + entry.exact_u[j] * seen.u[k]
    on = (seen.live * seen.used)[:, None, None]
    g = np.einsum("kji,il,kl->j", on * shown, run.weight, np.nan_to_num(seen.e))
    thin = 4 * (on * shown)[::4]
    return (
        g,
        np.einsum("kji,il,kjl->j", on * shown, run.weight, shown),
        np.einsum("kji,il,kol->jo", thin, run.weight, shown[::4]),
    )
