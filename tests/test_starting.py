from dataclasses import replace

import numpy as np
import pytest

from gsfdi.model import Controller, JointModel, Plant, Sensors, Structure, TermUse
from gsfdi.starting import Signals, Start, initial_state, start_of

LAW = Controller(28.0, 4.0, 17.0, 100.0)
NOISE = Sensors(position_noise=4e-6, motor_velocity_noise=2e-3)
ERA = JointModel("era", "flexible", Plant(400.0, 0.0011, 260.6, 130000.0, 0.4, 0.6), controller=LAW, sensors=NOISE)


def steady() -> Signals:
    """A joint that starts in motion, with an integrator that already carries something."""
    t = np.arange(200) / 100
    position, speed = 0.3 + 0.05 * t, np.full(t.size, 0.05)
    effort = LAW.proportional * 1e-3 + 0.07 + LAW.integral * 1e-3 * t
    return Signals(t, position + 1e-3, speed, 0 * t, effort, position, 260.6 * speed, 0 * t + 20)


def test_the_start_is_the_recordings_own() -> None:
    start = start_of(steady(), ERA)
    assert start.angle == pytest.approx(0.3, abs=1e-5)
    assert start.speed == pytest.approx(0.05, abs=1e-4)
    assert start.motor_speed == pytest.approx(0.05, abs=1e-4)
    assert start.integral == pytest.approx(0.07)


def test_it_works_without_speed_or_effort() -> None:
    signals = steady()
    blank = np.full(signals.t.size, np.nan)
    start = start_of(signals._replace(velocity=blank), ERA)
    assert start.angle == pytest.approx(0.3, abs=1e-4)
    start = start_of(signals._replace(velocity=blank, effort=blank), replace(ERA, structure="rigid", controller=None))
    assert start.speed == pytest.approx(0.05, abs=1e-6)
    nothing = start_of(signals._replace(position=blank, velocity=blank), ERA)
    assert nothing.angle == signals.setpoint[0]


def test_masked_samples_do_not_count() -> None:
    signals = steady()
    holes = signals.position.copy()
    holes[[0, 3, 4]] = np.nan
    assert start_of(signals._replace(position=holes), ERA).angle == pytest.approx(0.3, abs=1e-5)


def test_the_spring_is_wound_against_what_resists() -> None:
    start = Start(0.3, 0.0, 0.0, -13.0 / 400.0, 0.0)
    assert initial_state(ERA, start)[2] == pytest.approx(13.0 / 130000.0)
    gap = replace(ERA, physics=(TermUse("backlash", {"half_width_rad": 1e-3}),))
    assert initial_state(gap, start)[2] == pytest.approx(1e-3 + 13.0 / 130000.0)
    worn = replace(ERA, physics=(TermUse("backlash", {"half_width_rad": 0.3}),))
    assert initial_state(worn, start)[2] == pytest.approx(0.3 + 13.0 / 130000.0)
    stiff = replace(ERA, physics=(TermUse("stiffening", {"cubic_per_rad2": 1e8}),))
    windup = initial_state(stiff, start)[2]
    assert 130000.0 * windup * (1 + 1e8 * windup**2) == pytest.approx(13.0)
    hanging = replace(ERA, physics=(TermUse("gravity_unbalance", {"torque_nm": 40.0, "angle_rad": 0.0}),))
    assert initial_state(hanging, start)[2] == pytest.approx((13.0 - 40.0 * np.sin(0.3)) / 130000.0)


def test_a_wrong_sensor_is_seen_through_where_the_angle_is_what_it_showed() -> None:
    long = replace(ERA, physics=(TermUse("position_gain", {"ratio": 1.06}),))
    wavy = replace(
        ERA, physics=(TermUse("encoder_eccentricity", {"amplitude_rad": 0.01, "order": 3.0, "phase_rad": 0.2}),)
    )
    shown = start_of(steady(), ERA)
    assert shown.shown
    assert joint_angle(long, shown) == pytest.approx(shown.angle / 1.06)
    angle = joint_angle(wavy, shown)
    assert angle + 0.01 * np.sin(3.0 * angle + 0.2) == pytest.approx(shown.angle)
    assert joint_angle(long, Start(0.3, 0.0, 0.0, 0.0, 0.0)) == pytest.approx(0.3)


@pytest.mark.parametrize("structure", ["flexible", "rigid"])
@pytest.mark.parametrize(
    ("term", "values"),
    [("velocity_bias", {"bias_rad_s": 0.11}), ("velocity_gain", {"ratio": 0.97}), ("velocity_gain", {"ratio": 2.9})],
)
def test_a_joint_begins_no_faster_because_its_speed_sensor_is_wrong(
    structure: Structure, term: str, values: dict[str, float]
) -> None:
    nominal = replace(ERA, structure=structure)
    turns = 1.0 if structure == "rigid" else 260.6
    true = steady()._replace(velocity=turns * np.full(200, 0.05))
    wrong = values.get("ratio", 1.0) * true.velocity + values.get("bias_rad_s", 0.0)
    told = replace(nominal, physics=(TermUse(term, values),))
    right = initial_state(nominal, start_of(true, nominal))
    found = initial_state(told, start_of(true._replace(velocity=wrong), nominal))
    assert found[:4] == pytest.approx(right[:4], rel=1e-2, abs=1e-7)


def test_a_spring_that_is_no_number_is_left_unwound() -> None:
    gap = replace(ERA, physics=(TermUse("backlash", {"half_width_rad": 1e-3}),))
    assert np.isnan(initial_state(gap, Start(0.3, 0.0, 0.0, float("nan"), 0.0))[2])


def joint_angle(model: JointModel, start: Start) -> float:
    """Angle of the output at the start: the motor's, and the wind-up."""
    state = initial_state(model, start)
    return float(state[0] + state[2])


@pytest.mark.parametrize(("onset", "bias"), [(12.0, 0.002), (30.0, 0.0)])
def test_a_recording_that_goes_on_after_a_gap_begins_with_what_has_set_in_by_then(onset: float, bias: float) -> None:
    """A joint began where its sensor said, off by the bias that this had got before, and nothing had a name."""
    later = steady()._replace(t=steady().t + 20.0)
    biased = replace(ERA, physics=(TermUse("position_bias", {"bias_rad": 0.002}, onset=onset),))
    plain, begun = initial_state(ERA, start_of(later, ERA)), initial_state(biased, start_of(later, biased))
    assert plain[0] - begun[0] == pytest.approx(bias, abs=1e-9)
