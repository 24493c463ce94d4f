"""Joints without a gearbox, light or logged for a moment only: whatever their units, a filter for them is found."""

from types import SimpleNamespace

import numpy as np
import pytest

from gsfdi.model import Controller, JointModel, Plant, Sensors
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.balance import greedily
from gsfdi.simulate import simulate_record
from gsfdi.whiten import observed, steady_gain


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 1e3])
def test_the_units_of_a_joint_do_not_decide_whether_a_filter_is_found(size: float) -> None:
    plant = Plant(1.35 * size, 0.6 * size, 1.0, 570.0 * size, 1.1 * size, 0.1)
    system = observed(JointModel("J", "flexible", plant), 0.02, (6.9e-14, 4e-10))
    gain = steady_gain(system, np.array([1.4e-3, 1.4e-3]) * size)[:, :2]
    left = system.Ad @ (np.eye(4) - gain @ system.C)
    assert np.abs(np.linalg.eigvals(left)).max() < 1.0


def test_a_light_joint_without_a_gearbox_is_sound() -> None:
    plant = Plant(7.5e-4, 2.5e-4, 1.0, 60.0, 8e-3, 0.2)
    law = Controller(2.2, 1.4, 0.1, 200.0)
    model = JointModel("J", "flexible", plant, controller=law, sensors=Sensors(0.0, 2e-7, 0.0, 2e-6, 0.0, 1e-5))
    assert reconcile([simulate_record(model, seed=1, duration=20.0)], model).verdict == "no_mismatch"


def test_fewer_rows_than_a_law_has_columns_tell_nothing() -> None:
    law = SimpleNamespace(possible=lambda values: True)
    rng = np.random.default_rng(1)
    torque, columns = rng.standard_normal(8), rng.standard_normal((8, 3))
    assert greedily(torque, [columns], [law]) == [0]  # type: ignore[list-item]
    assert greedily(torque[:2], [columns[:2]], [law]) == []  # type: ignore[list-item]
