"""Linear models from lagged products: PO-MOESP in open loop, PBSIDopt under feedback."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg

from gsfdi.subspace.gram import factor
from gsfdi.types import Array


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
