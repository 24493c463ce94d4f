"""An effort rid of its own noise where neither law nor setpoint is known."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL, swinging

from gsfdi.model import Sensors
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.contract import settle_contract
from gsfdi.reconcile.hush import hushed
from gsfdi.reconcile.sensing import effort_noise
from gsfdi.types import Array, JointRecord

UNKNOWN = replace(MODEL, controller=None)
SEEN = ("position", "motor_velocity", "motor_current")


def bare(seed: int, noise: float = MODEL.sensors.effort_noise) -> JointRecord:
    """Record a swinging joint as if nobody had logged its setpoint; all but the effort's noise is the same by seed."""
    noisy = replace(MODEL, sensors=replace(MODEL.sensors, effort_noise=noise))
    record = swinging(0.1, 0.5, noisy, seed)
    return replace(record, channels={name: record[name] for name in SEEN}, valid={})


def off(record: JointRecord, true: JointRecord) -> Array:
    return np.asarray(record["motor_current"] - true["motor_current"])


def test_most_of_the_noise_is_told_and_the_model_states_what_is_left() -> None:
    recorded, true = bare(1), bare(1, noise=0.0)
    found = hushed([recorded], UNKNOWN)
    assert found is not None
    left = float(np.std(off(found.records[0], true)))
    assert left < 0.5 * np.std(off(recorded, true))
    assert effort_noise(found.model) == pytest.approx(left, rel=0.2)


def test_nothing_is_told_of_an_effort_whose_noise_is_unknown_or_that_answers_something_else() -> None:
    recorded, rng = bare(1), np.random.default_rng(1)
    steps = replace(
        recorded,
        channels={
            **recorded.channels,
            "motor_current": recorded["motor_current"] + 1e-3 * rng.integers(0, 2, len(recorded.t)),
        },
    )
    assert hushed([steps], replace(UNKNOWN, sensors=Sensors())) is None
    shaken = recorded["motor_current"] + 1e-3 * rng.standard_normal(len(recorded.t))
    other = replace(recorded, channels={**recorded.channels, "motor_current": shaken})
    assert hushed([other], UNKNOWN) is None


def test_of_an_effort_that_shakes_for_another_reason_as_well_the_likeliest_part_is_taken_off() -> None:
    recorded, true, rng = bare(1), bare(1, noise=0.0), np.random.default_rng(1)
    shaken = MODEL.sensors.effort_noise * rng.standard_normal(len(recorded.t))  # a setpoint that jitters moves it so
    both = [replace(r, channels={**r.channels, "motor_current": r["motor_current"] + shaken}) for r in (recorded, true)]
    found = hushed(both[:1], UNKNOWN)
    assert found is not None
    left = float(np.std(off(found.records[0], both[1])))
    assert left < 0.8 * np.std(off(*both))
    assert effort_noise(found.model) == pytest.approx(left, rel=0.1)


def test_a_torque_must_be_more_than_the_noise_that_goes_round_a_loop_that_nobody_knows() -> None:
    unled = settle_contract([bare(1)], UNKNOWN, ()).stand
    assert 2.0 * UNKNOWN.sensors.effort_noise < unled.looped * unled.scales.effort < 0.01
    assert settle_contract([swinging(0.1, 0.5, MODEL, 1)], MODEL, ()).stand.looped == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_a_sound_joint_whose_law_and_setpoint_nobody_knows_is_sound(seed: int) -> None:
    record = bare(seed)
    assert effort_noise(settle_contract([record], UNKNOWN, ()).model) < 0.5 * effort_noise(UNKNOWN)
    assert reconcile([record], UNKNOWN).verdict == "no_mismatch"
