import json
from pathlib import Path

import numpy as np
import pytest
import recordings
from recordings import NAMES, T0, motion

from gsfdi import ingest
from gsfdi.mapping import parse
from gsfdi.types import Batch


@pytest.mark.parametrize("schema", [True, False])
def test_json_is_read_with_a_schema_and_without(tmp_path: Path, schema: bool) -> None:
    batch = ingest.read([recordings.json_recording(tmp_path / "a.mcap", 300, schema=schema)])
    position, velocity, _ = motion(300, 3)
    for j, record in enumerate(batch.records):
        assert (record.robot, record.joint, record.t0_ns) == ("arm", NAMES[j], T0)
        np.testing.assert_array_equal(record.channels["position"], position[:, j])
        np.testing.assert_array_equal(record.channels["joint_velocity"], velocity[:, j])


def one_by_one(tmp_path: Path, contents: list[str]) -> Batch:
    messages = [(T0 + i * 10_000_000, content.encode()) for i, content in enumerate(contents)]
    path = recordings.write_mcap(tmp_path / "a.mcap", [("/arm/joint_states", "json", "", "", b"", messages)])
    return ingest.read([path])


def test_messages_of_many_shapes_are_read_one_by_one(tmp_path: Path) -> None:
    contents = []
    for i in range(120):
        names = ["a", "b"] if i % 3 else ["b", "a"]
        values = [float(i), -float(i)] if i % 3 else [-float(i), float(i)]
        contents.append(json.dumps({"name": names, "position": values}, indent=1 if i % 2 else None))
    contents[50] = '{"name": ["a", "b"], "position": [NaN, 3]}'
    contents[60] = "{"
    batch = one_by_one(tmp_path, contents)
    record = next(record for record in batch.records if record.joint == "a")
    expected = np.delete(np.arange(120.0), 60)
    expected[50] = np.nan
    np.testing.assert_array_equal(record.channels["position"], expected)
    assert record.quality["time"]["undecodable"] == 1


def test_integer_stamps_keep_their_nanoseconds(tmp_path: Path) -> None:
    contents = [json.dumps({"t": T0 + 7 * i, "pos": {"J1": 0.1 * i}}) for i in range(100)]
    messages = [(T0 + i * 10_000_000, content.encode()) for i, content in enumerate(contents)]
    path = recordings.write_mcap(tmp_path / "a.mcap", [("/x", "json", "", "", b"", messages)])
    table = {"topic": "/x", "field": "pos.J1", "unit": "deg", "rename": {"x": "J1"}}
    mapping = parse({"schema": "gsfdi/mapping/1", "time": "t", "time_unit": "ns", "position_rad": table})
    (record,) = ingest.read([path], [mapping]).records
    assert (record.joint, record.t0_ns) == ("J1", T0)
    np.testing.assert_allclose(record.t, 7e-9 * np.arange(100), atol=1e-15)
    np.testing.assert_allclose(record["position"], np.radians(0.1 * np.arange(100)))


def test_nesting_without_end_is_refused(tmp_path: Path) -> None:
    batch = one_by_one(tmp_path, ['{"name":' * 5000] * 40)
    assert not batch.records
