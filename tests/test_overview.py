import tracemalloc

import numpy as np
import pytest

from gsfdi import overview
from gsfdi.overview import Overview
from gsfdi.types import JointRecord


def record(start: int, count: int) -> JointRecord:
    ticks = np.arange(start, start + count)
    return JointRecord(
        "arm", "SH1", int(start * 1e7), (ticks - start) * 0.01, {"position": ticks * 1.0},
        valid={"position": ticks % 7 != 0},
        quality={"position": {"stuck": 1.0}, "time": {"longest_gap_s": start * 0.1}},
    )  # fmt: skip


def test_a_short_recording_is_kept_whole() -> None:
    kept = Overview()
    kept.add(record(0, 500))
    kept.add(record(500, 500))
    whole = kept.record()
    np.testing.assert_allclose(whole.t, np.arange(1000) * 0.01, atol=1e-9)
    np.testing.assert_array_equal(whole.channels["position"], np.arange(1000.0))
    np.testing.assert_array_equal(np.isnan(whole["position"]), np.arange(1000) % 7 == 0)
    assert whole.quality["position"]["stuck"] == 2.0
    assert whole.quality["time"]["longest_gap_s"] == 50.0


@pytest.mark.parametrize("pieces", [[10] * 300, [3000], [1, 999, 7, 1993]])
def test_a_long_one_is_thinned_evenly_whatever_its_pieces(monkeypatch: pytest.MonkeyPatch, pieces: list[int]) -> None:
    monkeypatch.setattr(overview, "MOST", 100)
    kept, start = Overview(), 0
    for count in pieces:
        kept.add(record(start, count))
        start += count
    positions = kept.record().channels["position"]
    assert 100 <= positions.size <= 200
    assert kept.samples == start
    assert positions[0] == 0.0
    assert set(np.diff(positions)) == {positions[1]}
    np.testing.assert_allclose(kept.record().t, positions * 0.01, atol=1e-9)


def test_a_channel_that_comes_late_is_not_a_number_before() -> None:
    kept = Overview()
    kept.add(JointRecord("arm", "SH1", 0, np.arange(3.0), {"position": np.ones(3)}))
    kept.add(JointRecord("arm", "SH1", int(3e9), np.arange(2.0), {"position": np.ones(2), "temperature": np.ones(2)}))
    np.testing.assert_array_equal(np.isnan(kept.record().channels["temperature"]), [True] * 3 + [False] * 2)


def test_many_small_pieces_take_no_more_memory_than_a_few() -> None:
    def taken(pieces: int) -> int:
        tracemalloc.start()
        kept = Overview()
        for start in range(pieces):
            kept.add(record(start, 1))
        size = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()
        assert kept.samples == pieces
        return size

    many, few = (min(taken(pieces) for _ in range(3)) for pieces in (1000, 10))  # what else runs only adds to it
    assert many < few + 1000  # a byte for each piece would be seen
