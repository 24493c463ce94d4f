"""Numbers that the model itself doubts."""

from dataclasses import replace

import pytest

from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.simulate import simulate_record

BARE = JointModel(
    name="J",
    structure="rigid",
    plant=Plant(output_inertia=2.0, gear_ratio=1.0, torque_constant=0.5),
    controller=Controller(200.0, 100.0, 40.0, 100.0, effort="motor_current"),
    sensors=Sensors(position_noise=1e-5, motor_velocity_noise=1e-3, effort_noise=0.01),
)


def test_friction_is_found_although_the_drive_gain_is_unknown() -> None:
    true = {"viscous_friction": ("coefficient_nms_rad", 2.0), "coulomb_friction": ("torque_nm", 1.5)}
    rough = replace(BARE, physics=tuple(TermUse(term, {name: value}) for term, (name, value) in true.items()))
    guess = replace(BARE, plant=replace(BARE.plant, torque_constant=0.8), trust={"torque_constant": 0.5})
    answer = reconcile([simulate_record(rough, seed=1, duration=30.0)], guess)
    assert {entry["term"] for entry in answer.omitted_physics} == set(true)
    for entry in answer.omitted_physics:
        name, value = true[entry["term"]]
        low, high = entry["parameters"][name]["ci95"]
        assert low < value < high
    assert answer.updated_model is not None
    assert answer.updated_model.plant.torque_constant == pytest.approx(0.5, rel=0.05)
