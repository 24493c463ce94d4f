"""Innovations under any gain become those of the Kalman filter, whatever is lost of either channel."""

import numpy as np
import pytest
from joints import MODEL

from gsfdi.types import Array, Mask
from gsfdi.whiten import Observed, observed, steady_gain, whitener

COUNT, TORQUE, DOUBT = 900, np.array([0.5, 0.1]), 1e-6 * np.eye(4)


def lost() -> Mask:
    """Where single positions, single speeds and both are left out."""
    present = np.ones((COUNT, 2), dtype=np.bool_)
    present[300:303, 1] = False
    present[301, 0] = False
    present[500, 0] = present[20, 1] = False
    present[700:705] = False
    return present


def under(gain: Array, system: Observed, measured: Array, present: Mask, unmeasured: float) -> Array:
    """Give the innovations of an observer, which believes an innovation of `unmeasured` where nothing is."""
    shown, x = np.zeros((COUNT, 2)), np.zeros(4)
    for k in range(COUNT):
        x = system.Ad @ x
        shown[k] = np.where(present[k], measured[k] - system.C @ x, unmeasured)
        x = x + gain @ np.nan_to_num(shown[k])
    return shown


def kalman(system: Observed, measured: Array, present: Mask) -> tuple[Array, Array]:
    """White innovations and log-determinants by the textbook, channel by channel."""
    white, logdet, R = np.zeros((COUNT, 2)), np.zeros(COUNT), np.diag(system.R)
    after, P, Q = np.zeros(4), DOUBT, (system.Bt * TORQUE**2) @ system.Bt.T
    apart, calm = system.Ad - system.common @ system.C, Q - system.common @ R @ system.common.T
    for k in range(COUNT):
        x = after
        if k and present[k - 1, 1]:  # what the speed's noise tells of the drive's
            x, P = apart @ after + system.common @ measured[k - 1], apart @ P @ apart.T + calm
        elif k:
            x, P = system.Ad @ after, system.Ad @ P @ system.Ad.T + Q
        rows = np.flatnonzero(present[k])
        C = system.C[rows]
        S = C @ P @ C.T + R[np.ix_(rows, rows)]
        K, e = P @ C.T @ np.linalg.inv(S), measured[k, rows] - C @ x
        white[k, rows], logdet[k] = np.linalg.solve(np.linalg.cholesky(S), e), np.log(np.linalg.det(S))
        after, P = x + K @ e, (np.eye(4) - K @ C) @ P
    return white, logdet


@pytest.mark.parametrize("shared", [0.0, 1e-4])
@pytest.mark.parametrize("unmeasured", [np.nan, 7e-4])
def test_each_channel_is_used_where_the_other_is_lost(shared: float, unmeasured: float) -> None:
    system, present = observed(MODEL, 0.01, (4e-10, 1e-6), shared), lost()
    gain = steady_gain(system, TORQUE)
    measured = 1e-4 * np.random.default_rng(4).standard_normal((COUNT, 2)).cumsum(axis=0)
    tool = whitener(system, gain, DOUBT, TORQUE, np.r_[0, np.ones(COUNT - 1, dtype=np.int64)], present)
    white, logdet = kalman(system, measured, present)
    found = tool(under(gain, system, measured, present, unmeasured)).reshape(COUNT, 2)
    assert found == pytest.approx(white, rel=1e-4, abs=1e-4)
    assert tool.logdet[tool.place] == pytest.approx(logdet, abs=1e-6)
    assert (found[~present] == 0).all()
