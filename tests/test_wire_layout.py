"""Columns read at once must be what messages taken apart one by one say."""

import struct
from pathlib import Path

import numpy as np
import pytest
import recordings
from recordings import NAMES, T0, joint_state, motion

from gsfdi import ingest
from gsfdi.wire import topic


def test_protobuf_columns_are_what_was_written(tmp_path: Path) -> None:
    batch = ingest.read([recordings.protobuf_recording(tmp_path / "a.mcap", 500)])
    position, velocity, _ = motion(500, 3)
    for j, record in enumerate(batch.records):
        assert (record.robot, record.t0_ns) == ("arm.joints", T0)
        np.testing.assert_array_equal(record.channels["position"], position[:, j])
        np.testing.assert_array_equal(record.channels["joint_velocity"], velocity[:, j])
    np.testing.assert_allclose(batch.records[0].t, 0.01 * np.arange(500), atol=1e-9)


def test_columns_are_what_the_reference_decoder_says(tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap_ros2.reader")
    position, velocity, _ = motion(150, 3)
    messages = []
    for i in range(150):
        order = [[0, 1, 2], [1, 2], [2, 1, 0]][i % 3]
        names = [NAMES[j] for j in order]
        messages.append((T0 + i, joint_state(T0 + i, names, position[i, order], velocity[i, order], big=i % 5 == 0)))
    entry = ("/joint_states", "cdr", "sensor_msgs/msg/JointState", "ros2msg", recordings.JOINT_STATE.encode(), messages)
    path = recordings.write_mcap(tmp_path / "a.mcap", [entry])
    expected: dict[str, list[float]] = {name: [] for name in NAMES}
    for message in reader.read_ros2_messages(str(path)):
        for name, value in zip(message.ros_msg.name, message.ros_msg.position, strict=True):
            expected[name].append(value)
    for record in ingest.read([path]).records:
        np.testing.assert_array_equal(record.channels["position"], expected[record.joint])


@pytest.mark.parametrize(
    ("ticks", "tick_ns", "expected"),
    [
        (np.array([1.5, 2.25]), 1_000_000_000, [1_500_000_000, 2_250_000_000]),
        (np.array([1_700_000_000_000_000_001]), 1, [1_700_000_000_000_000_001]),
        (np.array([np.nan, 1e300]), 1, [0, 0]),
    ],
)
def test_ticks_become_nanoseconds(ticks: np.ndarray, tick_ns: int, expected: list[int]) -> None:
    assert topic.ticks_to_ns(ticks, tick_ns).tolist() == expected


def test_a_name_damaged_in_one_message_makes_no_new_joint(tmp_path: Path) -> None:
    position, _, _ = motion(600, 3)
    messages = [(T0 + i * 10**7, joint_state(T0 + i * 10**7, NAMES, position[i])) for i in range(600)]
    stamp, data = messages[300]
    messages[300] = (stamp, data.replace(b"elbow", b"elboW"))
    kind = ("/joint_states", "cdr", "sensor_msgs/msg/JointState", "ros2msg", recordings.JOINT_STATE.encode())
    batch = ingest.read([recordings.write_mcap(tmp_path / "a.mcap", [(*kind, messages)])])
    assert [record.joint for record in batch.records] == ["shoulder", "wrist", "elbow"]
    assert [len(record.t) for record in batch.records] == [600, 600, 599]
    assert any("elboW" in problem.what for problem in batch.problems)


def test_a_damaged_length_is_counted(tmp_path: Path) -> None:
    position, _, _ = motion(100, 3)
    messages = [(T0 + i * 10**7, joint_state(T0 + i * 10**7, NAMES, position[i])) for i in range(100)]
    stamp, data = messages[40]
    at = data.index(struct.pack("<I", 3) + struct.pack("<I", len(NAMES[0]) + 1))
    messages[40] = (stamp, data[:at] + struct.pack("<I", 7) + data[at + 4 :])
    kind = ("/joint_states", "cdr", "sensor_msgs/msg/JointState", "ros2msg", recordings.JOINT_STATE.encode())
    batch = ingest.read([recordings.write_mcap(tmp_path / "a.mcap", [(*kind, messages)])])
    assert {len(record.t) for record in batch.records} == {99}
    assert any("1 undecodable" in problem.what for problem in batch.problems)
