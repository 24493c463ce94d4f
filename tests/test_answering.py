"""The effort as an answer to what is logged, of a controller that nobody tells and that is no PID law."""

from dataclasses import replace

import numpy as np
import pytest
from rigid import JOINT

from gsfdi.reconcile import reconcile
from gsfdi.reconcile.answering import FADED, answered, is_white, likeliest_lag
from gsfdi.reconcile.clean import learn_law
from gsfdi.reconcile.contract import settle_contract
from gsfdi.reconcile.sheet import unit_sheets
from gsfdi.simulate import simulate_record
from gsfdi.types import Array, JointRecord

NOISE = 0.05
UNKNOWN = replace(JOINT, controller=None, sensors=replace(JOINT.sensors, effort_noise=NOISE))


def cascade(smoothing: float, seed: int = 1, seconds: float = 60.0) -> tuple[JointRecord, Array]:
    """Record a joint whose loop of speed sees that smoothed over samples, and give the effort that acted."""
    asked, rng, step = simulate_record(JOINT, seed=seed, duration=seconds), np.random.default_rng(seed), 0.01
    setpoint, rate, inertia = asked["setpoint"], asked["setpoint_rate"], JOINT.plant.output_inertia
    shown = {name: np.empty(len(asked.t)) for name in ("position", "joint_velocity", "drive_torque")}
    angle, speed, seen, swept, acted = setpoint[0], rate[0], rate[0], 0.0, np.empty(len(asked.t))
    for k in range(len(asked.t)):
        shown["position"][k] = angle + JOINT.sensors.position_noise * rng.standard_normal()
        shown["joint_velocity"][k] = speed + JOINT.sensors.motor_velocity_noise * rng.standard_normal()
        seen += (shown["joint_velocity"][k] - seen) / (1.0 + smoothing)
        short = 5.0 * (setpoint[k] - shown["position"][k]) + rate[k] - seen
        swept += step * short
        acted[k] = 20.0 * short + 30.0 * swept
        shown["drive_torque"][k] = acted[k] + NOISE * rng.standard_normal()
        angle += step * speed + 0.5 * step**2 * acted[k] / inertia
        speed += step * acted[k] / inertia
    return replace(asked, channels={"setpoint": setpoint, "setpoint_rate": rate, **shown}, valid={}), acted


@pytest.mark.parametrize("smoothing", [2.0, 3.5])
def test_the_effort_of_a_cascade_is_told_far_better_than_its_sensor_does(smoothing: float) -> None:
    record, acted = cascade(smoothing)
    found = answered([record], UNKNOWN)
    assert found is not None
    off = float(np.std((found.records[0]["drive_torque"] - acted)[FADED:]))
    assert found.needed <= 6
    assert off < 2.0 * NOISE * (found.needed / len(record.t)) ** 0.5
    assert off < found.noise < 0.15 * NOISE


def test_what_a_law_leaves_is_noise_though_that_is_stated_far_too_small_or_not_at_all() -> None:
    record, acted = cascade(2.0)
    for stated in (NOISE / 3, 0.0):
        found = answered([record], replace(UNKNOWN, sensors=replace(UNKNOWN.sensors, effort_noise=stated)))
        assert found is not None
        assert float(np.std((found.records[0]["drive_torque"] - acted)[FADED:])) < 0.15 * NOISE


def test_of_two_laws_that_leave_as_much_the_one_of_fewer_parts_is_learnt_and_its_doubt_is_remembered() -> None:
    record, _ = cascade(3.5)
    found, stand = answered([record], UNKNOWN), settle_contract([record], UNKNOWN, ()).stand
    assert found is not None
    assert stand.learnt == pytest.approx(found.noise / stand.scales.effort, rel=0.3)
    sheets = unit_sheets([record], UNKNOWN)
    assert sheets is not None
    assert likeliest_lag(sheets[1]) == pytest.approx(3.5, abs=0.5)


def test_a_filtered_law_is_no_pid_law_and_a_fault_free_joint_lacks_nothing() -> None:
    record, _ = cascade(3.5)
    assert learn_law([record], UNKNOWN) is None
    assert reconcile([record], UNKNOWN).verdict == "no_mismatch"


def test_an_effort_that_answers_something_else_is_left_alone() -> None:
    record, acted = cascade(2.0)
    other = acted + NOISE * np.sin(2 * np.pi * 0.5 * record.t)
    assert answered([replace(record, channels={**record.channels, "drive_torque": other}, valid={})], UNKNOWN) is None
    silent = {name: record[name] for name in ("position", "joint_velocity", "drive_torque")}
    assert answered([replace(record, channels=silent, valid={})], UNKNOWN) is None


@pytest.mark.parametrize("seconds", [0.8, 1.5])
def test_no_law_is_learnt_from_less_than_its_parts_need(seconds: float) -> None:
    assert answered([cascade(2.0, seconds=seconds)[0]], UNKNOWN) is None


def test_white_noise_averages_out_and_smoothed_noise_does_not() -> None:
    noise = np.random.default_rng(0).standard_normal((3, 2000))
    assert is_white(list(noise))
    assert not is_white([np.convolve(one, np.ones(4)) for one in noise])
