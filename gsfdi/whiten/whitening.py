"""Innovations of one gain, refiltered to white ones."""

from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from scipy.linalg import solve_toeplitz

from gsfdi.types import Array, Mask
from gsfdi.whiten.system import Ints, Observed

CALM = 1e-8
"""Change of the innovations' log-determinant over 50 samples at which the filter counts as steady."""


class Whitener(NamedTuple):
    """Turns innovations under the base gain into white ones; see :func:`whitener`.

    Row ``place[k]`` of ``gains``, ``weights`` and ``logdet`` is that of sample k: a steady filter has one for all.
    ``colour`` (p, k) predicts each whitened channel from its own last k samples, where its noise is not white by itself
    (a coarse sensor's is not); ``size`` (p,) is what that leaves. Without colour, the Kalman filter has done it all.
    """

    system: Observed
    base: Array
    gains: Array
    weights: Array
    logdet: Array
    place: Ints
    steps: Ints
    colour: Array
    size: Array

    def __call__(self, innovations: Array) -> Array:
        """White innovations ``(m, n p)`` of ``(m, n, 2)`` or ``(n, 2)`` under the base gain; 0 where not measured."""
        rows = list(self.system.rows)
        both = innovations if innovations.ndim == 3 else innovations[None]
        e = np.ascontiguousarray(both if len(rows) == both.shape[-1] else both[..., rows])
        out = np.empty_like(e)
        base = np.ascontiguousarray(self.base[: len(self.system.Ad), rows])
        refilter = _refilter_of(len(base), len(rows))
        refilter(self.system.Ad, self.system.C, base, self.gains, self.weights, self.place, self.steps, e, out)
        if self.colour.shape[1]:
            _bleach(self.colour, self.size, out)
        return out.reshape(len(e), -1)

    def coloured(self, innovations: Array, order: int = 12) -> "Whitener":
        """Give the whitener that makes `innovations` white, which stand for noise alone."""
        plain = self(innovations).reshape(len(self.steps), -1)
        colour, size = np.zeros((plain.shape[1], order)), np.ones(plain.shape[1])
        for i, values in enumerate(plain.T):
            lags = np.array([values[k:] @ values[: len(values) - k] for k in range(order + 1)]) / len(values)
            lags[0] *= 1 + 1e-6
            colour[i] = solve_toeplitz(lags[:-1], lags[1:])
            size[i] = np.sqrt(max(lags[0] - colour[i] @ lags[1:], 1e-12))
        return self._replace(colour=colour, size=size, logdet=self.logdet + 2 * float(np.log(size).sum()))


def whitener(
    system: Observed, base: Array, doubt: Array, torque: Array, steps: Ints, present: Mask, shaken: Array | None = None
) -> Whitener:
    """Set up a whitener for process noise of `torque` [N m].

    Parameters
    ----------
    system : Observed
    base : (4, 2) array
        Gain of the replay that gives the innovations.
    doubt : (n, n) array
        Covariance of the state at a start.
    torque : (k,) array
        Standard deviation of the white torque on each side [N m].
    steps : (n,) int array
        Sampling periods since the sample before; 0 where the filter starts anew.
    present : (n, p) bool array
        Whether each channel was measured.
    shaken : (n,) array, optional
        Standard deviation of the drive's torque over the step before each sample where it is not known [N m].
    """
    Q = np.ascontiguousarray((system.Bt * np.square(torque)) @ system.Bt.T)
    push = np.outer(system.Bt[:, 0], system.Bt[:, 0])
    shake = np.zeros(len(steps)) if shaken is None else shaken**2
    R, common = np.diag(system.R), told(system, torque[0])
    # of what a sample leaves unknown of the state, it knows the drive's noise to hold that much
    apart, ahead = system.Ad - common @ system.C, np.linalg.solve(system.Ad, common)
    calm = Q - common @ R @ common.T
    tells = present[:, common.any(axis=0)].all(axis=1) & common.any()
    K, W, logdet, place = _gains(
        system.Ad, Q, system.C, R, apart, ahead, calm, tells, doubt, steps, present, push, shake
    )
    p = len(system.rows)
    return Whitener(system, base, K, W, logdet, place, steps, np.zeros((p, 0)), np.ones(p))


