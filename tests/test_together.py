"""Numbers that are known better together than alone."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from joints import MODEL, off

from gsfdi.fit import Knob
from gsfdi.model import TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile import together as module
from gsfdi.reconcile.together import together
from gsfdi.simulate import simulate_record
from gsfdi.types import Array


def hand_of(relative: Array, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Give a round with an inertia of 4, a torque constant of 2 and a found load of -8, so known."""
    values = np.array([4.0, 2.0, -8.0])
    monkeypatch.setattr(module, "spread_of", lambda *_: relative * np.outer(values, values))
    knobs = [Knob(-1, "output_inertia", 1.0, 0.0, 9.0), Knob(-1, "torque_constant", 1.0, 0.0, 9.0)]
    model = replace(MODEL, physics=(TermUse("constant_load", {"torque_nm": -8.0}, "output"),))
    fitted = SimpleNamespace(knobs=[*knobs, Knob(0, "torque_nm", 1.0, -9.0, 9.0)], values=values, model=model)
    return SimpleNamespace(fitted=fitted, stand=SimpleNamespace(model=MODEL, blocks=lambda: None))


def test_a_common_scale_leaves_quotients(monkeypatch: pytest.MonkeyPatch) -> None:
    relative = 0.03**2 + np.diag([1e-5, 0.0, 1e-6])
    load, inertia = together(hand_of(relative, monkeypatch), given=0)
    assert load["of"] == "torque_constant_nm_a / constant_load.output.torque_nm"
    assert load["value"] == -0.25
    assert inertia["of"] == "output_inertia_kg_m2 / torque_constant_nm_a"
    assert inertia["ci95"] == pytest.approx([2.0 - 0.0137, 2.0 + 0.0137], abs=1e-4)  # 1.96 times 3.5 in a thousand


def test_what_goes_against_each_other_has_a_product(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = np.array([1.0, -1.0, 0.0])
    (pair,) = together(hand_of(np.outer(0.03 * ways, 0.03 * ways) + 1e-8 * np.eye(3), monkeypatch), given=0)
    assert (pair["of"], pair["value"]) == ("output_inertia_kg_m2 · torque_constant_nm_a", 8.0)


@pytest.mark.parametrize("relative", [1e-5, 1e-3])
def test_what_is_known_or_has_nothing_in_common_is_left_alone(relative: float, monkeypatch: pytest.MonkeyPatch) -> None:
    assert together(hand_of(relative * np.eye(3), monkeypatch), given=0) == []
    assert together(hand_of(np.full((3, 3), 9e-4), monkeypatch), given=1)[1:] == []  # the nominal model's own term


def test_quotients_hold_where_the_scale_of_torque_is_the_nominal_models() -> None:
    load = TermUse("coulomb_friction", {"torque_nm": 4.0}, "motor")
    joint = off(torque_constant=1.03, output_inertia=0.98, motor_inertia=1.02, stiffness=0.97)
    true, plant = replace(joint, physics=(load,)), joint.plant
    answer = reconcile([simulate_record(true, seed=2, duration=40.0)], MODEL)
    numbers = {
        "output_inertia_kg_m2": plant.output_inertia,
        "motor_inertia_kg_m2": plant.motor_inertia,
        "torque_constant_nm_a": plant.torque_constant,
        "gearbox_stiffness_nm_rad": plant.stiffness,
        "coulomb_friction.motor.torque_nm": 4.0,
    }
    assert len(answer.together) >= 3
    assert answer.to_json()["together"] == list(answer.together)
    for pair in answer.together:
        one, other = (numbers[name] for name in pair["of"].split(" / "))
        low, high = pair["ci95"]
        assert high - low < 0.02 * pair["value"]
        assert low - 0.5 * (high - low) < one / other < high + 0.5 * (high - low)
