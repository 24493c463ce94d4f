import json
from pathlib import Path

import numpy as np
import pytest
import recordings

from gsfdi import ingest
from gsfdi.errors import BaselineError, UnusableInputError
from gsfdi.store import Store
from gsfdi.types import Batch, JointRecord

T = np.arange(3000) * 0.01


def record(joint: str = "J1", t0_ns: int = 10**18, sha256: str = "ab" * 32) -> JointRecord:
    return JointRecord(
        "arm/1", joint, t0_ns, T, {"position": np.sin(T), "motor_current": np.cos(T)}, "rotary", {}, "a.mcap", sha256
    )


def test_the_same_bytes_twice_are_one_batch(tmp_path: Path) -> None:
    batch = ingest.read([recordings.joint_states(tmp_path / "a.mcap")])
    store = Store(tmp_path / "store")
    assert len(store.add(batch)) == 3
    assert store.add(batch) == []
    assert len(list(store.records())) == 3


def test_what_was_kept_comes_back(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.add(Batch((record(), record("J 2"))))
    (back,) = store.records(joints=["J 2"])
    assert (back.robot, back.joint, back.t0_ns, back.source, back.sha256) == (
        "arm/1",
        "J 2",
        10**18,
        "a.mcap",
        "ab" * 32,
    )
    assert set(back.channels) == {"position", "motor_current"}
    np.testing.assert_array_equal(back.channels["position"], np.sin(T))
    np.testing.assert_allclose(back.t, T, atol=1e-12)


def test_days_are_kept_apart(tmp_path: Path) -> None:
    midnight = 1_700_006_400_000_000_000
    store = Store(tmp_path)
    written = store.add(Batch((record(t0_ns=midnight - 10_000_000_000),)))
    assert [path.parents[1].name for path in written] == ["date=2023-11-14", "date=2023-11-15"]
    assert [len(part.t) for part in store.records()] == [1000, 2000]


def test_another_reading_of_the_same_bytes_takes_its_place(tmp_path: Path) -> None:
    path = recordings.joint_states(tmp_path / "a.mcap", 400)
    store = Store(tmp_path / "store")
    store.add(ingest.read([path]))
    for piece in ingest.stream([path], piece=500):
        store.add(piece)
    assert sum(len(part.t) for part in store.records(joints=["elbow"])) == 400
    store.add(ingest.read([path]))
    assert sum(len(part.t) for part in store.records(joints=["elbow"])) == 400


def test_pieces_are_bounded_and_complete(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.add(Batch((record(),)))
    pieces = list(store.pieces("J1", seconds=4.0))
    assert max(len(piece.t) for piece in pieces) <= 401
    assert sum(len(piece.t) for piece in pieces) == 3000
    (some,) = store.pieces("J1", start_ns=10**18 + 5 * 10**9, end_ns=10**18 + 6 * 10**9)
    assert len(some.t) == 100
    np.testing.assert_array_equal(some.channels["position"], np.sin(T[500:600]))


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    store = Store(tmp_path)
    (path,) = store.add(Batch((record(),)))
    damaged = bytearray(path.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    path.write_bytes(damaged)
    with pytest.raises(UnusableInputError, match=path.name):
        list(store.records())
    assert store.add(Batch((record(),))) == [path]  # the same bytes again mend it
    assert len(list(store.records())) == 1


@pytest.mark.parametrize("reader", ["pandas", "polars", "duckdb"])
def test_others_read_it_as_it_is(tmp_path: Path, reader: str) -> None:
    library = pytest.importorskip(reader)
    store = Store(tmp_path)
    linear = JointRecord("arm/1", "slide", 10**18, T, {"position": np.sin(T)}, "linear", {}, "b", "cd" * 32)
    store.add(Batch((record(), record("J 2"), linear)))
    home, glob = tmp_path / "telemetry", str(tmp_path / "telemetry" / "**" / "*.parquet")
    if reader == "duckdb":
        counts = dict(library.sql(f"select joint, count(*) from '{glob}' group by joint").fetchall())
    else:
        frame = library.read_parquet(home if reader == "pandas" else glob)
        frame = frame if reader == "pandas" else frame.to_pandas()
        counts = frame["joint"].astype(str).value_counts().to_dict()
    assert counts == {"J1": 3000, "J 2": 3000, "slide": 3000}


def test_baselines_are_versioned_and_checked(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.save_baseline("arm", {"gain": 1.5})
    digest = store.save_baseline("arm", {"gain": 2.5})
    assert store.load_baseline("arm") == ({"gain": 2.5}, digest)
    assert store.load_baseline("arm", 1)[0] == {"gain": 1.5}
    path = tmp_path / "baselines" / "arm" / "000002.json"
    whole = json.loads(path.read_text())
    whole["content"]["gain"] = 2.6
    path.write_text(json.dumps(whole))
    with pytest.raises(BaselineError, match="checksum"):
        store.load_baseline("arm")
    with pytest.raises(BaselineError, match="known: arm"):
        store.load_baseline("other")


def test_the_ledger_only_grows(tmp_path: Path) -> None:
    store = Store(tmp_path)
    assert store.append_ledger("arm", "J1", "a", {"x": 1})
    assert not store.append_ledger("arm", "J1", "a", {"x": 2})
    path = tmp_path / "ledger" / "arm" / "J1.jsonl"
    path.write_text(path.read_text() + "0123 torn line")  # a run was killed while it wrote
    assert store.append_ledger("arm", "J1", "b", {"x": 3})
    assert store.ledger("arm", "J1") == [{"x": 1}, {"x": 3}]
