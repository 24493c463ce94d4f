"""The observer: innovations of a joint's model, and how each possible fault would show in them.

A steady Kalman filter (with its true start-up gains) runs over an even stretch. Its innovations ``e`` are white on a
fault-free joint. A small fault adds ``δ s`` to them, where ``s`` is the filter's answer to what the fault does; over a
stretch the score ``g = Σ sᵀ W e`` and the information ``h = Σ sᵀ W s`` are all that a matched likelihood ratio needs,
so they are kept per bin of time and nothing else is.
"""

from typing import NamedTuple

import numba
import numpy as np
import numpy.typing as npt

from gsfdi.types import Array

START_UP = 1500
"""Steps for which the filter's start-up gains are kept; after them the gain is steady."""


THIN = 4
"""The joint information of all directions is summed over every so many samples: it is smooth, and dear."""


JUMP = 50.0
"""How far a lone sample's squared innovation stands above those before it."""


class Filter(NamedTuple):
    """A discrete model ready to run: ``x⁺ = Ad x + Bu u + Bt0 τ_k + Bt1 τ_{k+1}``, ``y = C x``, gains by step."""

    Ad: Array
    Bu: Array
    Bt0: Array
    Bt1: Array
    C: Array
    gains: Array
    weight: Array
    settled: int


@numba.njit(cache=True)
def riccati(Ad: Array, C: Array, Q: Array, R: Array, P: Array, steps: int) -> tuple[Array, Array]:  # pragma: no cover
    """Gains ``(steps, n, p)`` of a Kalman filter from covariance `P`, and innovation covariances ``(steps, p, p)``."""
    n, p = Ad.shape[0], C.shape[0]
    gains = np.zeros((steps, n, p))
    covariances = np.zeros((steps, p, p))
    for k in range(steps):
        S = C @ P @ np.ascontiguousarray(C.T) + R
        S += 1e-12 * (np.diag(np.diag(S)))
        K = P @ np.ascontiguousarray(C.T) @ np.linalg.inv(S)
        gains[k], covariances[k] = K, S
        IKC = np.eye(n) - K @ C
        P = IKC @ P @ np.ascontiguousarray(IKC.T) + K @ R @ np.ascontiguousarray(K.T)
        P = Ad @ P @ np.ascontiguousarray(Ad.T) + Q
        P = 0.5 * (P + np.ascontiguousarray(P.T))
    return gains, covariances


@numba.njit(cache=True)
def innovations(
    Ad: Array,
    Bu: Array,
    Bt0: Array,
    Bt1: Array,
    C: Array,
    gains: Array,
    weight: Array,
    gate: float,
    y: Array,
    u: Array,
    torque: Array,
    x: Array,
) -> tuple[Array, Array, Array]:  # pragma: no cover
    """Run the filter.

    A sample whose weighted innovation exceeds `gate`, and stands far above those just before it, is passed over unless
    it is the fourth in a row: a lone flipped value must not kick the state, a real change must be followed.

    Returns
    -------
    e : (n, p) array
        Innovations.
    states : (n, nx) array
        Updated states.
    used : (n,) array
        1 where the innovation was used.
    """
    n, nx, p = len(u), Ad.shape[0], C.shape[0]
    e, states, used = np.zeros((n, p)), np.zeros((n, nx)), np.ones(n)
    last, refused, level = gains.shape[0] - 1, 0, 0.0
    new = np.zeros(nx)
    for k in range(n):
        size = 0.0
        for i in range(p):
            predicted = 0.0
            for a in range(nx):
                predicted += C[i, a] * x[a]
            e[k, i] = y[k, i] - predicted
        for i in range(p):
            for j in range(p):
                size += e[k, i] * weight[i, j] * e[k, j]
        K = gains[min(k, last)]
        if k > 20 and not size < max(gate, JUMP * level) and refused < 3:
            refused += 1
            used[k] = 0.0
        else:
            refused = 0
            level = 0.8 * level + 0.2 * size
            for a in range(nx):
                for i in range(p):
                    x[a] += K[a, i] * e[k, i]
        for a in range(nx):
            states[k, a] = x[a]
        after = min(k + 1, n - 1)
        for a in range(nx):
            total = Bu[a] * u[k]
            for b in range(nx):
                total += Ad[a, b] * x[b]
            for j in range(torque.shape[1]):
                total += Bt0[a, j] * torque[k, j] + Bt1[a, j] * torque[after, j]
            new[a] = total
        for a in range(nx):
            x[a] = new[a]
    return e, states, used


