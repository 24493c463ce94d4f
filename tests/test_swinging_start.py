"""Recordings that begin while the motor sticks and the joint swings on its gearbox."""

from dataclasses import replace

import pytest
from joints import MODEL

from gsfdi.model import TermUse
from gsfdi.reconcile import reconcile
from gsfdi.simulate import replay, simulate_record
from gsfdi.simulate.recording import channels_of, noisy, training_drive
from gsfdi.starting import initial_state
from gsfdi.types import JointRecord

STICKS = replace(MODEL, physics=(TermUse("coulomb_friction", {"torque_nm": 12.0}, "motor"),))


def begun_swinging(rate: float, seed: int) -> JointRecord:
    """Telemetry of a joint that begins with a wind-up that grows by `rate` [rad/s]."""
    drive = training_drive(STICKS, 60.0, seed)
    start = initial_state(STICKS, drive.start)
    start[3] += rate
    shown = replay(STICKS, replace(drive, clock=noisy(drive.clock, STICKS.sensors, seed)), x0=start)
    return replace(simulate_record(STICKS, seed=seed, duration=60.0), channels=channels_of(STICKS, drive, shown, seed))


@pytest.mark.parametrize("rate", [3e-4, 1e-3])
def test_a_sound_joint_that_begins_swinging_is_sound(rate: float) -> None:
    answer = reconcile([begun_swinging(rate, seed=2)], STICKS)
    assert answer.omitted_physics == ()
    assert answer.verdict == "no_mismatch"
