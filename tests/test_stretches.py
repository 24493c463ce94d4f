import numpy as np
import pytest

from gsfdi.stretches import lone_samples, sampling_step, stretches
from gsfdi.types import JointRecord


def recorded(t: np.ndarray, **channels: np.ndarray) -> JointRecord:
    return JointRecord("r", "j", 0, t, channels)


def test_even_samples_pass_untouched() -> None:
    t = 0.01 * np.arange(300)
    q = np.random.default_rng(0).standard_normal(300)
    (part,) = stretches(recorded(t, position=q), ["position"], 0.01)
    assert np.array_equal(part.values["position"], q)
    assert part.t == pytest.approx(t)
    assert part.trusted.all()


def test_jitter_is_interpolated() -> None:
    rng = np.random.default_rng(1)
    t = np.cumsum(0.02 + 0.005 * rng.standard_normal(500)).clip(0)
    t = np.sort(t)
    (part,) = stretches(recorded(t, position=np.sin(t)), ["position"], 0.02)
    assert part.values["position"] == pytest.approx(np.sin(part.t), abs=1e-3)


def test_a_long_pause_parts_two_stretches() -> None:
    t = np.concatenate([0.01 * np.arange(200), 5.0 + 0.01 * np.arange(200)])
    parts = list(stretches(recorded(t, position=np.sin(t)), ["position"], 0.01))
    assert [round(part.start, 2) for part in parts] == [0.0, 5.0]


def test_channels_of_different_times_meet_on_one_grid() -> None:
    t = 0.005 * np.arange(800)
    a, b = np.full(800, np.nan), np.full(800, np.nan)
    a[::2], b[1::2] = np.sin(t[::2]), np.cos(t[1::2])
    (part,) = stretches(recorded(t, position=a, motor_current=b), ["position", "motor_current"], 0.01)
    assert part.values["motor_current"] == pytest.approx(np.cos(part.t), abs=1e-3)


@pytest.mark.parametrize("value", [1e165, -40.0, 25.0])
def test_a_lone_value_is_bridged_and_a_step_is_kept(value: float) -> None:
    q = np.sin(0.01 * np.arange(400)) + 1e-4 * np.random.default_rng(2).standard_normal(400)
    q[200:] += 0.5
    q[77] = value
    assert np.flatnonzero(lone_samples(q)).tolist() == [77]


def test_missing_samples_are_bridged_as_interpolation_has_it() -> None:
    t = 0.01 * np.arange(400)
    q = np.random.default_rng(3).standard_normal(400)
    missing = np.isin(np.arange(400), [50, 51, 120, 398])
    (part,) = stretches(recorded(t, position=np.where(missing, np.nan, q)), ["position"], 0.01)
    assert part.values["position"] == pytest.approx(np.interp(t, t[~missing], q[~missing]))
    # A line is not what was measured, and the sample after it has none before it to be judged by.
    assert np.flatnonzero(~part.trusted).tolist() == [50, 51, 52, 120, 121, 398, 399]


def test_a_stretch_that_is_too_short_is_passed_over() -> None:
    t = 0.01 * np.arange(30)
    assert not list(stretches(recorded(t, position=t), ["position"], 0.01))


def test_the_usual_spacing_is_the_median() -> None:
    t = np.concatenate([0.01 * np.arange(100), [9.0]])
    assert sampling_step([recorded(t, position=t)]) == pytest.approx(0.01)
