"""Orders of waves that are worth trying."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL

from gsfdi.model import TermUse
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.waves import worthy_orders
from gsfdi.simulate import simulate_record


@pytest.mark.parametrize("order", [7.0, 61.0])
def test_a_wave_is_found_although_at_full_speed_it_is_too_fast_for_the_sampling(order: float) -> None:
    wave = TermUse("cogging", {"amplitude_nm": 2.0, "order": order, "phase_rad": 0.4})
    record = simulate_record(replace(MODEL, physics=(wave,)), seed=1, duration=60.0)
    turn = float(np.median(np.diff(record.t))) * np.abs(record["motor_velocity"]).max()
    assert (order * turn > np.pi) == (order > 10.0)
    hand = opening(bench([record], MODEL), MODEL, 0.0)
    assert worthy_orders(hand)["cogging"][0] == order
