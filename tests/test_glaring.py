"""Effects as large as the drive's torque, which slopes do not reach."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsfdi.model import JointModel, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.hand import with_term
from gsfdi.reconcile.screen import likeliest
from tests.joints import MODEL, record


@pytest.mark.parametrize(
    ("term", "size", "value", "seconds"),
    [
        ("viscous_friction", "coefficient_nms_rad", 3000.0, 40.0),
        pytest.param("shear_thinning_friction", "torque_nm", 60.0, 60.0, marks=pytest.mark.thorough),
    ],
)
def test_a_friction_of_the_drives_torque_is_named(term: str, size: str, value: float, seconds: float) -> None:
    found = reconcile([record(f"{term}={value}", seed=2, duration=seconds)], MODEL)
    assert found.verdict == "explained"
    (name,) = found.omitted_physics
    assert name["term"] == term
    assert name["parameters"][size]["value"] == pytest.approx(value, rel=0.01)


@pytest.mark.thorough
def test_nothing_is_named_beside_a_large_friction_for_its_coming_late() -> None:
    found = reconcile([record("coulomb_friction=60@15", seed=5, duration=45.0)], MODEL)
    (name,) = found.omitted_physics
    assert (found.verdict, name["term"]) == ("explained", "coulomb_friction")
    assert name["onset_s"] == pytest.approx(15.0, abs=0.005)


def test_the_term_that_is_asked_for_is_moved_not_the_last() -> None:
    def misfit(models: Sequence[JointModel]) -> Any:
        return np.array([[abs((model.physics[0].onset or 0.0) - 7.0)] for model in models])

    hand: Any = SimpleNamespace(misfit=misfit)
    model = with_term(
        with_term(MODEL, TermUse("cogging", {}, None, 3.0)), TermUse("coulomb_friction", {}, "motor", 9.0)
    )
    cost, best = likeliest(hand, model, 0, "onset", [5.0, 7.0, 9.0])
    assert cost == 0.0
    assert [use.onset for use in best.physics] == [7.0, 9.0]


def test_a_joint_may_begin_anywhere_in_a_gap_much_wider_than_its_gearbox_winds_up() -> None:
    found = reconcile([record("backlash=0.002", seed=117, duration=45.0)], MODEL)
    (name,) = found.omitted_physics
    assert (found.verdict, name["term"]) == ("explained", "backlash")
    assert name["parameters"]["half_width_rad"]["value"] == pytest.approx(0.002, rel=0.01)
