import numpy as np
import pytest

from gsfdi.training import ACCELERATION, REACH, SPEED, training


@pytest.mark.parametrize("axis", ["rotary", "linear"])
def test_it_moves_within_its_limits(axis: str) -> None:
    s = training(axis, 200.0, 120.0, 1)  # type: ignore[arg-type]
    assert np.max(np.abs(s.setpoint)) < 1.05 * REACH[axis]  # type: ignore[index]
    assert np.max(np.abs(s.setpoint_rate)) < 1.5 * SPEED[axis]  # type: ignore[index]
    slow = np.convolve(s.setpoint_rate, np.ones(200) / 200, "same")  # without the excitation
    assert np.max(np.abs(np.gradient(slow, s.t))) < 1.2 * ACCELERATION[axis]  # type: ignore[index]
    assert np.mean(np.abs(slow) < 1e-3) > 0.02  # dwells
    assert np.count_nonzero(np.diff(np.sign(slow[np.abs(slow) > 1e-3]))) > 3  # reversals


def test_rate_is_the_derivative_of_the_setpoint() -> None:
    s = training("rotary", 1000.0, 60.0, 2)
    np.testing.assert_allclose(np.gradient(s.setpoint, s.t)[1:-1], s.setpoint_rate[1:-1], atol=3e-4 * 0.08)


def test_a_seed_is_a_motion() -> None:
    assert np.array_equal(training("rotary", 100.0, 30.0, 1).setpoint, training("rotary", 100.0, 30.0, 1).setpoint)
    assert not np.allclose(training("rotary", 100.0, 30.0, 1).setpoint, training("rotary", 100.0, 30.0, 2).setpoint)
