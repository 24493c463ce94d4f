"""What every reader of the shelf must do, on small recordings made here."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import recordings

from gsfdi import ingest
from gsfdi.canonical import write_parquet
from gsfdi.canonical_mcap import write_mcap
from gsfdi.readers import Reader
from gsfdi.registry import shelf
from gsfdi.types import JointRecord

READERS = shelf("gsfdi.readers", Reader)
T = np.arange(400) * 0.01
RECORD = JointRecord("arm", "J1", recordings.T0, T, {"position": np.sin(T), "motor_current": 0.1 + np.cos(T)})


def write_csv(path: Path, records: list[JointRecord]) -> None:
    rows = ["timestamp,joint,position_rad,motor_current_a"]
    for record in records:
        for i, second in enumerate(record.t):
            stamp = record.t0_ns + round(float(second) * 1e9)
            rows.append(
                f"{stamp},{record.joint},{float(record['position'][i])!r},{float(record['motor_current'][i])!r}"
            )
    path.write_text("\n".join(rows) + "\n")


WRITERS: dict[str, Callable[[Path, list[JointRecord]], None]] = {
    "mcap": write_mcap,
    "parquet": write_parquet,
    "csv": write_csv,
}


@pytest.fixture(params=sorted(READERS))
def sample(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, Path]:
    path = tmp_path / "sample.bin"
    WRITERS[request.param](path, [RECORD])
    return request.param, path


def test_a_reader_knows_its_own_and_refuses_the_others(sample: tuple[str, Path]) -> None:
    head = sample[1].read_bytes()[: 1 << 16]
    assert [name for name, reader in READERS.items() if reader.sniff(head)] == [
        next(name for name, reader in READERS.items() if reader.name == sample[0])
    ]


def test_canonical_telemetry_needs_no_mapping(sample: tuple[str, Path]) -> None:
    batch = ingest.read([sample[1]])
    (record,) = batch.records
    assert not [problem for problem in batch.problems if problem.kind != "note"]
    assert (record.joint, record.t0_ns, record.axis) == ("J1", recordings.T0, "rotary")
    assert len(record.sha256) == 64
    for name, values in RECORD.channels.items():
        np.testing.assert_allclose(record.channels[name], values, rtol=0, atol=1e-15)
    np.testing.assert_allclose(record.t, T, atol=1e-9)


def test_reading_twice_gives_the_same(sample: tuple[str, Path]) -> None:
    first, second = (ingest.read([sample[1]]).records[0] for _ in range(2))
    assert first.quality == second.quality
    np.testing.assert_array_equal(first.t, second.t)


def test_pieces_add_up_to_the_whole(sample: tuple[str, Path]) -> None:
    whole = ingest.read([sample[1]]).records[0]
    pieces = [record for batch in ingest.stream([sample[1]], piece=1) for record in batch.records]
    np.testing.assert_array_equal(
        np.concatenate([piece.channels["position"] for piece in pieces]), whole.channels["position"]
    )


def test_it_says_what_a_file_holds(sample: tuple[str, Path]) -> None:
    about = ingest.describe(sample[1])
    assert about["format"] == sample[0]
    assert "integrity" in about
    assert "position" in str(about)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
def test_a_cut_file_is_named_and_never_raises(sample: tuple[str, Path], share: float) -> None:
    whole = sample[1].read_bytes()
    sample[1].write_bytes(whole[: int(share * len(whole))])
    batch = ingest.read([sample[1]])
    assert batch.problems  # of text no more can be said than that its last line may be cut
    for record in batch.records:
        np.testing.assert_array_equal(record.channels["position"], np.sin(T)[: len(record.t)])


def test_garbage_is_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    for i, head in enumerate([b"", b"PAR1", b"\x89MCAP0\r\n", b"a,b\n1,2\n", b"\x00", b"t;x\n"]):
        path = tmp_path / f"{i}.bin"
        path.write_bytes(head + rng.bytes(500) * (i > 0))
        batch = ingest.read([path])
        assert not batch.records
        assert batch.problems
