"""Walking the records of whole, cut and damaged files; `benchmarks/damage.py` does the same in every place."""

import struct
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import recordings
import zstandard

from gsfdi import ingest
from gsfdi.readers.mcap_file import message_counts
from gsfdi.types import Problem
from gsfdi.wire.records import Block, walk
from gsfdi.wire.tail import Cursor
from gsfdi.wire.unpack import unpack

VARIANTS = {
    "zstd": {"compression": "zstd", "chunk_size": 4096},
    "lz4": {"compression": "lz4", "chunk_size": 4096},
    "none": {"compression": "none", "chunk_size": 4096},
    "no index": {"use_summary_offsets": False, "repeat_channels": False, "repeat_schemas": False},
    "no chunks": {"use_chunking": False},
    "no checksums": {"enable_crcs": False},
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_message_is_found(tmp_path: Path, variant: str) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 300, **VARIANTS[variant])
    assert message_counts(path)["/joint_states"] == 300
    batch = ingest.read([path])
    assert [len(record.t) for record in batch.records] == [300] * 3
    assert not [problem for problem in batch.problems if problem.kind != "note"]
    assert any("unverified" in p.what for p in batch.problems) == (variant in ("no chunks", "no checksums"))


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_what_was_written_before_a_cut_is_recovered(tmp_path: Path, compression: str) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 200, compression=compression, chunk_size=8192)
    whole = path.read_bytes()
    counts = []
    for at in range(8, len(whole) - 1, len(whole) // 25):
        path.write_bytes(whole[:at])
        counts.append(message_counts(path).total())
        assert any("cut short" in problem.what for problem in ingest.read([path]).problems)
    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] == 200


def test_a_wrong_checksum_costs_its_chunk_and_is_named(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 200, compression="none", chunk_size=8192)
    whole = bytearray(path.read_bytes())
    at = whole.index(b"wrist", len(whole) // 2)
    whole[at + 12] ^= 1
    path.write_bytes(whole)
    batch = ingest.read([path])
    assert any("checksum fails" in problem.what for problem in batch.problems)
    assert 150 < len(batch.records[0].t) < 200


def test_the_checksum_over_all_data_guards_files_without_chunks(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 50, use_chunking=False, enable_data_crcs=True)
    assert len(ingest.read([path]).records) == 3
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 1
    path.write_bytes(whole)
    batch = ingest.read([path])
    assert not batch.records
    assert any("checksum" in problem.what for problem in batch.problems)


def test_the_index_shows_the_way_past_a_wrong_length(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 200, chunk_size=8192)
    whole = bytearray(path.read_bytes())
    at = 8
    while whole[at] != 6:
        at += 9 + struct.unpack_from("<Q", whole, at + 1)[0]
    struct.pack_into("<Q", whole, at + 1, 2**40)
    path.write_bytes(whole)
    batch = ingest.read([path])
    assert any("claims more bytes" in problem.what for problem in batch.problems)


def test_a_long_record_between_chunks_is_read_by_itself(tmp_path: Path) -> None:
    big = b"x" * (5 << 20)
    entry = ("/camera", "raw", "", "", b"", [(recordings.T0, big)])
    path = recordings.write_mcap(tmp_path / "a.mcap", [entry], use_chunking=False)
    assert message_counts(path)["/camera"] == 1


def test_a_file_that_promises_too_much_is_not_unpacked() -> None:
    zeros = bytes(50 << 20)
    for name, packed in (("zstd", zstandard.compress(zeros)), ("lz4", lz4.frame.compress(zeros))):
        assert len(unpack(name, packed, len(zeros), cut=False)) == len(zeros)
        with pytest.raises(ValueError, match="not the 1000"):
            unpack(name, packed, 1000, cut=False)
    with pytest.raises(ValueError, match="none of zstd, lz4"):
        unpack("bz2", b"", 0, cut=False)


def test_frames_side_by_side_unpack_as_one() -> None:
    parts = [bytes([i]) * 1000 for i in range(3)]
    for name, packed in (
        ("zstd", b"".join(zstandard.compress(part) for part in parts)),
        ("lz4", b"".join(lz4.frame.compress(part) for part in parts)),
    ):
        assert unpack(name, packed, 3000, cut=False) == b"".join(parts)


def test_a_cursor_never_leaves_its_record() -> None:
    cursor = Cursor(struct.pack("<I", 100) + b"abc")
    with pytest.raises(ValueError, match="100 bytes wanted, 3 left"):
        cursor.text()


def test_flipped_bits_give_no_wrong_number_under_checksums(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 40, compression="lz4", chunk_size=2048)
    truth = {
        r.joint: dict(zip((r.t0_ns + np.round(r.t * 1e9)).tolist(), r["position"], strict=True))
        for r in ingest.read([path]).records
    }
    whole = path.read_bytes()
    for at in range(3, len(whole), 97):
        damaged = bytearray(whole)
        damaged[at] ^= 1 << (at % 8)
        path.write_bytes(damaged)
        for record in ingest.read([path]).records:
            for stamp, value in zip(
                (record.t0_ns + np.round(record.t * 1e9)).tolist(), record["position"], strict=True
            ):
                assert truth[record.joint][stamp] == value


def test_walking_hands_on_bounded_blocks(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 2000, use_chunking=False)
    blocks = [item for item in walk(path) if isinstance(item, Block)]
    assert not [item for item in walk(path) if isinstance(item, Problem)]
    assert sum(len(block.data) for block in blocks) <= path.stat().st_size
