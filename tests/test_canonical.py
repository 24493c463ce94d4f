import hashlib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gsfdi import canonical, ingest, seal
from gsfdi.errors import UnusableInputError
from gsfdi.types import JointRecord

T = np.arange(300) * 0.01


def record(joint: str = "J1", axis: str = "rotary") -> JointRecord:
    channels = {"position": np.sin(T), "motor_current": np.where(T > 1, np.cos(T), np.nan)}
    return JointRecord("arm", joint, 10**18 + 1, T, channels, "linear" if axis == "linear" else "rotary")


def test_columns_carry_unit_and_meaning(tmp_path: Path) -> None:
    canonical.write_parquet(tmp_path / "a.parquet", [record(), record("slide", "linear")])
    schema = pq.read_schema(tmp_path / "a.parquet")
    assert schema.names == ["timestamp", "joint", "position_rad", "position_m", "motor_current_a"]
    assert schema.field("timestamp").type == pa.timestamp("ns", tz="UTC")
    assert schema.field("joint").type == pa.string()
    assert schema.field("position_rad").metadata == {
        b"unit": b"rad",
        b"description": b"measured joint position, output side",
    }
    assert all({b"unit", b"description"} <= set(field.metadata) for field in schema)


def test_pages_are_stored_as_promised(tmp_path: Path) -> None:
    canonical.write_parquet(tmp_path / "a.parquet", [record()])
    column = pq.ParquetFile(tmp_path / "a.parquet").metadata.row_group(0).column(2)
    assert column.compression == "ZSTD"
    assert "BYTE_STREAM_SPLIT" in column.encodings
    assert not column.has_dictionary_page


def test_stamps_keep_their_nanoseconds(tmp_path: Path) -> None:
    canonical.write_parquet(tmp_path / "a.parquet", [record()])
    stamps = pq.read_table(tmp_path / "a.parquet")["timestamp"].cast(pa.int64()).to_numpy()
    assert stamps[1] - stamps[0] == 10_000_000
    assert stamps[0] == 10**18 + 1


def test_a_flipped_bit_anywhere_breaks_the_seal(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    canonical.write_parquet(path, [record()])
    assert seal.digests(path).whole
    whole = path.read_bytes()
    for at in range(0, len(whole), 61):
        damaged = bytearray(whole)
        damaged[at] ^= 16
        path.write_bytes(damaged)
        with pytest.raises(UnusableInputError, match="parquet"):
            canonical.open_verified(path, seal.digests(path).whole)


def test_a_foreign_file_is_opened_without_a_seal(tmp_path: Path) -> None:
    pq.write_table(pa.table({"x": [1.0]}), tmp_path / "b.parquet")
    seen = seal.digests(tmp_path / "b.parquet")
    assert seen == (hashlib.sha256((tmp_path / "b.parquet").read_bytes()).hexdigest(), None)
    assert canonical.open_verified(tmp_path / "b.parquet", seen.whole).metadata.num_rows == 1


def test_the_joint_of_a_sealed_group_is_taken_from_its_statistics_and_else_from_its_rows(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    canonical.write_parquet(path, [record("J1"), record("J2")])  # a group of two joints
    assert [one.joint for one in ingest.read([path]).records] == ["J1", "J2"]
    canonical.write_parquet(path, [record("J1")])
    (sealed,) = ingest.read([path]).records
    table = pq.read_table(path).replace_schema_metadata(None)
    pq.write_table(table, tmp_path / "b.parquet")
    (foreign,) = ingest.read([tmp_path / "b.parquet"]).records
    assert sealed.joint == foreign.joint == "J1"
    for name, values in foreign.channels.items():
        assert np.array_equal(values, sealed.channels[name], equal_nan=True)
