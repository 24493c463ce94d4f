"""Frictions that a nominal model holds and that have changed: the gauge of torque must not hide it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from gsfdi.fit import Knob
from gsfdi.model import TermUse
from gsfdi.modelfile import load_models
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.regauge import common_factor
from gsfdi.simulate import simulate_record

ARM = load_models(Path(__file__).parents[1] / "configs" / "era_joint.toml").for_joint("J1")
PLANT = ("output_inertia", "torque_constant", "motor_inertia", "stiffness")


def rubbing(dry: float, wet: float, **details: float) -> tuple[TermUse, ...]:
    """Dry and viscous friction of the motor."""
    return (
        TermUse("coulomb_friction", {"torque_nm": dry, **details}, "motor"),
        TermUse("viscous_friction", {"coefficient_nms_rad": wet}, "motor"),
    )


@pytest.mark.parametrize(
    ("dry", "wet", "details", "found"),
    [
        (3.28, 34.4, {}, {"coulomb_friction": 0.28, "viscous_friction": 4.4}),
        pytest.param(3.6, 36.0, {}, {"coulomb_friction": 0.6, "viscous_friction": 6.0}, marks=pytest.mark.thorough),
        (2.7, 27.0, {}, {"coulomb_friction": -0.3, "viscous_friction": -3.0}),
        pytest.param(2.4, 30.0, {"smooth_rad_s": 5e-4}, {"coulomb_friction": -0.6}, marks=pytest.mark.thorough),
        (3.06, 30.0, {}, {}),
    ],
)
def test_a_friction_that_changed_is_told_from_a_plant_that_did(
    dry: float, wet: float, details: dict[str, float], found: dict[str, float]
) -> None:
    nominal = replace(ARM, physics=rubbing(3.0, 30.0, **details))
    record = simulate_record(replace(ARM, physics=rubbing(dry, wet, **details)), seed=3, duration=45.0)
    answer = reconcile([record], nominal)
    sizes = {entry["term"]: next(iter(entry["parameters"].values()))["value"] for entry in answer.omitted_physics}
    assert sizes == {term: pytest.approx(size, rel=0.25) for term, size in found.items()}
    if answer.updated_model is not None:
        assert all(min(use.values.values()) >= 0.0 for use in answer.updated_model.physics)
        assert answer.fit["after"]["motor_current_a"] < 1.2 * answer.fit["noise_floor"]["motor_current_a"]


@pytest.mark.parametrize(
    ("ratios", "factor"),
    [
        ((0.943, 0.943, 0.9428, 0.9431), 0.943),
        ((0.943, 0.943, 0.96, 0.943), None),
        ((0.997, 0.997, 0.997, 0.997), None),
        ((0.943, 0.943), None),
    ],
)
def test_only_numbers_that_agree_have_a_factor(ratios: tuple[float, ...], factor: float | None) -> None:
    knobs = [Knob(-1, name, 0.03, 0.92, 1.08, 1.0, 0.03) for name in PLANT[: len(ratios)]]
    hand = SimpleNamespace(fitted=SimpleNamespace(knobs=knobs, values=ratios))
    assert common_factor(hand) == (None if factor is None else pytest.approx(factor, abs=1e-3))  # type: ignore[arg-type]


def test_one_number_that_bends_all_others_as_far_as_they_go_is_no_sign_of_another_law() -> None:
    soft = replace(ARM, plant=replace(ARM.plant, stiffness=0.8519 * ARM.plant.stiffness))
    answer = reconcile([simulate_record(soft, seed=2, duration=40.0)], ARM)
    assert answer.verdict == "explained"
    assert [entry["term"] for entry in answer.omitted_physics] == ["stiffness_change"]
