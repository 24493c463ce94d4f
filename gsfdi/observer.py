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

from gsfdi.types import Array, Mask

START_UP = 1500
"""Steps for which the filter's start-up gains are kept; after them the gain is steady."""


THIN = 4
"""The joint information of all directions is summed over every so many samples: it is smooth, and dear."""


LANES = 64
"""Fault directions that are scored side by side."""


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


def padded(values: Array, *shape: int) -> Array:
    """An array in the first corner of a larger one of zeros."""
    if values.shape == shape:
        return np.ascontiguousarray(values)
    whole = np.zeros(shape)
    whole[tuple(slice(size) for size in values.shape)] = values
    return whole


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
    age: npt.NDArray[np.int64],
    x: Array,
) -> tuple[Array, Array, Array]:  # pragma: no cover
    """Run the filter; `age` counts samples since the state was last unknown, by which the gains go.

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
        K = gains[min(age[k], last)]
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


@numba.njit(cache=True, fastmath={"contract"})
def power(
    A: Array,
    B: Array,
    C: Array,
    L: Array,
    W: Array,
    gate: float,
    y: tuple[Array, Array],
    u: Array,
    push: Array,
    live: Mask,
    age: npt.NDArray[np.int64],
    skip: int,
    x: Array,
) -> tuple[float, int]:  # pragma: no cover
    """Weighted squared innovations of a stretch, and over how many samples: what :func:`innovations` gives, summed.

    Nearly all of a long batch is looked at no closer than this, so it is written out for four states and two outputs;
    smaller models are padded with zeros. An innovation beyond `gate` ends the look with infinity.

    Parameters
    ----------
    A, B, C, W : (4, 4), (4,), (2, 4) and (2, 2) arrays
        Discrete model, and the weight of the innovations.
    L : (steps, 4, 2) array
        How an innovation enters the next state, ``Ad K``.
    gate : float
        Weighted square above which a sample may be a lone one.
    y : two (n,) arrays
        Outputs.
    u : (n,) array
        Effort.
    push : (n, 4) or (1, 4) array
        What else drives the state; one row if it is always the same.
    live : (n,) bool array
        Samples that count.
    age : (n,) int array
        Samples since the state was last unknown; from the first on if that is longer ago.
    skip : int
        Samples younger than this do not count.
    x : (4,) array
        State to start from.
    """
    first, second = y
    a, b, c, d = x[0], x[1], x[2], x[3]
    last, still = len(L) - 1, len(push) - 1
    total, count = 0.0, 0
    for k in range(len(u)):
        since = min(age[k], k)
        K, p = L[min(since, last)], push[min(k, still)]
        e = first[k] - (C[0, 0] * a + C[0, 1] * b + (C[0, 2] * c + C[0, 3] * d))
        f = second[k] - (C[1, 0] * a + C[1, 1] * b + (C[1, 2] * c + C[1, 3] * d))
        size = e * (W[0, 0] * e + W[0, 1] * f) + f * (W[1, 0] * e + W[1, 1] * f)
        if k > 20 and not size < gate:
            return np.inf, max(count, 1)
        if live[k] and since >= skip:
            total += size
            count += 1
        na = A[0, 0] * a + A[0, 1] * b + (A[0, 2] * c + A[0, 3] * d) + (B[0] * u[k] + p[0])
        nb = A[1, 0] * a + A[1, 1] * b + (A[1, 2] * c + A[1, 3] * d) + (B[1] * u[k] + p[1])
        nc = A[2, 0] * a + A[2, 1] * b + (A[2, 2] * c + A[2, 3] * d) + (B[2] * u[k] + p[2])
        nd = A[3, 0] * a + A[3, 1] * b + (A[3, 2] * c + A[3, 3] * d) + (B[3] * u[k] + p[3])
        a = na + (K[0, 0] * e + K[0, 1] * f)
        b = nb + (K[1, 0] * e + K[1, 1] * f)
        c = nc + (K[2, 0] * e + K[2, 1] * f)
        d = nd + (K[3, 0] * e + K[3, 1] * f)
    return total, count


@numba.njit(cache=True)
def powers(
    A: Array,
    B: Array,
    C: Array,
    L: Array,
    W: Array,
    gate: float,
    y: tuple[Array, Array],
    u: Array,
    push: Array,
    live: Mask,
    age: npt.NDArray[np.int64],
    x: Array,
    edges: npt.NDArray[np.int64],
    settled: int,
) -> Array:  # pragma: no cover
    """Mean of :func:`power` over each slab between `edges`, from state ``x[slab]`` and without its first samples.

    `settled` samples, or a quarter of a short slab, are what the observer needs to forget where it started; NaN where
    none counts.
    """
    means = np.full(len(edges) - 1, np.nan)
    first, second = y
    for k in range(len(means)):
        here = slice(edges[k], edges[k + 1])
        pushed = push[here] if len(push) > 1 else push
        skip = min(settled, (edges[k + 1] - edges[k]) // 4)
        measured, counts = (first[here], second[here]), live[here]
        total, count = power(A, B, C, L, W, gate, measured, u[here], pushed, counts, age[here], skip, x[k])
        if count > 0:
            means[k] = total / count
    return means


@numba.njit(cache=True, fastmath={"contract"})
def scores(
    A: Array,
    C: Array,
    gains: Array,
    W: Array,
    e: Array,
    used: Array,
    live: Array,
    age: npt.NDArray[np.int64],
    bins: npt.NDArray[np.int64],
    count: int,
    exact: Array,
    exact_u: Array,
    states: Array,
    u: Array,
    lanes: Array,
    start: Array,
    size: Array,
    pairs: npt.NDArray[np.int64],
) -> tuple[Array, Array, Array, Array]:  # pragma: no cover
    """Score and information of up to `LANES` fault directions, per bin of time.

    Directions lie side by side in one array whose rows are `LANES` long, a number that the compiler knows: only so
    can it tell that the rows do not overlap, and work on several directions at once.

    Parameters
    ----------
    A, C, gains, W : (4, 4), (2, 4), (steps, 4, 2) and (2, 2) arrays
        Discrete model, observer gains, inverse covariance of the innovations; padded.
    e, used, states, u : (n, 2), (n,), (n, 4) and (n,) arrays
        Innovations, whether each was used, states and effort.
    live : (n,) array
        Weight of each sample, 0 or 1.
    age : (n,) int array
        Samples since the observer's state was last unknown.
    bins : (n,) int array
        Bin of each sample, below `count`.
    exact, exact_u : (q, 4, 4), (q, 4) arrays
        First q directions: the change of the discrete model per unit of fault.
    lanes : (10 * LANES,) array
        How the amplitude at this sample and at the next enters the four states, and shows in the two measurements.
    start : (4 * LANES,) array
        What the directions have made of the state that the observer started from.
    size : (n, LANES) array
        Amplitude of each direction.
    pairs : (k, 2) int array
        Directions that are judged together.

    Returns
    -------
    g, h : (count, LANES) arrays
        Scores and information.
    x : (count, k) array
        Information that a pair shares.
    shown : (n // THIN, 2, LANES) array
        What the directions show in the innovations, of every so manieth sample; zero where it is not live.
    """
    n, q, k = len(u), len(exact), len(pairs)
    g, h, x = np.zeros((count, LANES)), np.zeros((count, LANES)), np.zeros((count, k))
    shown = np.zeros((n // THIN, 2, LANES))
    w = np.zeros(20 * LANES)
    w[: 10 * LANES] = lanes
    w[10 * LANES : 14 * LANES] = start
    # Rows: 0-3 early, 4-7 late, 8-9 sensed; 10-13 the state, 14-15 what shows, 16-17 amplitudes, 18-19 sums.
    w[17 * LANES : 18 * LANES] = size[0]
    last, none = len(gains) - 1, np.zeros((4, 2))
    for i in range(n):
        K = gains[min(age[i], last)] if used[i] > 0 else none
        on = live[i] * used[i]
        first, second = on * e[i, 0], on * e[i, 1]
        after = size[min(i + 1, n - 1)]
        for j in range(LANES):
            w[16 * LANES + j] = w[17 * LANES + j]
            w[17 * LANES + j] = after[j]
        for j in range(LANES):
            a, b, c, d = w[10 * LANES + j], w[11 * LANES + j], w[12 * LANES + j], w[13 * LANES + j]
            now, then = w[16 * LANES + j], w[17 * LANES + j]
            s = w[8 * LANES + j] * now + C[0, 0] * a + C[0, 1] * b + C[0, 2] * c + C[0, 3] * d
            r = w[9 * LANES + j] * now + C[1, 0] * a + C[1, 1] * b + C[1, 2] * c + C[1, 3] * d
            ws, wr = W[0, 0] * s + W[0, 1] * r, W[1, 0] * s + W[1, 1] * r
            w[14 * LANES + j], w[15 * LANES + j] = s, r
            w[18 * LANES + j] += ws * first + wr * second
            w[19 * LANES + j] += on * (ws * s + wr * r)
            a -= K[0, 0] * s + K[0, 1] * r
            b -= K[1, 0] * s + K[1, 1] * r
            c -= K[2, 0] * s + K[2, 1] * r
            d -= K[3, 0] * s + K[3, 1] * r
            w[10 * LANES + j] = (
                w[j] * now + w[4 * LANES + j] * then + A[0, 0] * a + A[0, 1] * b + A[0, 2] * c + A[0, 3] * d
            )
            w[11 * LANES + j] = (
                w[LANES + j] * now + w[5 * LANES + j] * then + A[1, 0] * a + A[1, 1] * b + A[1, 2] * c + A[1, 3] * d
            )
            w[12 * LANES + j] = (
                w[2 * LANES + j] * now + w[6 * LANES + j] * then + A[2, 0] * a + A[2, 1] * b + A[2, 2] * c + A[2, 3] * d
            )
            w[13 * LANES + j] = (
                w[3 * LANES + j] * now + w[7 * LANES + j] * then + A[3, 0] * a + A[3, 1] * b + A[3, 2] * c + A[3, 3] * d
            )
        for j in range(q):
            for a_ in range(4):
                more = exact_u[j, a_] * u[i]
                for c_ in range(4):
                    more += exact[j, a_, c_] * states[i, c_]
                w[(10 + a_) * LANES + j] += more
        b_ = bins[i]
        if on > 0:
            for o in range(k):
                j, m = pairs[o, 0], pairs[o, 1]
                s, r = w[14 * LANES + j], w[15 * LANES + j]
                t, v = w[14 * LANES + m], w[15 * LANES + m]
                x[b_, o] += s * (W[0, 0] * t + W[0, 1] * v) + r * (W[1, 0] * t + W[1, 1] * v)
            if i % THIN == 0 and i // THIN < len(shown):
                shown[i // THIN, 0] = w[14 * LANES : 15 * LANES]
                shown[i // THIN, 1] = w[15 * LANES : 16 * LANES]
        if i == n - 1 or bins[i + 1] != b_:
            g[b_] += w[18 * LANES : 19 * LANES]
            h[b_] += w[19 * LANES :]
            w[18 * LANES :] = 0.0
    return g, h, x, shown
