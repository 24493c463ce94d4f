"""What small torques and sensor errors leave in the innovations, by linear theory."""

import numba
import numpy as np

from gsfdi.types import Array
from gsfdi.whiten.system import Ints, Observed


def respond(system: Observed, base: Array, torque: Array, sensed: Array, steps: Ints) -> Array:
    """Innovations ``(m, n, 2)`` under the gain `base` that small torques and sensor errors leave, by linear theory.

    Parameters
    ----------
    system : Observed
        The discrete linear joint.
    torque : (m, n, k) array
        Extra torque that drives each side, held from each sample to the next [N m].
    sensed : (m, n, 2) array
        What is added to measured position and motor speed.
    steps : (n,) int array
        Whole periods since the sample before; 0 where a stretch starts anew.
    """
    rows = list(system.rows)
    out = np.zeros((len(torque), torque.shape[1], len(rows)))
    gain = np.ascontiguousarray(base[: len(system.Ad), rows])
    _respond(system.Ad, system.Bt, system.C, gain, torque, np.ascontiguousarray(sensed[..., rows]), steps, out)
    whole = np.full((*torque.shape[:2], 2), np.nan)
    whole[..., rows] = out
    return whole


@numba.njit(cache=True)
def _respond(Ad, Bt, C, K0, torque, sensed, steps, out):  # type: ignore[no-untyped-def]
    """Innovations that torques and sensor errors leave in the observer; torque (m, n, q), sensed and out (m, n, p)."""
    m, n, p = out.shape
    nx, q = Bt.shape
    delta, work = np.zeros(nx), np.zeros(nx)
    for j in range(m):
        delta[:] = 0.0
        for k in range(n):
            if steps[k] == 0:
                delta[:] = 0.0
            else:
                for a in range(nx):
                    total = 0.0
                    for b in range(nx):
                        total += Ad[a, b] * delta[b]
                    for b in range(q):
                        total += Bt[a, b] * torque[j, k - 1, b]
                    work[a] = total
                for a in range(nx):  # which compiles sooner than arrays assigned to arrays
                    delta[a] = work[a]
            for i in range(p):
                out[j, k, i] = sensed[j, k, i]
                for a in range(nx):
                    out[j, k, i] += C[i, a] * delta[a]
            for a in range(nx):
                for i in range(p):
                    delta[a] -= K0[a, i] * out[j, k, i]
