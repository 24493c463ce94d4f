"""What else a term might be starts where the term is."""

import numpy as np
import pytest

from gsfdi.model import TermUse
from gsfdi.reconcile.rivals import turning_like
from gsfdi.types import JointRecord

BRISTLE = TermUse("presliding_friction", {"stiffness_nm_rad": 8e4, "torque_nm": 13.0}, onset=7.0)
DRY = TermUse("coulomb_friction", {"torque_nm": 15.8})
DRAG = TermUse("shear_thinning_friction", {"velocity_rad_s": 0.3, "torque_nm": 4.0})


def test_a_dry_friction_begins_with_the_torque_of_the_bristle_it_stands_for() -> None:
    assert turning_like(BRISTLE, DRY, ()).values == {"torque_nm": 13.0}
    assert turning_like(DRY, BRISTLE, ()).values == {"stiffness_nm_rad": 8e4, "torque_nm": 15.8}


def test_a_dry_friction_in_the_place_of_drag_turns_round_as_that_did() -> None:
    assert turning_like(DRAG, DRY, ()).values == {"torque_nm": 4.0, "smooth_rad_s": 0.3}


def test_what_is_no_like_keeps_its_own_numbers() -> None:
    assert turning_like(DRAG, BRISTLE, ()) == BRISTLE


def test_a_constant_load_begins_with_the_mean_torque_of_the_weight_it_stands_for() -> None:
    weight = TermUse("gravity_unbalance", {"torque_nm": 5.0, "angle_rad": 1.1})
    angles = np.linspace(-0.6, -0.3, 200)
    record = JointRecord("r", "j", 0, np.arange(200) / 100, {"position": angles})
    load = turning_like(weight, TermUse("constant_load", {"torque_nm": -3.9}), [record])
    assert load.values["torque_nm"] == pytest.approx(5.0 * np.mean(np.sin(angles - 1.1)))