def told(system: Observed, torque: float) -> Array:
    """What the noise of each channel tells of the drive's, as far as a drive of no more than `torque` [N m] has it.

    A torque constant fitted 8 % too high made a told speed share more noise with the drive than either had.
    """
    shared = np.sqrt(np.sum(system.common**2 * system.R)) / (np.linalg.norm(system.Bt[:, 0]) * torque)
    return np.ascontiguousarray(system.common / max(1.0, shared))


def pushes(system: Observed, torque: Array, sensed: Array, rng: np.random.Generator) -> Array:
    """Draw noise ``(n, k)`` of the drive [N m] to go with errors ``(n, 2)`` of the sensors, of which some tell it."""
    found = torque * rng.standard_normal((len(sensed), len(torque)))
    if system.common.any():
        place, drive = system.rows.index(1), system.Bt[:, 0]
        share = float(told(system, torque[0])[:, place] @ drive / (drive @ drive))
        rest = max(torque[0] ** 2 - share**2 * system.R[place], 0.0) ** 0.5
        found[:, 0] = share * sensed[:, 1] + rest / torque[0] * found[:, 0]
    return found


@numba.njit(cache=True)
def _gains(  # type: ignore[no-untyped-def]
    Ad, Q, C, R, apart, ahead, calm, tells, P0, steps, present, push, shake
):
    """Gains, inverse Cholesky factors of the innovations' covariance, their log-determinants, and whose they are.

    The first row is that of what is missing. At 0 steps the filter starts anew. What a sample `tells` of the drive's
    noise until the next one joins its gain (by `ahead`), and leaves the dynamics `apart` and the noise `calm`. No
    algebra of numba's is called: that took ten seconds to compile.
    """
    n, nx, p = steps.size, Ad.shape[0], C.shape[0]
    K, W, logdet = np.empty((n + 1, nx, p)), np.empty((n + 1, p, p)), np.empty(n + 1)
    place, last = np.zeros(n, np.int64), 0
    K[0], W[0], logdet[0] = 0.0, 0.0, 0.0
    P, left, PC, work = P0.copy(), np.zeros((nx, nx)), np.zeros((nx, p)), np.zeros((nx, nx))
    beside = np.zeros(p)
    settled, before = 0, np.inf
    for k in range(n):
        if steps[k] == 0:
            P = P0.copy()  # assigned in place it would take four seconds to compile
            settled = 0
        else:
            settled = settled if steps[k] == 1 and shake[k] == 0 else 0
            for i in range(steps[k] if settled < 3 else 0):
                known = i == 0 and tells[k - 1]
                _between(apart if known else Ad, P, work)
                P += calm if known else Q
            if shake[k] > 0:
                P += shake[k] * push
        count = 0
        for i in range(p):
            count += present[k, i]
        settled = settled if count == p else 0
        if count == 0:
            continue
        last += settled < 3
        place[k] = last
        if settled >= 3:
            continue
        logdet[last] = _weigh(P, C, R, present[k], PC, W[last])
        _gain(PC, W[last], C, K[last], left)
        _between(left, P, work)
        for a in range(nx):
            for b in range(nx):
                for i in range(p):
                    P[a, b] += K[last, a, i] * R[i, i] * K[last, b, i]
        if tells[k]:
            _look_ahead(ahead, C, K[last], beside)
        if abs(logdet[last] - before) < CALM and k % 50 == 0:
            settled += 1
        if k % 50 == 0:
            before = logdet[last]
    return K[: last + 1], W[: last + 1], logdet[: last + 1], place


@numba.njit(cache=True)
def _look_ahead(ahead, C, K, left):  # type: ignore[no-untyped-def]
    """Add to the gain K what a sample tells of the drive's noise until the next, ``ahead (1 - C K)``."""
    n, p = K.shape
    for j in range(p):
        for i in range(p):
            left[i] = 1.0 if i == j else 0.0
            for b in range(n):
                left[i] -= C[i, b] * K[b, j]
        for a in range(n):
            for i in range(p):
                K[a, j] += ahead[a, i] * left[i]


