"""Reconciling recordings that the simulator made: the engine on its own ground, where every number is known."""

from dataclasses import replace

import numpy as np
import pytest

from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.reconcile import Reconciliation, reconcile
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord

NOMINAL = JointModel(
    name="J",
    structure="rigid",
    plant=Plant(output_inertia=2.0, gear_ratio=1.0, torque_constant=1.0),
    controller=Controller(200.0, 100.0, 40.0, 100.0, effort="drive_torque"),
    sensors=Sensors(position_noise=1e-5, motor_velocity_noise=1e-3, effort_noise=0.01),
    effort="drive_torque",
)


def recorded(model: JointModel, seed: int = 1) -> JointRecord:
    return simulate_record(model, seed=seed, duration=30.0)


def told(*terms: TermUse, nominal: JointModel = NOMINAL, seed: int = 1) -> Reconciliation:
    return reconcile([recorded(replace(NOMINAL, physics=terms), seed)], nominal)


def test_nothing_is_found_where_nothing_is_missing() -> None:
    answer = told()
    assert answer.verdict == "no_mismatch"
    assert answer.omitted_physics == ()


def test_friction_is_named_measured_and_written_back() -> None:
    answer = told(TermUse("coulomb_friction", {"torque_nm": 0.4}))
    assert answer.verdict == "explained"
    (entry,) = answer.omitted_physics
    assert entry["term"] == "coulomb_friction"
    low, high = entry["parameters"]["torque_nm"]["ci95"]
    assert low < 0.4 < high
    assert entry["parameters"]["torque_nm"]["value"] == pytest.approx(0.4, rel=0.02)
    assert answer.fit["after"]["drive_torque_nm"] < 0.3 * answer.fit["before"]["drive_torque_nm"]
    assert answer.updated_model is not None
    assert [use.term for use in answer.updated_model.physics] == ["coulomb_friction"]


def test_a_number_that_is_off_is_no_physics() -> None:
    heavy = replace(NOMINAL, plant=replace(NOMINAL.plant, output_inertia=2.4))
    answer = reconcile([recorded(heavy)], NOMINAL)
    assert {entry["term"] for entry in answer.omitted_physics} == {"output_inertia_change"}


def test_a_wrong_gain_is_the_controllers() -> None:
    law = NOMINAL.controller
    assert law is not None
    answer = reconcile([recorded(replace(NOMINAL, controller=replace(law, proportional=240.0)))], NOMINAL)
    assert answer.location["component"] == "controller"
    assert answer.omitted_physics[0]["parameters"]["ratio"]["value"] == pytest.approx(1.2, rel=0.01)


def test_the_same_recording_gives_the_same_answer() -> None:
    record = recorded(replace(NOMINAL, physics=(TermUse("viscous_friction", {"coefficient_nms_rad": 0.5}),)))
    first, second = (reconcile([record], NOMINAL).to_json() for _ in range(2))
    np.testing.assert_equal(first, second)
