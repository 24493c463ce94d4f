"""Numbers that the model itself doubts."""

from dataclasses import replace

import pytest
from rigid import JOINT

from gsfdi.model import TermUse
from gsfdi.reconcile import reconcile
from gsfdi.simulate import simulate_record

assert JOINT.controller is not None
BARE = replace(
    JOINT,
    plant=replace(JOINT.plant, torque_constant=0.5),
    controller=replace(JOINT.controller, effort="motor_current"),
    effort="motor_current",
)


def test_friction_is_found_although_the_drive_gain_is_unknown() -> None:
    true = {"viscous_friction": ("coefficient_nms_rad", 2.0), "coulomb_friction": ("torque_nm", 1.5)}
    rough = replace(BARE, physics=tuple(TermUse(term, {name: value}) for term, (name, value) in true.items()))
    guess = replace(BARE, plant=replace(BARE.plant, torque_constant=0.8), trust={"torque_constant": 0.5})
    answer = reconcile([simulate_record(rough, seed=1, duration=15.0)], guess)
    assert {entry["term"] for entry in answer.omitted_physics} == set(true)
    for entry in answer.omitted_physics:
        name, value = true[entry["term"]]
        low, high = entry["parameters"][name]["ci95"]
        assert low < value < high
    assert answer.updated_model is not None
    assert answer.updated_model.plant.torque_constant == pytest.approx(0.5, rel=0.05)
