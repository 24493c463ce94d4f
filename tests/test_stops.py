"""A stop that the joint meets but once: its place and its stiffness are found apart."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL

from gsfdi.model import TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.hand import with_term
from gsfdi.reconcile.stops import pressed
from gsfdi.simulate import simulate_record

RECORD = simulate_record(MODEL, seed=4, duration=60.0)
EDGE, REACH = float(RECORD["position"].max()), float(np.ptp(RECORD["position"])) / 2
STOP = {"angle_rad": EDGE - 0.02 * REACH, "stiffness_nm_rad": 400.0}


def test_a_stop_far_off_is_moved_to_where_it_fits() -> None:
    record = simulate_record(replace(MODEL, physics=(TermUse("end_stop", STOP),)), replay=RECORD, seed=4)
    hand = opening(bench([record], MODEL), MODEL, 0.0)
    deep = {"angle_rad": EDGE - 0.1 * REACH, "stiffness_nm_rad": 80.0}
    found = pressed(hand, with_term(hand.fitted.model, TermUse("end_stop", deep))).physics[-1].values
    assert found["angle_rad"] == pytest.approx(STOP["angle_rad"], abs=0.004 * REACH)
    load = with_term(hand.fitted.model, TermUse("constant_load", {"torque_nm": 1.0}))
    assert pressed(hand, load) is load


def test_a_stop_met_once_is_no_cable_that_sets_in() -> None:
    record = simulate_record(replace(MODEL, physics=(TermUse("end_stop", STOP),)), replay=RECORD, seed=4)
    answer = reconcile([record], MODEL)
    (named,) = answer.omitted_physics
    assert named["term"] == "end_stop"
    assert named["parameters"]["stiffness_nm_rad"]["value"] == pytest.approx(400.0, rel=0.1)
