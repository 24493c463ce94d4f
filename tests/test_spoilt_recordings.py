"""Recordings whose effort or position is spoilt: what is lost is a gap, and what runs backwards is said to."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL, without_speed

from gsfdi.reconcile import reconcile
from gsfdi.reconcile.gaps import without_lost
from gsfdi.simulate import simulate_record
from gsfdi.types import Array, JointRecord


def spoilt(record: JointRecord, channel: str, change: Callable[[Array], Array]) -> JointRecord:
    return replace(record, channels={**record.channels, channel: change(record[channel].copy())})


def lost(values: Array) -> Array:
    values[1000:2000] = np.nan
    return values


@pytest.mark.parametrize("channel", ["motor_current", "position"])
def test_a_channel_that_is_lost_for_long_is_a_gap(channel: str) -> None:
    record = spoilt(without_speed(simulate_record(MODEL, seed=1, duration=60.0)), channel, lost)
    assert reconcile([record], MODEL).verdict == "no_mismatch"


def test_a_few_lost_samples_are_none() -> None:
    record = spoilt(
        simulate_record(MODEL, duration=20.0), "position", lambda v: np.where(np.arange(len(v)) == 7, np.nan, v)
    )
    assert len(without_lost(record).t) == len(record.t)


@pytest.mark.parametrize("law", [True, False])
@pytest.mark.parametrize("speed", [True, False])
def test_an_effort_that_runs_backwards_is_said_to(law: bool, speed: bool) -> None:
    record = spoilt(simulate_record(MODEL, seed=1, duration=60.0), "motor_current", lambda v: -v)
    model = MODEL if law else replace(MODEL, controller=None)
    answer = reconcile([record if speed else without_speed(record)], model)
    (entry,) = answer.omitted_physics
    assert entry["term"] == "current_gain"
    assert entry["parameters"]["ratio"]["value"] == pytest.approx(-1.0, abs=0.01)
    assert answer.updated_model is not None
    column = "motor_current_a" if law else "position_rad"
    assert answer.fit["after"][column] < 0.2 * answer.fit["before"][column]
