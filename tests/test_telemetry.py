from dataclasses import replace

import numpy as np

from gsfdi.model import Bus, JointModel, Plant, Sensors
from gsfdi.telemetry import measured_effort, over_bus

MODEL = JointModel("j", "rigid", Plant(1.0))
T = np.arange(20000) / 100


def test_without_a_bus_frames_arrive_as_they_are() -> None:
    t, channels = over_bus(T, {"x": T}, MODEL, 1)
    assert t is T
    assert channels["x"] is T


def test_frames_are_late_lost_and_repeated() -> None:
    model = replace(MODEL, bus=Bus(latency=0.05, jitter=0.002, lost=0.1, repeated=0.05))
    t, channels = over_bus(T, {"x": T}, model, 1)
    assert (np.diff(t) >= 0).all()
    frames, counts = np.unique(channels["x"], return_counts=True)
    assert abs(1 - frames.size / T.size - 0.1) < 0.01
    assert abs(np.mean(counts == 2) - 0.05) < 0.01
    late = t - channels["x"]
    assert late.min() >= 0.05 - 1e-12
    assert abs(np.mean(late) - 0.05 - 0.002 * np.sqrt(2 / np.pi)) < 1e-4
    np.testing.assert_array_equal(over_bus(T, {"x": T}, model, 1)[0], t)


def test_effort_has_noise_and_steps() -> None:
    shown = measured_effort(np.zeros(20000), Sensors(effort_noise=0.01, effort_resolution=0.005), 1)
    assert abs(np.std(shown) - np.hypot(0.01, 0.005 / np.sqrt(12))) < 2e-4
    np.testing.assert_allclose(shown / 0.005, np.rint(shown / 0.005), atol=1e-9)
