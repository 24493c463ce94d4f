"""A wave over a step, against its integrals."""

import numpy as np
import pytest

from gsfdi.motion import EARLY, GEAR, MOTOR_TURN, QUANTITIES, SPEED, STEP
from gsfdi.wave import half_phase, shrunk, sine


@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-3, 0.4])
def test_a_wave_gives_its_mean_and_how_early_it_acts(step: float) -> None:
    size, order, phase, gear, speed, turn = 2.0, 12.0, 0.7, 50.0, 0.01, 3.1
    m = np.zeros(QUANTITIES)
    m[GEAR], m[SPEED], m[MOTOR_TURN], m[STEP] = gear, speed, turn, step
    gone = (np.arange(20000) + 0.5) / 20000  # shares of the step
    wave = size * np.sin(order * (turn + gear * speed * step * (gone - 0.5)) + phase)
    assert sine(m, size, order, phase) == pytest.approx(np.mean(wave), abs=1e-8)
    assert m[EARLY] == pytest.approx(np.mean(wave * (0.5 - gone)), abs=1e-8)
    assert shrunk(half_phase(m, order)) * size * np.sin(order * turn + phase) == pytest.approx(np.mean(wave), abs=1e-8)