@numba.njit(cache=True)
def _between(A, P, work):  # type: ignore[no-untyped-def]
    """Set P to ``A P Aᵀ``; numba's own products of small matrices take most of their time for being called."""
    n = len(P)
    for a in range(n):
        for b in range(n):
            total = 0.0
            for c in range(n):
                total += A[a, c] * P[c, b]
            work[a, b] = total
    for a in range(n):
        for b in range(n):
            total = 0.0
            for c in range(n):
                total += work[a, c] * A[b, c]
            P[a, b] = total


@numba.njit(cache=True)
def _weigh(P, C, R, seen, PC, W):  # type: ignore[no-untyped-def]
    """Fill ``P Cᵀ`` and the inverse Cholesky factor W of ``C P Cᵀ + R`` (1 or 2 wide); give the log-determinant.

    A channel that was not `seen` has no weight.
    """
    n, p = PC.shape
    for a in range(n):
        for i in range(p):
            total = 0.0
            for c in range(n):
                total += P[a, c] * C[i, c]
            PC[a, i] = total
    W[:] = 0.0
    logdet = 0.0
    for i in range(p):
        left, beside = R[i, i], 0.0
        for a in range(n):
            left += C[i, a] * PC[a, i]
            beside += C[i, a] * PC[a, 0] * W[0, 0]  # which is 0 of the first
        left -= beside**2
        if seen[i]:
            W[i, i] = 1.0 / np.sqrt(left)
            logdet += np.log(left)
        if i > 0:
            W[i, 0] = -beside * W[0, 0] * W[i, i]
    return logdet


@numba.njit(cache=True)
def _gain(PC, W, C, K, left):  # type: ignore[no-untyped-def]
    """Fill the Kalman gain K and ``1 - K C``."""
    n, p = PC.shape
    for a in range(n):
        for i in range(p):
            total = 0.0
            for j in range(p):
                for m in range(p):
                    total += PC[a, j] * W[m, j] * W[m, i]
            K[a, i] = total
    for a in range(n):
        for b in range(n):
            total = 1.0 if a == b else 0.0
            for i in range(p):
                total -= K[a, i] * C[i, b]
            left[a, b] = total


@cache
def _refilter_of(nx: int, p: int) -> Any:
    """Make the filter for `nx` states and `p` channels: compiled for these it takes half the time."""

    @numba.njit(cache=True)
    def refilter(Ad, C, K0, K, W, place, steps, e, out):  # type: ignore[no-untyped-def]
        """White innovations of the filter `K` from those of the observer `K0`; e and out are (m, n, p)."""
        m, n = e.shape[0], e.shape[1]
        deltas, work, inner, shown = np.zeros((m, nx)), np.zeros(nx), np.zeros(p), np.zeros(p)
        for k in range(n):
            if steps[k] == 0:
                deltas[:] = 0.0
            at = place[k]
            for j in range(m):  # side by side: one waits for numbers of its own only
                delta = deltas[j]
                for _ in range(steps[k]):
                    for a in range(nx):
                        work[a] = 0.0
                        for b in range(nx):
                            work[a] += Ad[a, b] * delta[b]
                    for a in range(nx):
                        delta[a] = work[a]
                for i in range(p):
                    shown[i] = e[j, k, i] if np.isfinite(e[j, k, i]) else 0.0  # K and W are 0 there
                    inner[i] = shown[i]
                    for a in range(nx):
                        inner[i] -= C[i, a] * delta[a]
                for i in range(p):
                    out[j, k, i] = 0.0
                    for c in range(i + 1):
                        out[j, k, i] += W[at, i, c] * inner[c]
                for a in range(nx):
                    for i in range(p):
                        delta[a] += K[at, a, i] * inner[i] - K0[a, i] * shown[i]

    return refilter


@numba.njit(cache=True)
def _bleach(colour, size, out):  # type: ignore[no-untyped-def]
    """Take off each channel of `out` (m, n, p) what its own past (p, k) foretells, and scale what is left to 1."""
    m, n, p = out.shape
    past, left = np.zeros(n), np.zeros(n)
    for j in range(m):
        for i in range(p):
            for k in range(n):
                past[k] = left[k] = out[j, k, i]
            for lag in range(1, colour.shape[1] + 1):  # lag by lag, which the processor does in parallel
                for k in range(lag, n):
                    left[k] -= colour[i, lag - 1] * past[k - lag]
            for k in range(n):
                out[j, k, i] = left[k] / size[i]
