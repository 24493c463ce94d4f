"""Stribeck friction: its curve fades in one of three ways, which a recording tells apart."""

import numpy as np
import pytest
from joints import MODEL, record
from numpy.testing import assert_allclose

from gsfdi import motion
from gsfdi.reconcile import reconcile
from gsfdi.terms.stribeck_friction import TERM

CURVES = {
    0: lambda x: np.exp(-(x**2)),
    1: lambda x: 1.0 / (1.0 + x**2),
    2: lambda x: np.exp(-np.abs(x)),
}


@pytest.mark.parametrize("curve", CURVES)
def test_the_excess_fades_along_its_curve_either_way(curve: int) -> None:
    speeds, m = np.linspace(-0.05, 0.05, 21), np.zeros(motion.QUANTITIES)
    found = []
    for m[motion.SPEED] in speeds:
        found.append(TERM.law(m, np.array([2.0, 0.01, curve, 0.0]), np.zeros(motion.FEW)))
    assert_allclose(found, 2.0 * CURVES[curve](speeds / 0.01), rtol=1e-12)


@pytest.mark.parametrize("curve", CURVES)
def test_reconcile_tells_the_curve(curve: int) -> None:
    fault = f"stribeck_friction=0.5,velocity_rad_s=0.004,curve={curve}"
    (entry,) = reconcile([record(fault)], MODEL).omitted_physics
    assert entry["term"] == "stribeck_friction"
    assert entry["parameters"]["excess_nm"]["value"] == pytest.approx(0.5, rel=0.05)
    assert entry["parameters"]["velocity_rad_s"]["value"] == pytest.approx(0.004, rel=0.05)
    assert entry["parameters"].get("curve", {"value": 0.0})["value"] == curve
