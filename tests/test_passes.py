import numpy as np
import pytest

from gsfdi import passes


@pytest.mark.parametrize("seed", range(20))
def test_runs_are_those_that_a_plain_walk_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = np.repeat(rng.integers(0, 4, 60).astype(float), rng.integers(1, 12, 60))
    values[rng.integers(0, len(values), 3)] = np.nan
    t = np.cumsum(rng.uniform(0.0, 0.2, len(values)))
    found, first = [], 0
    for i in range(1, len(values) + 1):
        if i == len(values) or values[i] != values[i - 1]:
            if i - first >= 5 and t[i - 1] - t[first] >= 0.5:
                found.append((first + 1, i))
            first = i
    assert list(passes.runs(values, t, 5, 0.5)) == found


def test_the_extent_passes_over_what_is_missing() -> None:
    assert passes.extent(np.array([3.0, np.nan, -1.0])) == (2, -1.0, 3.0)
    assert passes.extent(np.array([3.0, 4.0])) == (2, 3.0, 4.0)
    for nothing in (np.zeros(0), np.array([np.nan])):
        assert passes.extent(nothing) == (0, np.inf, -np.inf)


def test_a_long_channel_is_thinned_evenly_and_a_short_one_is_kept() -> None:
    short, long = np.arange(2.0 * passes.SAMPLED - 1), np.arange(1e5)
    assert passes.sampled(short) is short
    assert passes.SAMPLED / 2 < len(passes.sampled(long)) < 2 * passes.SAMPLED
    assert np.ptp(np.diff(passes.sampled(long))) == 0


@pytest.mark.parametrize(
    ("change", "rising"), [(0, True), (-(10**7), False), (-(10**9), False), (10**12, True), (10**13, False)]
)
def test_stamps_rise_without_a_jump(change: int, rising: bool) -> None:
    stamps = 10**18 + 10**7 * np.arange(100)
    stamps[50:] += change
    assert passes.rises(stamps, 2.0**61, 3_600_000_000_000) == rising
    assert not passes.rises(stamps * 3, 2.0**61, 3_600_000_000_000)
