"""A model that says nothing of its sensors: their noise is what the recordings show."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL, swinging, without_speed
from rigid import JOINT

from gsfdi.model import Controller, JointModel, Sensors, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.contract import settle_contract
from gsfdi.reconcile.sensing import as_shown, effort_noise
from gsfdi.reconcile.told import told_noise
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord

SILENT = replace(MODEL, sensors=Sensors())
KNOWN = {"speed": True, "law": True}, {"speed": False, "law": True}, {"speed": True, "law": False}


def shown(model: JointModel, speed: bool = True) -> JointRecord:
    record = simulate_record(model, seed=4, duration=60.0)
    return record if speed else without_speed(record)


def test_noise_is_estimated_where_none_is_stated_and_kept_where_it_is() -> None:
    true, found = MODEL.sensors, as_shown([shown(MODEL)], SILENT).sensors
    assert found.position_noise == pytest.approx(true.position_noise, rel=0.1)
    assert found.motor_velocity_noise == pytest.approx(true.motor_velocity_noise, rel=0.3)
    partly = replace(SILENT, sensors=Sensors(position_noise=1.0))
    assert as_shown([shown(MODEL)], partly).sensors.position_noise == 1.0
    assert as_shown([shown(MODEL)], MODEL) == MODEL


def test_a_sensor_that_only_rounds_has_a_resolution_and_no_noise() -> None:
    record = shown(replace(MODEL, sensors=Sensors()))
    coarse = replace(record, channels={**record.channels, "position": np.round(record["position"] / 1e-4) * 1e-4})
    found = as_shown([coarse], SILENT).sensors
    assert found.position_resolution == pytest.approx(1e-4)
    assert found.position_noise == 0.0


def test_the_efforts_noise_is_what_a_law_leaves_that_is_exact() -> None:
    noise = MODEL.sensors.effort_noise
    assert settle_contract([shown(MODEL)], SILENT, ()).level > 0  # the law's own effort drives the model
    untold = settle_contract([shown(MODEL, speed=False)], SILENT, ()).stand
    assert untold.lever > 0
    assert effort_noise(untold.model) == pytest.approx(noise, rel=0.3)


@pytest.mark.parametrize("known", [pytest.param(one, marks=pytest.mark.thorough) for one in KNOWN[:-1]] + [KNOWN[-1]])
def test_a_sound_joint_is_sound_and_friction_is_found_by_a_model_that_states_no_noise(known: dict[str, bool]) -> None:
    nominal = SILENT if known["law"] else replace(SILENT, controller=None)
    assert reconcile([shown(MODEL, known["speed"])], nominal).verdict == "no_mismatch"
    rough = replace(MODEL, physics=(TermUse("coulomb_friction", {"torque_nm": 1.0}, "motor"),))
    answer = reconcile([shown(rough, known["speed"])], nominal)
    (entry,) = answer.omitted_physics
    assert (answer.verdict, entry["term"]) == ("explained", "coulomb_friction")
    assert entry["parameters"]["torque_nm"]["value"] == pytest.approx(1.0, rel=0.1)
    assert answer.updated_model is not None
    assert answer.updated_model.sensors == nominal.sensors


def test_a_told_speed_is_never_taken_to_be_quieter_than_the_effort_that_told_it() -> None:
    rng = np.random.default_rng(1)
    assert told_noise([np.arange(500) / 100], [0.1 * rng.standard_normal(500)], 0.0, 1.0) > 1.0


def test_a_sound_joint_that_hardly_works_is_sound_by_a_model_that_states_no_noise() -> None:
    record = swinging(0.3, 0.1, duration=90.0)
    for lacking in ((), ("motor_velocity", "setpoint", "setpoint_rate")):
        channels = {name: record[name] for name in record.channels if name not in lacking}
        nominal = replace(SILENT, controller=None) if lacking else SILENT
        assert reconcile([replace(record, channels=channels, valid={})], nominal).verdict == "no_mismatch"


def test_an_effort_that_is_rounded_more_coarsely_than_stated_is_no_mismatch() -> None:
    for seed in range(2):
        record = simulate_record(MODEL, seed=seed, duration=60.0)
        rounded = np.round(record["motor_current"] / 1e-3) * 1e-3  # five times the stated noise
        coarse = replace(record, channels={**record.channels, "motor_current": rounded}, valid={})
        assert as_shown([coarse], MODEL).sensors.effort_resolution == pytest.approx(1e-3)
        assert reconcile([coarse], MODEL).verdict == "no_mismatch"


@pytest.mark.parametrize("known", KNOWN)
def test_noise_that_is_stated_far_too_small_is_no_mismatch(known: dict[str, bool]) -> None:
    true = MODEL.sensors
    boasted = replace(
        true,
        position_noise=true.position_noise / 4,
        motor_velocity_noise=true.motor_velocity_noise / 4,
        effort_noise=true.effort_noise / 4,
    )
    nominal = replace(MODEL, sensors=boasted, controller=MODEL.controller if known["law"] else None)
    assert reconcile([shown(MODEL, known["speed"])], nominal).verdict == "no_mismatch"


def test_a_ripple_of_the_motor_is_no_noise() -> None:
    rippling = replace(MODEL, physics=(TermUse("cogging", {"amplitude_nm": 5.0, "order": 9.0, "phase_rad": 0.0}),))
    assert as_shown([shown(rippling)], MODEL) == MODEL


def test_efforts_are_as_quiet_as_a_joint_shows_that_answers_to_the_noise_of_an_unlogged_speed() -> None:
    dry, wet = (
        TermUse("coulomb_friction", {"torque_nm": 4.0}),
        TermUse("viscous_friction", {"coefficient_nms_rad": 4.0}),
    )
    sensors = Sensors(position_noise=1e-5, motor_velocity_noise=8e-4, effort_noise=0.05)
    law = Controller(3000.0, 900.0, 240.0, 125.0, effort="drive_torque")
    true = replace(JOINT, plant=replace(JOINT.plant, output_inertia=3.0), controller=law, sensors=sensors)
    record = without_speed(simulate_record(replace(true, physics=(dry, wet)), seed=5, duration=45.0))
    nominal = replace(true, physics=(dry, wet), controller=None, sensors=Sensors())
    stand = settle_contract([record], as_shown([record], nominal), ()).stand
    assert stand.records[0]["drive_torque"] == pytest.approx(record["drive_torque"])
    assert effort_noise(stand.model) == pytest.approx(0.05, rel=0.2)
    answer = reconcile([record], nominal)
    assert answer.verdict == "no_mismatch"


@pytest.mark.parametrize("joint", [MODEL, JOINT])
def test_a_simulation_without_any_noise_is_no_mismatch(joint: JointModel) -> None:
    silent = replace(joint, sensors=Sensors())
    assert reconcile([simulate_record(silent, seed=1, duration=30.0)], silent).verdict == "no_mismatch"
