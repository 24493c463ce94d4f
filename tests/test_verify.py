"""Held-out figures are those of the recordings as they came, on a part that nothing was fitted to."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from joints import without_speed
from rigid import JOINT

from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import HOLD_OUT, bench
from gsfdi.reconcile.verdict import follows
from gsfdi.simulate import simulate_record


def test_a_late_stamp_is_judged_on_the_stamps_as_they_came() -> None:
    record = simulate_record(JOINT, seed=1, duration=30.0)
    measured = [name for name in record.channels if name == "position" or name.endswith("_velocity")]
    aged = {name: np.interp(record.t - 0.02, record.t, record[name]) for name in measured}
    answer = reconcile([replace(record, channels={**record.channels, **aged}, valid={})], JOINT)
    assert [entry["term"] for entry in answer.omitted_physics] == ["timestamp_latency"]
    assert answer.fit["after"]["position_rad"] < 0.5 * answer.fit["before"]["position_rad"]


def test_the_figures_are_of_the_part_that_was_kept_although_it_is_not_the_usual_one() -> None:
    """All of the mismatch lies where the usual part would be kept, so that another is."""
    record = simulate_record(JOINT, seed=1, duration=30.0)
    low, high = (share * record.t[-1] for share in HOLD_OUT)
    push = np.where((record.t >= low) & (record.t < high), 0.3 * np.sin(3.0 * record.t), 0.0)
    shaken = replace(record, channels={**record.channels, "drive_torque": record["drive_torque"] + push}, valid={})
    answer = reconcile([shaken], replace(JOINT, controller=None))
    kept = answer.fit["held_out_seconds"]
    assert kept[0] != pytest.approx(low, abs=0.5)


def test_the_noise_floor_is_what_a_sound_joint_leaves_that_its_own_noise_moves() -> None:
    answer = reconcile([simulate_record(JOINT, seed=1, duration=30.0)], JOINT)
    after, floor = answer.fit["after"], answer.fit["noise_floor"]
    assert after == pytest.approx(floor, rel=0.2)
    assert floor["position_rad"] > 2.0 * JOINT.sensors.position_noise


@pytest.mark.parametrize("sees_speed", [True, False])
def test_a_sound_joint_without_a_controller_leaves_no_more_than_the_noise_of_its_effort(sees_speed: bool) -> None:
    record = simulate_record(JOINT, seed=3, duration=120.0)
    seen = record if sees_speed else without_speed(record)
    blind = replace(JOINT, controller=None)
    heavy = replace(blind, plant=replace(JOINT.plant, output_inertia=1.5 * JOINT.plant.output_inertia))
    answer = reconcile([seen], heavy)
    assert answer.fit["after"] == pytest.approx(answer.fit["noise_floor"], rel=0.3)
    assert answer.fit["before"]["position_rad"] > 2.0 * answer.fit["after"]["position_rad"]
    assert answer.fit["noise_floor"]["position_rad"] > JOINT.sensors.position_noise


def test_a_model_follows_what_it_is_of_and_nothing_else() -> None:
    stand = bench([simulate_record(JOINT, seed=4, duration=30.0)], JOINT)
    heavy = replace(JOINT, plant=replace(JOINT.plant, output_inertia=6.0 * JOINT.plant.output_inertia))
    assert follows(SimpleNamespace(logged=stand, updated=JOINT))  # type: ignore[arg-type]
    assert not follows(SimpleNamespace(logged=stand, updated=heavy))  # type: ignore[arg-type]
