"""Frictions that the data hardly part: two at once that look like a third, and one of one direction only."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL
from rigid import JOINT, WET, swept

from gsfdi.model import TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.forms import plainer
from gsfdi.reconcile.hand import settle, started, with_term
from gsfdi.reconcile.knobs import plant_knobs, start_knobs, term_knobs
from gsfdi.reconcile.noise import effort_floor
from gsfdi.simulate import simulate_record


@pytest.mark.parametrize(
    ("drag_nm", "yields", "excess_nm", "fades"),
    [(0.75, 0.055, 0.5, 0.09), (1.0, 0.03, 0.5, 0.09), (1.0, 0.04, 1.0, 0.05)],
)
def test_a_stribeck_friction_and_a_drag_are_told_apart(
    drag_nm: float, yields: float, excess_nm: float, fades: float
) -> None:
    """What they add up to was a Coulomb friction that turns round slowly, alone or beside a narrow excess."""
    drag = TermUse("shear_thinning_friction", {"torque_nm": drag_nm, "velocity_rad_s": yields})
    excess = TermUse("stribeck_friction", {"excess_nm": excess_nm, "velocity_rad_s": fades})
    found = {entry["term"]: entry["parameters"] for entry in swept(drag, excess).omitted_physics}
    assert set(found) == {"shear_thinning_friction", "stribeck_friction"}
    for use in (drag, excess):
        for name, value in use.values.items():
            assert found[use.term][name]["value"] == pytest.approx(value, rel=0.02)


@pytest.mark.parametrize(
    ("drag_nm", "yields", "dry_nm", "cogging_nm"),
    [pytest.param(1.2, 0.08, 1.0, 0.6, marks=pytest.mark.thorough), (1.0, 0.15, 1.0, 0.0)],
)
def test_what_is_found_beside_the_wrong_friction_is_looked_at_anew_beside_the_right_one(
    drag_nm: float, yields: float, dry_nm: float, cogging_nm: float
) -> None:
    """A drag was a friction of the load at first, beside which the others were fitted; and drags yielded too soon."""
    drag = TermUse("shear_thinning_friction", {"torque_nm": drag_nm, "velocity_rad_s": yields})
    dry = TermUse("coulomb_friction", {"torque_nm": dry_nm}, onset=22.0)
    wave = TermUse("cogging", {"amplitude_nm": cogging_nm, "order": 14.0, "phase_rad": 1.0})
    told = (drag, dry, wave) if cogging_nm else (drag, dry)
    answer = swept(*told, own=(WET,))
    assert answer.verdict == "explained"
    found = {entry["term"]: entry for entry in answer.omitted_physics}
    assert set(found) == {use.term for use in told}
    assert found["coulomb_friction"]["onset_s"] == pytest.approx(22.0, abs=0.02)
    for use in told:
        for name, value in use.values.items():
            assert found[use.term]["parameters"][name]["value"] == pytest.approx(value, rel=0.02)


def test_a_friction_that_was_met_one_way_only_is_not_said_to_differ_between_the_directions() -> None:
    """A drag and a Coulomb friction had been half a Coulomb friction and an asymmetry."""
    dry = TermUse("coulomb_friction", {"torque_nm": 0.5})
    record = simulate_record(replace(JOINT, physics=(dry, WET)), seed=3, duration=30.0)
    assert np.mean(record["joint_velocity"] > 0.005) < 0.01
    answer = reconcile([record], JOINT)
    assert {entry["term"] for entry in answer.omitted_physics} == {dry.term, WET.term}
    assert {("coulomb_friction", "asymmetric_friction"), ("viscous_friction", "asymmetric_friction")} <= set(
        answer.indistinguishable
    )


def test_a_friction_that_differs_between_the_directions_is_named_where_both_were_met() -> None:
    asymmetry = TermUse("asymmetric_friction", {"difference_nm": 1.0, "difference_nms_rad": 3.0})
    (entry,) = swept(asymmetry).omitted_physics
    assert entry["term"] == "asymmetric_friction"


def test_a_friction_that_is_the_same_at_any_temperature_is_not_said_to_depend_on_it() -> None:
    """Where the shelf had no viscous friction, one was a drag that changes by nothing with the temperature."""
    record = replace(simulate_record(replace(JOINT, physics=(WET,)), seed=1, duration=20.0), valid={})
    warmer = {**record.channels, "temperature": np.linspace(0.0, 20.0, len(record.t))}
    answer = reconcile([replace(record, channels=warmer)], JOINT, without=("viscous_friction",))
    assert answer.verdict in {"unexplained", "partly_explained"}
    assert "temperature_dependent_friction" not in {entry["term"] for entry in answer.omitted_physics}


@pytest.mark.parametrize("turns", [0.0, 1e-3])
def test_a_friction_turns_round_at_once_again_where_what_it_was_fitted_beside_is_there_now(turns: float) -> None:
    own = {"torque_nm": 1.0, "smooth_rad_s": turns}
    true = replace(MODEL, physics=(TermUse("coulomb_friction", own, "output"),))
    stand = bench([simulate_record(true, seed=4, duration=40.0)], MODEL)
    floor = effort_floor(stand)
    smooth = TermUse("coulomb_friction", {**own, "smooth_rad_s": max(turns, 5e-5)}, "output")
    model = with_term(started(MODEL, 1), smooth)
    knobs = [*plant_knobs(MODEL, "motor_current"), *start_knobs(stand), *term_knobs(stand, model, 0)]
    hand = settle(stand, model, knobs, floor)
    plain = plainer(hand, floor)
    (found,) = plain.fitted.model.physics
    assert ("smooth_rad_s" in found.values) is (turns > 0)
    assert (plain is hand) is (turns > 0)
    assert found.values["torque_nm"] / plain.fitted.model.plant.torque_constant == pytest.approx(1.0 / 0.6, rel=0.01)
