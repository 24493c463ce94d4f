import numpy as np
import pytest

from gsfdi.drive import drive_from, drive_of, regular
from gsfdi.errors import UnusableInputError
from gsfdi.model import Controller, JointModel, Plant
from gsfdi.replay import layout
from gsfdi.starting import Signals, Start
from gsfdi.types import JointRecord

LAW = Controller(28.0, 4.0, 17.0, 100.0)
ERA = JointModel("era", "flexible", Plant(400.0, 0.0011, 260.6, 130000.0, 0.4, 0.6), controller=LAW)


def signals(t: np.ndarray) -> Signals:
    blank = np.full(t.size, np.nan)
    return Signals(t, 0.1 * t, 0 * t + 0.1, 0 * t, np.arange(t.size) * 1.0, blank, blank, 0 * t + 20)


def events(t: np.ndarray, rate: float = 100.0) -> np.ndarray:
    model = JointModel("j", "flexible", ERA.plant, controller=Controller(1, 0, 1, rate))
    return drive_from(signals(t), model, Start(0, 0, 0, 0, 0)).clock.events


def test_a_recording_at_the_controllers_rate_is_its_own_clock() -> None:
    t = np.arange(50) / 100
    e = events(t)
    np.testing.assert_allclose(e[:, layout.TIME], t)
    assert e[:, layout.TICK].all()
    np.testing.assert_array_equal(e[:, layout.RECORD], np.arange(50))


def test_a_slower_recording_has_ticks_between_its_samples() -> None:
    e = events(np.arange(20) / 20)
    assert e.shape[0] == 96
    assert e[:, layout.TICK].all()
    np.testing.assert_allclose(np.diff(e[:, layout.TIME]), 0.01)
    np.testing.assert_allclose(e[:, layout.SETPOINT], 0.1 * e[:, layout.TIME])
    np.testing.assert_allclose(e[:, layout.EFFORT], 20 * e[:, layout.TIME], atol=1e-12)


def test_a_slower_recording_drives_by_the_mean_effort_from_sample_to_sample() -> None:
    model = JointModel("j", "flexible", ERA.plant, controller=Controller(1, 0, 1, 1000.0))
    t = np.arange(200) / 100
    seen = signals(t)._replace(effort=np.sin(6 * t))
    drive = drive_from(seen, model, Start(0, 0, 0, 0, 0))
    ticks = drive.clock.events
    every_tick = np.sin(6 * ticks[:, layout.TIME])
    mean = np.array([every_tick[10 * k : 10 * k + 10].mean() for k in range(199)])
    np.testing.assert_allclose(ticks[:, layout.EFFORT], every_tick, atol=2e-6)
    np.testing.assert_array_equal(drive.logged.events[:, layout.RECORD], np.arange(200))
    np.testing.assert_allclose(drive.logged.events[:-1, layout.EFFORT], mean, atol=2e-6)


def test_a_lost_effort_of_a_slower_recording_is_bridged() -> None:
    model = JointModel("j", "flexible", ERA.plant, controller=Controller(1, 0, 1, 1000.0))
    t = np.arange(200) / 100
    effort = np.sin(6 * t)
    effort[50] = np.nan
    drive = drive_from(signals(t)._replace(effort=effort), model, Start(0, 0, 0, 0, 0))
    np.testing.assert_allclose(drive.clock.events[:, layout.EFFORT], np.sin(6 * drive.clock.events[:, 0]), atol=2e-5)


def test_a_recording_at_the_controllers_rate_drives_by_what_it_holds() -> None:
    drive = drive_from(signals(np.arange(50) / 100), ERA, Start(0, 0, 0, 0, 0))
    assert drive.logged is drive.clock


def test_a_faster_recording_has_samples_between_the_ticks() -> None:
    e = events(np.arange(1000) / 1000)
    assert e.shape[0] == 1000
    np.testing.assert_array_equal(np.flatnonzero(e[:, layout.TICK]), np.arange(0, 1000, 10))


def test_a_gap_is_bridged_by_ticks() -> None:
    t = np.concatenate([np.arange(10), np.arange(30, 40)]) / 100
    e = events(t)
    assert e.shape[0] == 40
    np.testing.assert_allclose(e[:, layout.TIME], np.arange(40) / 100, atol=1e-12)


def test_without_a_controller_nothing_ticks() -> None:
    model = JointModel("j", "flexible", ERA.plant)
    drive = drive_from(signals(np.arange(10) / 7.0), model, Start(0, 0, 0, 0, 0))
    assert not drive.clock.events[:, layout.TICK].any()


def test_jitter_of_stamps_is_told_from_irregular_sampling() -> None:
    rng = np.random.default_rng(1)
    grid = np.arange(100) / 100
    np.testing.assert_array_equal(np.diff(regular(grid + rng.uniform(-4e-6, 4e-6, 100))).round(7), 0.01)
    odd = grid + rng.uniform(-2e-3, 2e-3, 100)
    np.testing.assert_array_equal(regular(odd), odd)


def recorded(**channels: np.ndarray) -> JointRecord:
    return JointRecord("r", "j", 0, channels.pop("t"), channels)


def test_masked_samples_and_missing_channels() -> None:
    t = np.arange(100) / 100
    position = 0.1 * t
    position[:2] = np.nan
    drive = drive_of(recorded(t=t, position=position, setpoint=0.1 * t), ERA)
    assert np.isnan(drive.signals.velocity).all()
    np.testing.assert_allclose(drive.signals.setpoint_rate, 0.1)
    np.testing.assert_array_equal(drive.signals.temperature, 20.0)


def test_too_short_a_recording_is_refused() -> None:
    with pytest.raises(UnusableInputError, match="2 samples"):
        drive_of(recorded(t=np.array([0.0, 0.1]), position=np.zeros(2)), ERA)


def test_a_recording_that_speaks_another_effort_is_refused() -> None:
    t = np.arange(10) / 10
    with pytest.raises(UnusableInputError, match="drive_torque"):
        drive_of(recorded(t=t, position=t, setpoint=t, drive_torque=t), ERA)
