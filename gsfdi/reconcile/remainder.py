"""What torque is missing, moment by moment: the mismatch of a model in newton metres, without naming any physics.

The innovations of a replay obey the linear error system of the observer, driven by whatever torque the model lacks. A
smoother over that system, in which the missing torque is a random walk, gives the torque itself.
"""

from collections.abc import Sequence

import numba
import numpy as np
from scipy.linalg import solve_discrete_are

from gsfdi.model import JointModel
from gsfdi.reconcile.bench import Bench
from gsfdi.types import Array

QUICK = 0.03  # [s] within which the missing torque may change by its own size


def missing_torque(stand: Bench, innovations: Sequence[Array], side: int = 0) -> list[Array]:
    """Torque [N m] that the model of the `innovations` lacks on a side, by record; positive helps the motion.

    Parameters
    ----------
    stand : Bench
        The recordings on their bench.
    innovations : sequence of (n, 2) arrays
        Under the base gain.
    side : {0, 1}
        Motor (or the rigid joint's only) side, or output.
    """
    system, period = stand.system, stand.scales.period
    n = len(system.Ad)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[:n, n], A[n, n] = system.Ad, system.Bt[:, side], 1.0
    C = np.hstack([system.C, np.zeros((len(system.C), 1))])
    size = 0.3 * stand.scales.torque * np.sqrt(period / QUICK)
    Q = 1e-12 * np.eye(n + 1) * np.trace(system.Bt @ system.Bt.T) * stand.scales.torque**2
    Q[n, n] = size**2
    R = np.diag(system.R)
    P = solve_discrete_are(A.T, C.T, Q, R)
    K = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
    filtered = P - K @ C @ P
    smooth = np.ascontiguousarray(filtered @ A.T @ np.linalg.inv(P))
    base = stand.gain[:n, list(system.rows)]
    known = np.vstack([system.Ad @ base, np.zeros((1, base.shape[1]))])
    return [
        _smooth(
            A, C, K, smooth, known, np.ascontiguousarray(np.nan_to_num(e[:, list(system.rows)])), stand.steps[i] == 0
        )[:, n]
        for i, e in enumerate(innovations)
    ]


def torque_between(stand: Bench, one: JointModel, *others: JointModel) -> Array:
    """Torque by which each of the `others` differs from `one`, root mean square, as a share of the drive's."""
    innovations = stand.innovations([one, *others])
    found = []
    for k in range(1, len(others) + 1):
        torque = np.concatenate(missing_torque(stand, [e[0] - e[k] for e in innovations]))
        found.append(np.sqrt(np.mean(torque**2)) / stand.scales.torque)
    return np.array(found)


@numba.njit(cache=True)
def _smooth(A, C, K, G, known, e, fresh):  # type: ignore[no-untyped-def]
    """Steady Kalman filter and its smoother; `known` is how the innovations themselves entered the observer's error."""
    n, nx = len(e), A.shape[0]
    before, after = np.zeros((n, nx)), np.zeros((n, nx))
    x, inner, ahead = np.zeros(nx), np.zeros(e.shape[1]), np.zeros(nx)
    for k in range(n):
        if fresh[k]:
            x[:] = 0.0
        _set(before[k], x)
        _set(inner, e[k])
        _add(C, x, -1.0, inner)
        _add(K, inner, 1.0, x)
        _set(after[k], x)
        x[:] = 0.0
        _add(A, after[k], 1.0, x)
        _add(known, e[k], -1.0, x)
    for k in range(n - 2, -1, -1):
        if not fresh[k + 1]:
            for a in range(nx):
                ahead[a] = after[k + 1, a] - before[k + 1, a]
            _add(G, ahead, 1.0, after[k])
    return after


@numba.njit(cache=True)
def _set(out, x):  # type: ignore[no-untyped-def]
    """Copy a vector; where an array is assigned to another, numba compiles what to say of shapes that differ, too."""
    for a in range(len(out)):
        out[a] = x[a]


@numba.njit(cache=True)
def _add(A, x, sign, out):  # type: ignore[no-untyped-def]
    """Add ``± A x``; numba's own products of small matrices take most of their time for being called."""
    for a in range(A.shape[0]):
        total = 0.0
        for b in range(A.shape[1]):
            total += A[a, b] * x[b]
        out[a] += sign * total