@numba.njit(cache=True)
def scores(
    Ad: Array,
    C: Array,
    gains: Array,
    weight: Array,
    e: Array,
    used: Array,
    trusted: Array,
    bins: Array,
    count: int,
    exact: Array,
    exact_u: Array,
    states: Array,
    u: Array,
    early: Array,
    late: Array,
    sensed: Array,
    size: Array,
    mate: npt.NDArray[np.int64],
) -> tuple[Array, Array, Array, Array, Array]:  # pragma: no cover
    """Score and information of each fault direction, per bin of time.

    Parameters
    ----------
    Ad, C, gains, weight, u : arrays
        As for :func:`innovations`: discrete model, observer gains, inverse covariance of the innovations, effort.
    e, used, states : arrays
        From :func:`innovations`.
    trusted : (n,) array
        Weight of each sample, 0 or 1.
    bins : (n,) int array
        Bin of each sample, below `count`.
    exact, exact_u : (q, nx, nx), (q, nx) arrays
        First q directions: the change of the discrete model per unit of fault.
    early, late : (m, nx) arrays
        How the amplitude at this sample and at the next enters the state, for each direction.
    sensed : (m, p) array
        How the amplitude shows directly in the measurements.
    size : (n, m) array
        Amplitude of each direction.
    mate : (m,) int array
        Direction that is judged together with this one; -1 where there is none.

    Returns
    -------
    g, h, x : (count, m) arrays
        Scores, information, and information shared with the mate.
    H : (m, m) array
        Joint information of all directions.
    energy : (count, 2) array
        Weighted squared innovations and number of samples.
    """
    n, nx, p, m, q = len(u), Ad.shape[0], C.shape[0], size.shape[1], exact.shape[0]
    g, h, H, energy = np.zeros((count, m)), np.zeros((count, m)), np.zeros((m, m)), np.zeros((count, 2))
    x = np.zeros((count, m))
    # Directions lie along the last axis throughout, so that the inner loops run over memory in order.
    z, new = np.zeros((nx, m)), np.zeros((nx, m))
    s, ws = np.zeros((p, m)), np.zeros((p, m))
    early, late = np.ascontiguousarray(early.T), np.ascontiguousarray(late.T)
    sensed = np.ascontiguousarray(sensed.T)
    last = gains.shape[0] - 1
    for k in range(n):
        K, b, after = gains[min(k, last)], bins[k], min(k + 1, n - 1)
        live = trusted[k] * used[k] > 0
        for i in range(p):
            for j in range(m):
                s[i, j] = sensed[i, j] * size[k, j]
            for a in range(nx):
                for j in range(m):
                    s[i, j] += C[i, a] * z[a, j]
        if live:
            for i in range(p):
                ws[i] = 0.0
                for o in range(p):
                    for j in range(m):
                        ws[i, j] += weight[i, o] * s[o, j]
                for j in range(m):
                    g[b, j] += ws[i, j] * e[k, i]
                    h[b, j] += ws[i, j] * s[i, j]
                    if mate[j] >= 0:
                        x[b, j] += ws[i, j] * s[i, mate[j]]
            if k % THIN == 0:
                for i in range(p):
                    for j in range(m):
                        share = THIN * ws[i, j]
                        for o in range(j + 1):
                            H[j, o] += share * s[i, o]
            for i in range(p):
                for o in range(p):
                    energy[b, 0] += e[k, i] * weight[i, o] * e[k, o]
            energy[b, 1] += 1.0
        if used[k] > 0:
            for a in range(nx):
                for i in range(p):
                    for j in range(m):
                        z[a, j] -= K[a, i] * s[i, j]
        for a in range(nx):
            for j in range(m):
                new[a, j] = early[a, j] * size[k, j] + late[a, j] * size[after, j]
            for c in range(nx):
                for j in range(m):
                    new[a, j] += Ad[a, c] * z[c, j]
            for j in range(q):
                new[a, j] += exact_u[j, a] * u[k]
                for c in range(nx):
                    new[a, j] += exact[j, a, c] * states[k, c]
        z, new = new, z
    for j in range(m):
        for o in range(j):
            H[o, j] = H[j, o]
    return g, h, x, H, energy
