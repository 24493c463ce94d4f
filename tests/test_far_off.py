"""Numbers of the plant that are farther off than they are believed to be, and what else is named beside them."""

from dataclasses import replace

import pytest
from joints import along
from rigid import JOINT

from gsfdi.model import JointModel, Sensors, TermUse
from gsfdi.reconcile import Reconciliation, reconcile
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
