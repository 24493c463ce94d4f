"""A motor that a loop turns slowly, of which only its angle and its effort are logged."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.modelfile import dump, load_models
from gsfdi.reconcile import Reconciliation, reconcile
from gsfdi.reconcile.crawl import ways
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord

MOTOR = JointModel("M", "rigid", Plant(2.5e-4, gear_ratio=1.0, torque_constant=1.0), effort="drive_torque")
LOOP = Controller(proportional=0.3, integral=2.0, derivative=0.015, sample_rate=200.0, effort="drive_torque")
COARSE = Sensors(position_resolution=2 * np.pi / 8192, motor_velocity_noise=0.01, effort_noise=1e-5)
DRY = TermUse("coulomb_friction", {"torque_nm": 0.003})
SIZES = {7.0: 0.008, 28.0: 0.004, 12.0: 0.002}
WAVES = tuple(
    TermUse("cogging", {"amplitude_nm": size, "order": order, "phase_rad": -0.1 * order})
    for order, size in SIZES.items()
)


@cache
def crawling(physics: tuple[str, ...], speeds: tuple[float, ...], seed: int = 0) -> JointRecord:
    """Angle and effort of a motor with such physics that a loop turns at one speed after another, 15 s each."""
    terms = {"dry": (DRY,), "waves": WAVES}
    model = replace(MOTOR, controller=LOOP, sensors=COARSE, physics=sum((terms[name] for name in physics), ()))
    rates = np.repeat(speeds, 3000)
    asked = replace(
        simulate_record(model, duration=1.0),
        t=0.005 * np.arange(len(rates)),
        channels={"setpoint": 0.005 * np.cumsum(rates), "setpoint_rate": rates},
        valid={},
    )
    shown = simulate_record(model, replay=asked, seed=seed)
    return replace(shown, channels={name: shown[name] for name in ("position", "drive_torque")}, valid={})


def told(
    *speeds: float,
    physics: tuple[str, ...] = ("dry", "waves"),
    nominal: JointModel = MOTOR,
    without: tuple[str, ...] = (),
) -> Reconciliation:
    return reconcile([crawling(physics, speeds)], nominal, without=without)


def named(answer: Reconciliation) -> list[tuple[str, float | None]]:
    orders = (entry["parameters"].get("order", {"value": None})["value"] for entry in answer.omitted_physics)
    return sorted(((e["term"], o) for e, o in zip(answer.omitted_physics, orders, strict=True)), key=str)


@pytest.mark.parametrize("speeds", [(0.5, -0.5), (0.5,), (0.3, -0.3, 0.8, -0.8)])
def test_every_wave_and_the_friction_beside_them_are_found(speeds: tuple[float, ...]) -> None:
    answer = told(*speeds)
    assert named(answer) == sorted([("coulomb_friction", None), *(("cogging", o) for o in SIZES)], key=str)
    for entry in answer.omitted_physics:
        size, *_ = entry["parameters"].values()
        order = entry["parameters"].get("order")
        assert size["value"] == pytest.approx(0.003 if order is None else SIZES[order["value"]], rel=0.02)
        assert size["ci95"][0] < size["value"] < size["ci95"][1]


@pytest.mark.thorough
def test_what_a_motion_in_one_direction_cannot_part_is_told_together() -> None:
    (group,) = [group for group in told(0.5).indistinguishable if "coulomb_friction" in group]
    assert set(group) == {"coulomb_friction", "viscous_friction", "constant_load"}
    assert ("coulomb_friction", "viscous_friction") in told(0.5, -0.5).indistinguishable
    assert told(0.3, -0.3, 0.8, -0.8).indistinguishable == ()


def test_held_out_effort_and_the_updated_model_bear_it_out(tmp_path: Path) -> None:
    answer = told(0.5, -0.5)
    before, after = (answer.fit[key]["drive_torque_nm"] for key in ("before", "after"))
    assert answer.verdict == "explained"
    assert after < 0.1 * before
    assert answer.mismatch["remains"] == pytest.approx(after / before)
    assert answer.updated_model is not None
    dump(answer.updated_model, tmp_path / "joint.toml")
    again = told(0.5, -0.5, nominal=load_models(tmp_path / "joint.toml").for_joint("M"))
    assert again.mismatch["before_nm"] < 0.1 * answer.mismatch["before_nm"]


def test_a_model_that_holds_all_of_it_lacks_nothing() -> None:
    answer = told(0.5, nominal=replace(MOTOR, physics=(DRY, *WAVES)))
    assert answer.verdict == "no_mismatch"
    assert answer.omitted_physics == ()
    assert {"cogging", "coulomb_friction"} <= {item["term"] for item in answer.mismatch["smallest_seen"]}


def test_a_wave_that_the_model_holds_is_not_found_again() -> None:
    answer = told(0.5, nominal=replace(MOTOR, physics=WAVES[:1]))
    assert ("cogging", 28.0) in named(answer)
    assert ("cogging", 7.0) not in named(answer)


@pytest.mark.parametrize("physics", [("dry",), ()])
def test_no_wave_is_found_where_there_is_none(physics: tuple[str, ...]) -> None:
    assert "cogging" not in {entry["term"] for entry in told(0.5, -0.5, physics=physics).omitted_physics}


def test_what_is_withheld_is_not_named() -> None:
    answer = told(0.5, without=("cogging", "torque_ripple"))
    assert not {"cogging", "torque_ripple"} & {entry["term"] for entry in answer.omitted_physics}


def test_a_little_fall_back_is_no_turning() -> None:
    angle = np.array([0.0, 1.0, 2.0, 1.9, 3.0, 2.9, 1.0, 0.0, 0.1, -1.0])
    assert list(ways(angle, 0.5)) == [1.0] * 4 + [-1.0] * 6
