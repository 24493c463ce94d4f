"""Backlash: what its flanks lose is told where they lose something, and left out where they do not."""

import numpy as np
import pytest
from joints import MODEL, record

from gsfdi import motion
from gsfdi.reconcile import reconcile
from gsfdi.terms.backlash import TERM


def bent(angle: float, rate: float, loss: float) -> float:
    """Deflection beyond a play of 1 either way."""
    m = np.zeros(motion.QUANTITIES)
    m[motion.VALUE], m[motion.WINDUP_RATE] = angle, rate
    return float(TERM.law(m, np.array([1.0, loss]), np.zeros(motion.STATES)))


def test_flanks_push_harder_while_they_close_and_never_pull() -> None:
    assert bent(0.9, 5.0, 0.1) == 0.0
    assert bent(3.0, 0.0, 0.1) == 2.0
    assert bent(3.0, 5.0, 0.1) == pytest.approx(3.0)
    assert bent(-3.0, -5.0, 0.1) == pytest.approx(-3.0)
    assert bent(3.0, -5.0, 0.1) == pytest.approx(1.0)
    assert bent(3.0, -50.0, 0.1) == 0.0


@pytest.mark.parametrize("loss", [0.0, 200.0])
def test_reconcile_tells_whether_flanks_lose_energy(loss: float) -> None:
    (entry,) = reconcile([record(f"backlash=1e-4,loss_s_rad={loss}")], MODEL).omitted_physics
    assert entry["term"] == "backlash"
    told = {name: number["value"] for name, number in entry["parameters"].items()}
    assert told["half_width_rad"] == pytest.approx(1e-4, rel=0.01)
    assert told.get("loss_s_rad", 0.0) == pytest.approx(loss, rel=0.02)
