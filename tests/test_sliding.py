"""Dry friction that turns round over a range of speed: what is left out of a model, and what a model does not say."""

from dataclasses import replace

import pytest
from joints import MODEL, without_speed
from rigid import JOINT as RIGID

from gsfdi.model import TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.finalists import only_turns
from gsfdi.simulate import fault_of, simulate_record

HOLDS = TermUse("coulomb_friction", {"torque_nm": 2.0}, "motor")
TURNS = replace(HOLDS, values={"torque_nm": 2.0, "smooth_rad_s": 5e-4})
JOINT, REAL = replace(MODEL, physics=(HOLDS,)), replace(MODEL, physics=(TURNS,))


def test_coulomb_friction_is_named_though_it_turns_round_slowly() -> None:
    (entry,) = reconcile([simulate_record(REAL, duration=25.0)], MODEL).omitted_physics
    assert entry["term"] == "coulomb_friction"
    assert entry["parameters"]["torque_nm"]["value"] == pytest.approx(2.0, rel=0.02)
    assert entry["parameters"]["smooth_rad_s"]["value"] == pytest.approx(5e-4, rel=0.05)


def test_how_the_friction_of_a_model_turns_round_is_no_physics() -> None:
    answer = reconcile([simulate_record(REAL, duration=25.0)], JOINT)
    assert not [e for e in answer.omitted_physics if not e["term"].endswith("_change")]
    assert "coulomb friction with smooth_rad_s = " in answer.says
    assert answer.updated_model is not None
    (use,) = answer.updated_model.physics
    assert use.values["smooth_rad_s"] == pytest.approx(5e-4, rel=0.02)


@pytest.mark.parametrize("effort_noise", [0.03, 0.1])
def test_neither_noise_nor_an_unlogged_speed_makes_physics_of_how_friction_turns_round(effort_noise: float) -> None:
    """There were a bristle with a constant load, and a controller's gain, in the place of a turn that noise all hid."""
    sound = replace(
        RIGID,
        physics=(replace(HOLDS, side=None),),
        sensors=replace(RIGID.sensors, effort_noise=effort_noise),
    )
    turns = TermUse("coulomb_friction", {"torque_nm": 2.0, "smooth_rad_s": 1e-3})
    record = simulate_record(replace(sound, physics=(turns,)), seed=1, duration=25.0)
    assert reconcile([without_speed(record)], sound).omitted_physics == ()


@pytest.mark.parametrize(("seed", "smooth_rad_s"), [(611, 0.0), (611, 5e-4), (626, 0.0)])
def test_what_noise_makes_of_a_joint_that_creeps_is_no_name(seed: int, smooth_rad_s: float) -> None:
    """An end stop, an inertia of 0.82 and an integral gain of 0.995 had been found where the joint nearly sticks."""
    holds = replace(HOLDS, side=None)
    sound = replace(RIGID, physics=(holds,), sensors=replace(RIGID.sensors, effort_noise=0.1))
    turns = {"smooth_rad_s": smooth_rad_s} if smooth_rad_s else {}
    real = replace(sound, physics=(replace(holds, values={**holds.values, **turns}),))
    record = simulate_record(real, seed=seed, duration=25.0 + seed % 4 * 12.0)
    assert reconcile([without_speed(record)], sound).omitted_physics == ()


@pytest.mark.parametrize(
    ("excess_nm", "velocity_rad_s", "mends"), [(0.15, 1.5e-3, True), (0.6, 1.5e-3, False), (0.15, 8e-3, False)]
)
def test_a_little_more_friction_where_it_turns_is_how_it_turns(
    excess_nm: float, velocity_rad_s: float, mends: bool
) -> None:
    more = TermUse("stribeck_friction", {"excess_nm": excess_nm, "velocity_rad_s": velocity_rad_s}, "motor")
    assert only_turns(replace(REAL, physics=(TURNS, more))) is mends
    assert not only_turns(replace(JOINT, physics=(HOLDS, more)))
    assert only_turns(replace(JOINT, physics=(HOLDS, more)), at_once=2e-3) is mends


@pytest.mark.thorough
def test_an_effect_is_named_beside_friction_that_turns_round_slowly() -> None:
    (entry,) = reconcile(
        [simulate_record(REAL, faults=(fault_of("backlash=2e-5"),), duration=25.0)], JOINT
    ).omitted_physics
    assert entry["term"] == "backlash"
    assert entry["parameters"]["half_width_rad"]["value"] == pytest.approx(2e-5, rel=0.05)
