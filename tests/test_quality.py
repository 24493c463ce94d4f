import numpy as np
import pytest

from gsfdi import clock, quality
from gsfdi.types import Array

T: Array = np.arange(2000) * 0.01
RNG = np.random.default_rng(0)
POSITION: Array = np.sin(T) + 1e-5 * RNG.standard_normal(T.size)
SPEED: Array = np.cos(T) + 1e-3 * RNG.standard_normal(T.size)


def channels(**changed: Array) -> dict[str, Array]:
    return {"position": POSITION, "joint_velocity": SPEED, "drive_torque": 5 * np.sign(SPEED) + 0.1 * SPEED, **changed}


def test_clean_data_is_believed_whole() -> None:
    valid, counts = quality.judge(T, channels(), "rotary")
    assert all(mask.all() for mask in valid.values())
    assert counts["time"]["gaps"] == 0


@pytest.mark.parametrize(
    ("value", "kind"), [(np.nan, "missing"), (np.inf, "absurd"), (1e165, "absurd"), (9.0, "spike")]
)
def test_a_bad_value_is_masked_and_counted(value: float, kind: str) -> None:
    position = POSITION.copy()
    position[[300, 700, 1100]] = value
    valid, counts = quality.judge(T, channels(position=position), "rotary")
    assert counts["position"][kind] == 3
    assert np.flatnonzero(~valid["position"]).tolist() == [300, 700, 1100]


def test_what_lasts_is_no_spike() -> None:
    position = POSITION.copy()
    position[500:520] += 0.3
    assert not quality.spikes(position).any()


@pytest.mark.parametrize("bit", range(40, 63))
def test_a_flipped_high_bit_is_a_spike_or_absurd(bit: int) -> None:
    position = POSITION.copy()
    position.view(np.uint64)[444] ^= np.uint64(1 << bit)
    far = abs(position[444] - POSITION[444]) > 0.02
    valid, _ = quality.judge(T, channels(position=position), "rotary")
    assert valid["position"][444] != far or not far


def test_a_position_frozen_while_the_joint_moves_is_stuck() -> None:
    position = POSITION.copy()
    position[600:800] = position[599]
    valid, counts = quality.judge(T, channels(position=position), "rotary")
    assert counts["position"]["stuck"] == 200
    assert not valid["position"][600:800].any()


def test_a_jammed_joint_is_not_taken_for_a_stuck_sensor() -> None:
    position, speed = POSITION.copy(), SPEED.copy()
    position[600:800], speed[600:800] = position[599], 1e-4 * RNG.standard_normal(200)
    _, counts = quality.judge(T, channels(position=position, joint_velocity=speed), "rotary")
    assert counts["position"]["stuck"] == 0


def test_a_channel_that_never_changes_is_dead_only_if_the_joint_moves() -> None:
    still = np.zeros(T.size)
    _, counts = quality.judge(T, channels(drive_torque=still), "rotary")
    assert counts["drive_torque"]["dead"] == T.size
    _, counts = quality.judge(T, {"position": still, "drive_torque": still, "setpoint": still}, "rotary")
    assert counts["drive_torque"]["dead"] == 0


def test_saturation_is_counted_and_kept() -> None:
    torque = np.clip(7 * np.sin(T), -5, 5)
    valid, counts = quality.judge(T, channels(drive_torque=torque), "rotary")
    assert counts["drive_torque"]["saturated"] == np.sum(np.abs(torque) == 5)
    assert valid["drive_torque"].all()


def test_gaps_are_counted() -> None:
    t = np.delete(T, slice(400, 460))
    summary = clock.time_summary(t)
    assert summary["gaps"] == 1
    assert summary["longest_gap_s"] == pytest.approx(0.61)


def stamps(n: int = 1000) -> np.ndarray:
    return 10**18 + np.arange(n) * 10_000_000


def test_stamps_that_rise_are_all_believed() -> None:
    timed = clock.believable_times(stamps())
    assert len(timed.rows) == 1000
    assert not timed.counts


def test_one_absurd_stamp_costs_one_row() -> None:
    for wild in (0, 2**62, -5, 10**18 + 86_400 * 10**9):
        time_ns = stamps()
        time_ns[400] = wild
        timed = clock.believable_times(time_ns)
        assert len(timed.rows) == 999
        assert 400 not in timed.rows


def test_duplicate_and_late_stamps_are_left_out_and_told_apart() -> None:
    time_ns = stamps()
    time_ns[100] = time_ns[99]
    time_ns[200:203] = time_ns[150:153] + 1
    timed = clock.believable_times(time_ns)
    assert timed.counts == {"duplicate": 1.0, "out_of_order": 3.0}
    assert (np.diff(time_ns[timed.rows]) > 0).all()


def test_a_clock_set_back_loses_the_shorter_part() -> None:
    time_ns = stamps()
    time_ns[700:] -= 5_000_000_000
    timed = clock.believable_times(time_ns)
    assert timed.counts["out_of_order"] == 500 - 0 or len(timed.rows) == 700
    assert (np.diff(time_ns[timed.rows]) > 0).all()


def test_stamps_that_seconds_cannot_tell_apart_are_duplicates() -> None:
    time_ns = np.array([0, 10**18, 10**18 + 1, 10**18 + 10**6])
    assert clock.believable_times(time_ns).rows.tolist() == [0, 1, 3]
    extreme = np.array([-(2**63), -(2**62), 5, 2**62, 2**63 - 1])
    assert clock.believable_times(extreme).rows.tolist() == [2]


def test_a_piece_goes_on_after_the_one_before() -> None:
    time_ns = stamps(10)
    timed = clock.believable_times(time_ns, after=int(time_ns[3]))
    assert timed.rows.tolist() == [4, 5, 6, 7, 8, 9]
