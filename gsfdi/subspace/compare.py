"""What of two models may be compared whatever their bases: angles between subspaces, Markov parameters."""

import numpy as np
from scipy import linalg

from gsfdi.subspace.identify import StateSpace
from gsfdi.types import Array


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


def markov(model: StateSpace, count: int) -> Array:
    """First `count` Markov parameters ``C Aᵏ B``, ``(count, p, m)``; they do not depend on the basis."""
    found, state = [], model.B
    for _ in range(count):
        found.append(model.C @ state)
        state = model.A @ state
    return np.array(found)
