"""What is far off from what is believed of it, and small things beside it that are there, or that are not."""

from dataclasses import replace

import numpy as np
import pytest
from joints import along
from rigid import JOINT

from gsfdi.model import JointModel, Sensors, TermUse
from gsfdi.reconcile import Reconciliation, lagging, reconcile
from gsfdi.reconcile.law import check_law
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.simulate import simulate_record

assert JOINT.controller is not None
CONTROLLER = JOINT.controller
FINE = Sensors(position_noise=2e-6, motor_velocity_noise=3e-4, effort_noise=1e-4)
QUIET = Sensors(position_noise=2e-5, motor_velocity_noise=3e-4, effort_noise=6e-3)


def off(ratio: float, joint: JointModel) -> JointModel:
    """Give the joint with an inertia that is `ratio` of what it was."""
    return replace(joint, plant=replace(joint.plant, output_inertia=ratio * joint.plant.output_inertia))


def reconciled(joint: JointModel, nominal: JointModel) -> Reconciliation:
    """Reconcile `joint`, which is asked for a wave that it is nowhere near at first, with `nominal`."""
    base = simulate_record(replace(joint, sensors=Sensors(), physics=()), duration=18.0)
    asked = along(base, ((0.2, 0.2, 0.6), (0.07, 0.6, 2.0)))
    return reconcile([simulate_record(joint, replay=asked, seed=1)], nominal)


@pytest.mark.parametrize("ratio", [1.088, 0.915])
def test_an_inertia_that_is_off_by_more_than_is_believed_explains_it_all_by_itself(ratio: float) -> None:
    """A process noise that suits what is left of it had hidden its worth."""
    heavy = replace(JOINT, plant=replace(JOINT.plant, output_inertia=98.0), sensors=QUIET)
    heavy = replace(heavy, controller=replace(CONTROLLER, proportional=3500.0, integral=2700.0, derivative=820.0))
    answer = reconciled(heavy, replace(off(1.0 / ratio, heavy), controller=None))
    assert answer.verdict == "explained"
    assert [entry["term"] for entry in answer.omitted_physics] == ["output_inertia_change"]


@pytest.mark.parametrize("ratio", [1.05, 1.2])
def test_the_last_digits_of_a_simulation_without_noise_leave_nothing_to_explain(ratio: float) -> None:
    silent = replace(JOINT, sensors=Sensors())
    assert reconciled(silent, off(1.0 / ratio, silent)).verdict == "explained"


def test_a_speed_that_lags_is_named_beside_an_inertia_that_gains_a_thousand_times_as_much() -> None:
    lagging = replace(JOINT, physics=(TermUse("velocity_lag", {"lag_s": 0.006}),), sensors=FINE)
    answer = reconciled(lagging, off(1.25, replace(lagging, physics=())))
    assert answer.verdict == "explained"
    assert {entry["term"] for entry in answer.omitted_physics} == {"output_inertia_change", "velocity_lag"}


@pytest.mark.parametrize(("bias", "found"), [(0.0, []), (1.0, ["current_bias"])])
def test_an_integral_that_lost_rows_have_led_astray_is_no_bias_that_sets_in(bias: float, found: list[str]) -> None:
    eager = replace(JOINT, controller=replace(CONTROLLER, proportional=900.0, integral=2700.0, derivative=60.0))
    eager = replace(eager, sensors=Sensors(position_noise=6e-4, motor_velocity_noise=3e-3, effort_noise=1e-4))
    acts = (TermUse("current_bias", {"bias_a": bias}, None, 6.0),) if bias else ()
    record = simulate_record(replace(eager, physics=acts), seed=3, duration=14.0)
    keep = np.random.default_rng(1).random(len(record.t)) > 0.05
    channels = {name: record[name][keep] for name in record.channels}
    law = check_law([replace(record, t=record.t[keep], channels=channels, valid={})], eager)
    assert law is not None
    assert [finding.term for finding in law.findings] == found


@pytest.mark.parametrize(
    ("shown", "gain", "left"),
    [
        ((5.0e-3, 3e-4), 300.0, ["velocity_lag"]),  # they show one, and the law is sure of another
        ((5.0e-3, 3e-4), 90.0, ["current_gain"]),
        ((1.0e-3, 3e-4), 300.0, ["velocity_lag"]),  # they hint at one
        ((1.0e-3, 3e-4), 120.0, ["current_gain"]),
        ((0.2e-3, 3e-4), 300.0, ["current_gain"]),  # they show none
        ((7.9e-3, 3e-4), 90.0, ["velocity_lag"]),
        ((0.0, np.inf), 300.0, ["velocity_lag"]),
        ((0.0, np.inf), 90.0, ["current_gain"]),
    ],
)
def test_a_lag_is_the_laws_where_positions_show_one(
    shown: tuple[float, float], gain: float, left: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lagging, "kinematic_lag", lambda records, model: shown)
    lag = LawFinding("velocity_lag", {"lag_s": 7.8e-3}, None, gain, 0.9, 2e-4)
    other = LawFinding("current_gain", {"ratio": 0.95}, None, 100.0, 0.7, 1e-3)
    assert [finding.term for finding in lagging.with_positions([other, lag], [], JOINT)] == left
