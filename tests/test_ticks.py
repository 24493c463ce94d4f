"""What no model says of how a log was made: by which rule a loop integrates, and the shift of time of a simulator."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL

from gsfdi.fit import SHIFT, Knob
from gsfdi.model import Controller, JointModel, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench, starts
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.hand import started
from gsfdi.reconcile.law import check_law
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.say import timed
from gsfdi.reconcile.ticks import shift_knob, shifted
from gsfdi.simulate import replay_many, simulate_record
from gsfdi.types import Array, JointRecord

RECORD = simulate_record(MODEL, seed=5, duration=60.0)
STEP = 0.01


def law_of(model: JointModel) -> Controller:
    assert model.controller is not None
    return model.controller


def between(values: Array, share: float) -> Array:
    """Each value moved by a share of the way to the one before it; to the one after it where `share` is negative."""
    beside = np.concatenate([values[:1], values[:-1]]) if share > 0 else np.concatenate([values[1:], values[-1:]])
    return np.asarray(values + abs(share) * (beside - values))


def moved(record: JointRecord, **shares: float) -> JointRecord:
    """Give a record with channels that are a share of a tick older than their stamps."""
    channels = {**record.channels, **{name: between(record[name], share) for name, share in shares.items()}}
    return replace(record, channels=channels, valid={})


def shown(record: JointRecord, shift: float = 0.0) -> Array:
    """Position and speed that the model itself expects of a record under such a shift [s], no observer beside it."""
    stand = bench([record], MODEL)
    model = replace(started(MODEL, 1), shift=shift)
    x0 = starts([model], bench([RECORD], MODEL).drives[0], 0)
    (trace,) = replay_many([model], stand.drives[0], "predict", x0=x0)
    measured = np.column_stack([record["position"], record["motor_velocity"]])
    return np.asarray(measured - trace.innovation)


@pytest.mark.parametrize("rule", [0.0, 1.0])
def test_the_rule_of_an_integral_is_read_off_the_log_and_is_nobodys_fault(rule: float) -> None:
    strong = replace(MODEL, controller=replace(law_of(MODEL), integral=20.0))
    true = replace(strong, controller=replace(law_of(strong), integral_rule=rule))
    record = simulate_record(true, seed=3, duration=60.0)
    found = check_law([record], strong)
    assert found is not None
    assert (found.integral_rule, found.findings) == (rule, ())
    assert found.after < 1.05 * MODEL.sensors.effort_noise


def test_a_rectangle_counts_half_a_tick_more_or_less_than_a_trapezoid() -> None:
    law = law_of(MODEL)
    half = 0.5 * law.integral / law.sample_rate
    gains = [replace(law, integral_rule=rule).at_once - law.proportional for rule in (0.0, 0.5, 1.0)]
    assert gains == pytest.approx([-half, 0.0, half])


@pytest.mark.parametrize("share", [0.08, -0.08])
def test_an_effort_that_acts_beside_its_stamp_is_the_mean_of_both_that_act(share: float) -> None:
    shifted = shown(RECORD, shift=-share * STEP)
    mixed = shown(moved(RECORD, motor_current=share))
    assert shifted[:-1, 0] == pytest.approx(mixed[:-1, 0], abs=1e-9)
    assert np.abs(shifted - shown(RECORD))[:, 0].max() > 1e-7


@pytest.mark.parametrize("share", [0.08, -0.08])
def test_a_speed_beside_its_stamp_is_expected_there(share: float) -> None:
    now, then = shown(moved(RECORD, motor_current=-share))[:, 1], shown(RECORD, shift=share * STEP)[:, 1]
    assert then[1:] == pytest.approx((now - share * np.diff(now, prepend=now[0]))[1:], abs=1e-9)


def test_a_knob_turns_a_shift() -> None:
    knob = Knob(SHIFT, "shift", 1e-4, -1e-3, 1e-3)
    model = knob.turn(started(MODEL, 1), 5e-4)
    assert knob.read(model) == 5e-4
    assert knob.read(knob.turn(model, 1.0)) == 1e-3


def stepped(steps: int) -> JointRecord:
    """Telemetry of the joint as plain Euler steps make it, the speed before the angle, its integral by rectangles."""
    plant, law, sensors = MODEL.plant, law_of(MODEL), MODEL.sensors
    rng, h, turns = np.random.default_rng(8), STEP / steps, plant.gear_ratio
    motor = plant.motor_inertia * turns**2
    asked = simulate_record(MODEL, seed=8, duration=60.0)
    channels = {name: np.empty(len(asked.t)) for name in ("position", "motor_velocity", "motor_current")}
    turned = at = asked["setpoint"][0]
    speed = rate = swept = 0.0
    for k in range(len(asked.t)):
        noise = rng.standard_normal(3)
        shown = at + sensors.position_noise * noise[0]
        shown = round(shown / sensors.position_resolution) * sensors.position_resolution
        turning = turns * speed + sensors.motor_velocity_noise * noise[1]
        error = asked["setpoint"][k] - shown
        current = law.proportional * error + law.integral * swept
        current += law.derivative * (asked["setpoint_rate"][k] - turning / turns)
        swept += error * STEP
        channels["position"][k], channels["motor_velocity"][k] = shown, turning
        channels["motor_current"][k] = current + sensors.effort_noise * noise[2]
        for _ in range(steps):
            spring = plant.stiffness * (turned - at)
            speed += h * (turns * plant.torque_constant * current - spring) / motor
            rate += h * (spring - plant.damping * rate) / plant.output_inertia
            turned, at = turned + h * speed, at + h * rate
    return replace(asked, channels={**asked.channels, **channels}, valid={})


@pytest.mark.parametrize("steps", [pytest.param(10, marks=pytest.mark.thorough), 100])
def test_how_another_simulator_steps_has_no_name(steps: int) -> None:
    """The speed lags by half a step, efforts act half a step early."""
    answer = reconcile([stepped(steps)], MODEL)
    assert answer.verdict == "no_mismatch"
    assert answer.omitted_physics == ()
    assert ("before their stamps" in answer.says) == (steps == 10)  # the finer ones are not felt


def test_a_log_is_shifted_once() -> None:
    """A shift that had become nothing beside other numbers was fitted a second time, beside itself."""
    first = opening(bench([stepped(10)], MODEL), MODEL, 0.0)
    floor = effort_floor(first.stand)
    held = replace(first, fitted=replace(first.fitted, knobs=[*first.fitted.knobs, shift_knob(first)]))
    assert shifted(first, floor) is not first
    assert shifted(held, floor) is held


@pytest.mark.parametrize(("term", "number"), [("velocity_lag", "lag_s"), ("actuation_delay", "delay_s")])
@pytest.mark.parametrize("late", [0.08, pytest.param(0.3, marks=pytest.mark.thorough)])
def test_what_shifts_one_signal_alone_has_a_name_however_little_it_is(term: str, number: str, late: float) -> None:
    lagging = replace(MODEL, physics=(TermUse(term, {number: late * STEP}),))
    answer = reconcile([simulate_record(lagging, seed=6, duration=60.0)], MODEL)
    assert [entry["term"] for entry in answer.omitted_physics] == [term]
    assert answer.omitted_physics[0]["parameters"][number]["value"] == pytest.approx(late * STEP, rel=0.1)


def test_a_shift_is_told_in_milliseconds() -> None:
    assert timed(0.0) == ""
    assert "efforts act 0.5 ms before their stamps" in timed(5e-4)
    assert "0.25 ms after" in timed(-2.5e-4)
