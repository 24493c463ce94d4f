import os
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import recordings
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import JOINT_STATE, NAMES, T0, joint_state, motion

from gsfdi import ingest
from gsfdi.errors import UnusableInputError
from gsfdi.ingest import reading
from gsfdi.mapping import parse
from gsfdi.readers import parquet_file

REAL = Path(os.environ.get("GSFDI_REAL", Path(__file__).parents[2] / "shared" / "real"))
CONFIGS = Path(__file__).parents[1] / "configs"
STEP = 10_000_000


def write(path: Path, messages: list[tuple[int, bytes]], topic: str = "/joint_states") -> Path:
    entry = (topic, "cdr", "sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode(), messages)
    return recordings.write_mcap(path, [entry])


def test_folders_globs_and_files_are_gathered_once(tmp_path: Path) -> None:
    paths = [recordings.joint_states(tmp_path / name, 5) for name in ("a.mcap", "b.mcap")]
    (tmp_path / "notes.txt").write_text("nothing to read here\n")
    assert ingest.gather([str(tmp_path)]) == paths
    assert ingest.gather([str(paths[0]), str(tmp_path / "*.mcap")]) == paths
    for missing in ("none.mcap", "none/*.mcap"):
        with pytest.raises(UnusableInputError, match="does not exist"):
            ingest.gather([str(tmp_path / missing)])


def test_joints_may_be_narrowed(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap")
    assert [record.joint for record in ingest.read([path], joints=["elbow"]).records] == ["elbow"]
    (problem,) = ingest.read([path], joints=["knee"]).problems
    assert "no joint telemetry of knee" in problem.what


def test_one_bad_file_does_not_stop_the_others(tmp_path: Path) -> None:
    good = recordings.joint_states(tmp_path / "a.mcap")
    bad = tmp_path / "b.mcap"
    bad.write_bytes(b"not a recording")
    batch = ingest.read([bad, tmp_path / "gone.mcap", good])
    assert len(batch.records) == 3
    assert [Path(problem.path).name for problem in batch.problems] == ["b.mcap", "gone.mcap"]


def test_leader_and_follower_meet_in_one_record(tmp_path: Path) -> None:
    position, velocity, effort = motion(300, 3)
    leader = [(T0 + i * STEP, joint_state(T0 + i * STEP + 1_000, NAMES, position[i])) for i in range(300)]
    follower = [
        (T0 + i * STEP, joint_state(T0 + i * STEP - 1_000, NAMES, 0.5 * position[i], velocity[i], effort[i]))
        for i in range(300)
    ]
    kind = ("cdr", "sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode())
    path = recordings.write_mcap(tmp_path / "a.mcap", [("/lead", *kind, leader), ("/follow", *kind, follower)])
    table = {"names": "name[]", "unit": "deg", "rename": {"elbow": "middle"}}
    mapping = parse(
        {
            "schema": "gsfdi/mapping/1",
            "robot": "left",
            "time": "header.stamp",
            "setpoint_rad": {"topic": "/lead", "field": "position[]", **table},
            "position_rad": {"topic": "/follow", "field": "position[]", **table},
        }
    )
    records = {record.joint: record for record in ingest.read([path], [mapping]).records}
    assert set(records) == {"shoulder", "middle", "wrist"}
    record = records["middle"]
    assert record.robot == "left"
    assert record.t0_ns == T0 - 1_000
    # The leader stamps 2 us later; the two samples of a cycle belong together all the same.
    np.testing.assert_allclose(record["setpoint"], np.radians(position[:, 1]), atol=1e-15)
    np.testing.assert_allclose(record["position"], np.radians(0.5 * position[:, 1]), atol=1e-15)


def test_a_setpoint_that_stops_is_not_carried_on(tmp_path: Path) -> None:
    position, _, _ = motion(300, 3)
    kind = ("cdr", "sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode())
    messages = [(T0 + i * STEP, joint_state(T0 + i * STEP, NAMES, position[i])) for i in range(300)]
    path = recordings.write_mcap(tmp_path / "a.mcap", [("/lead", *kind, messages[:100]), ("/follow", *kind, messages)])
    base = {"field": "position[]", "names": "name[]"}
    mapping = parse(
        {
            "schema": "gsfdi/mapping/1",
            "setpoint_rad": {"topic": "/lead", **base},
            "position_rad": {"topic": "/follow", **base},
        }
    )
    record = ingest.read([path], [mapping]).records[0]
    assert np.isfinite(record["setpoint"]).sum() == pytest.approx(105, abs=1)
    assert record.quality["time"]["stale setpoint"] == pytest.approx(195, abs=1)


def test_names_reorder_go_missing_and_arrays_are_empty(tmp_path: Path) -> None:
    position, velocity, _ = motion(400, 3)
    orders = ([0, 1, 2], [2, 0, 1], [1], [])
    messages = []
    for i in range(400):
        order = orders[i % 4]
        names = [NAMES[j] for j in order]
        speeds = velocity[i, order] if i % 2 else []
        messages.append((T0 + i * STEP, joint_state(T0 + i * STEP, names, position[i, order], speeds)))
    batch = ingest.read([write(tmp_path / "a.mcap", messages)])
    records = {record.joint: record for record in batch.records}
    assert [len(records[joint].t) for joint in NAMES] == [200, 300, 200]
    for j, joint in enumerate(NAMES):
        record = records[joint]
        rows = np.round(record.t * 100).astype(int) + round((record.t0_ns - T0) / STEP)
        known = np.isfinite(record["position"])
        np.testing.assert_array_equal(record["position"][known], position[rows[known], j])
        assert {int(row) % 4 for row in rows[known]} == {i for i, order in enumerate(orders) if j in order}
    assert record.quality["time"]["empty"] == 100
    assert "100 empty" in batch.problems[-1].what


def test_a_driver_that_leaves_stamps_at_zero_is_read_by_log_time(tmp_path: Path) -> None:
    position, _, _ = motion(100, 3)
    messages = [(T0 + i * STEP, joint_state(0, NAMES, position[i])) for i in range(100)]
    record = ingest.read([write(tmp_path / "a.mcap", messages)]).records[0]
    assert (record.t0_ns, len(record.t)) == (T0, 100)


@pytest.mark.parametrize(("wanted", "sensed"), [("desired", "actual"), ("reference", "feedback")])
def test_controller_states_of_both_eras(tmp_path: Path, wanted: str, sensed: str) -> None:
    position, _, _ = motion(100, 3)
    messages = [
        (T0 + i * STEP, recordings.trajectory_state(T0 + i * STEP, NAMES, position[i], 0.5 * position[i]))
        for i in range(100)
    ]
    schema = recordings.controller_state(wanted, sensed).encode()
    name = "control_msgs/msg/JointTrajectoryControllerState"
    path = recordings.write_mcap(tmp_path / "a.mcap", [("/jtc/state", "cdr", name, "ros2msg", schema, messages)])
    record = ingest.read([path]).records[0]
    np.testing.assert_array_equal(record["setpoint"], position[:, 0])
    np.testing.assert_array_equal(record["position"], 0.5 * position[:, 0])
    np.testing.assert_array_equal(record["setpoint_rate"], 0.1 * position[:, 0])


def test_joint_states_come_before_a_controllers_own_account(tmp_path: Path) -> None:
    position, velocity, effort = motion(200, 3)
    schema = recordings.controller_state("reference", "feedback").encode()
    states = [
        (T0 + i * STEP, joint_state(T0 + i * STEP, NAMES, position[i], velocity[i], effort[i])) for i in range(200)
    ]
    control = [
        (T0 + i * STEP, recordings.trajectory_state(T0 + i * STEP, NAMES, 2 * position[i], 3 * position[i]))
        for i in range(200)
    ]
    path = recordings.write_mcap(
        tmp_path / "a.mcap",
        [
            ("/jtc/state", "cdr", "control_msgs/msg/JointTrajectoryControllerState", "ros2msg", schema, control),
            ("/joint_states", "cdr", "sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode(), states),
        ],
    )
    records = ingest.read([path]).records
    assert {record.robot for record in records} == {"robot"}
    np.testing.assert_array_equal(records[0]["setpoint"], 2 * position[:, 0])
    np.testing.assert_array_equal(records[0]["position"], position[:, 0])
    np.testing.assert_array_equal(records[0]["drive_torque"], effort[:, 0])


@settings(max_examples=60, deadline=None)
@given(
    faults=st.lists(
        st.tuples(
            st.sampled_from(["late", "twice", "zero", "far", "nan", "absurd", "spike", "inf"]),
            st.integers(10, 289),
            st.integers(0, 2),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_faults_of_time_and_value_are_masked_and_counted(
    tmp_path_factory: pytest.TempPathFactory, faults: list[tuple[str, int, int]]
) -> None:
    position, velocity, _ = motion(300, 3)
    stamps = T0 + np.arange(300) * STEP
    values = position.copy()
    moved = set()
    for kind, row, joint in sorted(faults, key=lambda fault: fault[1]):  # "twice" repeats a stamp as it was sent
        if kind in ("late", "twice", "zero", "far"):
            stamps[row] = {
                "late": stamps[row] - 55 * STEP,
                "twice": stamps[row - 1],
                "zero": 1,
                "far": 2**31 * 10**9 - 1,
            }[kind]
            moved.add(row)
        else:
            row -= row % 10 if kind == "spike" else 0  # what lasts two samples is no spike
            values[row, joint] = {"nan": np.nan, "absurd": 1e165, "spike": 50.0, "inf": -np.inf}[kind]
    messages = [(T0 + i * STEP, joint_state(int(stamps[i]), NAMES, values[i], velocity[i])) for i in range(300)]
    path = write(tmp_path_factory.mktemp("faults") / "a.mcap", messages)
    batch = ingest.read([path])
    assert len(batch.records) == 3
    for j, record in enumerate(batch.records):
        assert (np.diff(record.t) > 0).all()
        assert len(record.t) >= 300 - 2 * len(moved)
        rows = np.round((record.t0_ns - T0) / STEP + record.t * 100).astype(int)
        believed = np.isfinite(record["position"])
        np.testing.assert_array_equal(record["position"][believed], position[rows[believed], j])
        lost = sum(record.quality["time"].get(kind, 0) for kind in ("duplicate", "out_of_order", "clock_jump"))
        assert lost == 300 - len(record.t)
        masked = sum(record.quality["position"].values())
        assert masked >= np.sum(~believed)
    assert bool(moved) <= any("left out" in problem.what for problem in batch.problems)


def test_each_table_takes_the_mapping_that_fits(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,q\n" + "".join(f"{0.01 * i},{i}\n" for i in range(50)))
    (tmp_path / "b.csv").write_text("s,angle\n" + "".join(f"{0.01 * i},{i}\n" for i in range(50)))
    head = {"schema": "gsfdi/mapping/1"}
    mappings = [
        parse({**head, "robot": time, "time": time, "position_rad": {"columns": {"J1": column}, "unit": "deg"}})
        for time, column in (("t", "q"), ("s", "angle"))
    ]
    batch = ingest.read([tmp_path / "a.csv", tmp_path / "b.csv"], mappings)
    assert [record.robot for record in batch.records] == ["t", "s"]
    assert not ingest.read([tmp_path / "a.csv"], mappings[1:]).records


def test_topics_that_no_mapping_names_are_read_by_their_schemas_and_that_is_said(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 50)
    table = {"topic": "/elsewhere", "field": "position[]", "names": "name[]"}
    batch = ingest.read([path], [parse({"schema": "gsfdi/mapping/1", "position_rad": table})])
    assert len(batch.records) == 3
    assert any("/elsewhere" in problem.what and problem.kind == "note" for problem in batch.problems)


def test_dynamic_states_name_their_interfaces(tmp_path: Path) -> None:
    schema = (
        "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values\n"
        + "=" * 80
        + "\nMSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n"
        + recordings.HEADER
    )
    messages = []
    for i in range(60):
        cdr = recordings.Cdr().stamp(T0 + i * STEP).texts(["a", "b"]).put("I", 2)
        for j in range(2):
            cdr.texts(["position", "effort", "humidity"]).doubles([i + j, 0.5 * i, 3.0])
        messages.append((T0 + i * STEP, bytes(cdr.data)))
    name = "control_msgs/msg/DynamicJointState"
    entry = ("/dynamic_joint_states", "cdr", name, "ros2msg", schema.encode(), messages)
    batch = ingest.read([recordings.write_mcap(tmp_path / "a.mcap", [entry])])
    assert [sorted(record.channels) for record in batch.records] == [["drive_torque", "position"]] * 2
    np.testing.assert_array_equal(batch.records[1].channels["position"], 1.0 + np.arange(60))


def test_arrays_longer_than_the_names_are_counted(tmp_path: Path) -> None:
    position, velocity, _ = motion(100, 3)
    messages = []
    for i in range(100):
        names = NAMES[:2] if i == 30 else NAMES
        messages.append((T0 + i * STEP, joint_state(T0 + i * STEP, names, position[i], velocity[i, : len(names)])))
    batch = ingest.read([write(tmp_path / "a.mcap", messages)])
    assert np.isnan(batch.records[0]["position"][30])
    assert np.isfinite(batch.records[0]["joint_velocity"][30])
    assert any("1 ragged" in problem.what for problem in batch.problems)


def test_a_mapping_may_name_single_fields(tmp_path: Path) -> None:
    position, _, _ = motion(100, 3)
    messages = [(T0 + i * STEP, joint_state(T0 + i * STEP, NAMES, position[i])) for i in range(100)]
    path = write(tmp_path / "a.mcap", messages, "/drive/states")
    by_joint = {"topic": "/drive/states", "columns": {"J1": "position[0]", "J3": "position[2]"}}
    alone = {"topic": "/drive/states", "field": "position[1]"}
    for table, expected in ((by_joint, {"J1": 0, "J3": 2}), (alone, {"states": 1})):
        records = ingest.read([path], [parse({"schema": "gsfdi/mapping/1", "position_rad": table})]).records
        assert {record.joint for record in records} == set(expected)
        for record in records:
            np.testing.assert_array_equal(record["position"], position[:, expected[record.joint]])


@pytest.mark.parametrize("zone", ["", "Z", "+02:00"])
def test_tables_may_give_dates(tmp_path: Path, zone: str) -> None:
    rows = [f"2023-11-14 22:13:{20 + 0.01 * i:012.9f}{zone};{i},5;x" for i in range(200)]
    (tmp_path / "a.csv").write_text("when;q;note\n" + "\n".join(rows) + "\n")
    table = {"columns": {"J1": "q"}, "unit": "deg"}
    mapping = parse({"schema": "gsfdi/mapping/1", "time": "when", "position_rad": table})
    (record,) = ingest.read([tmp_path / "a.csv"], [mapping]).records
    assert record.t0_ns == T0 - (7_200 * 10**9 if zone.startswith("+") else 0)
    np.testing.assert_allclose(record["position"], np.radians(np.arange(200) + 0.5))


def test_any_protobuf_is_read_through_a_mapping(tmp_path: Path) -> None:
    path = recordings.protobuf_recording(tmp_path / "a.mcap", 100)
    table = {"topic": "/arm/joints", "names": "joints[].name"}
    mapping = parse(
        {
            "schema": "gsfdi/mapping/1",
            "robot": "arm",
            "time": "timestamp",
            "position_m": {**table, "field": "joints[].position", "unit": "mm"},
            "motor_velocity_m_s": {**table, "field": "joints[].velocity", "unit": "mm/s", "scale": 2.0},
        }
    )
    records = ingest.read([path], [mapping]).records
    position, velocity, _ = motion(100, 3)
    assert {(record.robot, record.axis) for record in records} == {("arm", "linear")}
    np.testing.assert_allclose(records[2].channels["position"], 1e-3 * position[:, 2])
    np.testing.assert_allclose(records[2].channels["motor_velocity"], 2e-3 * velocity[:, 2])


def test_summary_tells_what_was_masked(tmp_path: Path) -> None:
    position, _, _ = motion(300, 3)
    position[50, 1] = 1e165
    messages = [(T0 + i * STEP, joint_state(T0 + i * STEP, NAMES, position[i])) for i in range(300)]
    rows = ingest.summary(ingest.read([write(tmp_path / "a.mcap", messages)]).records)
    assert [row["joint"] for row in rows] == ["elbow", "shoulder", "wrist"]
    assert rows[0]["masked"] == {"position": {"absurd": 1.0}}
    assert rows[0]["rate_hz"] == pytest.approx(100.0)


def real(name: str) -> Path:
    path = REAL / name
    if not path.exists():
        pytest.skip(f"{path} is not here; GSFDI_REAL says where")
    return path


def test_a_real_arm_by_ros2() -> None:
    mappings = [ingest.load_mapping(CONFIGS / f"leader_follower{side}.toml") for side in ("", "_right")]
    batch = ingest.read(ingest.gather([str(real("jointstate_mcap"))]), mappings)
    assert not batch.problems
    assert len(batch.records) == 28
    assert {record.robot for record in batch.records} == {"arm_left", "arm_right"}
    assert all({"setpoint", "position", "joint_velocity", "drive_torque"} <= set(r.channels) for r in batch.records)


def test_a_real_arm_with_corrupt_text() -> None:
    mapping = ingest.load_mapping(CONFIGS / "ur10e.toml")
    batch = ingest.read(ingest.gather([str(real("ur10e"))]), [mapping])
    assert len(batch.records) == 36
    corrupt = {Path(problem.path).name for problem in batch.problems if "corrupt" in problem.what}
    assert corrupt == {
        "identification_data__ur-19_09_27-11_32_02.csv",
        "identification_data__ur-20_02_19_15harm50secLoad.csv",
    }
    assert any("after 20 of 31 fields" in problem.what for problem in batch.problems)
    for record in batch.records:
        assert np.nanmax(np.abs(record["position"])) < 4.0


def test_real_recordings_without_joints_say_so() -> None:
    batch = ingest.read(ingest.gather([str(real("rosbag2-mcap"))]))
    assert not batch.records
    assert sum("no joint telemetry" in problem.what for problem in batch.problems) == 4
    assert any("integrity unverified" in problem.what for problem in batch.problems)


def test_a_mapping_holds_from_the_first_message_on(tmp_path: Path) -> None:
    """A topic that the mapping passes over is not read just because it comes before those that are mapped."""
    position, _, _ = motion(100, 3)
    kind = ("cdr", "sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode())
    messages = [(T0 + i * STEP, joint_state(T0 + i * STEP, NAMES, position[i])) for i in range(100)]
    path = recordings.write_mcap(
        tmp_path / "a.mcap",
        [("/other/joint_states", *kind, messages[:50]), ("/mine", *kind, messages[50:])],
        chunk_size=1,
    )
    table = {"topic": "/mine", "field": "position[]", "names": "name[]"}
    batch = ingest.read([path], [parse({"schema": "gsfdi/mapping/1", "robot": "me", "position_rad": table})])
    assert {(record.robot, len(record.t)) for record in batch.records} == {("me", 50)}


def test_a_table_that_promises_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows of one value take no room in Parquet, so a small file may hold any number of them."""
    rows = 100_000
    stamps = pa.array(np.zeros(rows, np.int64)).cast(pa.timestamp("ns"))
    table = pa.table({"timestamp": stamps, "joint": ["J"] * rows, "position_rad": np.zeros(rows)})
    pq.write_table(table, tmp_path / "a.parquet")
    monkeypatch.setattr(parquet_file, "MOST_FREE", 1 << 20)
    monkeypatch.setattr(parquet_file, "MOST_RATIO", 100)
    (problem,) = ingest.read([tmp_path / "a.parquet"]).problems
    assert "more than its size can honestly hold" in problem.what


def test_a_file_too_long_to_hold_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 100)
    monkeypatch.setattr(reading, "MOST_HELD", 50)
    (problem,) = ingest.read([path]).problems
    assert "too long" in problem.what
    assert len(list(ingest.stream([path]))[-1].records) == 3
