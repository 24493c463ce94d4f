import numpy as np
import pytest

from gsfdi.detectors.signals import FEATURES, POINTS, Thinned, _features, _spread


def test_features_are_what_their_names_say() -> None:
    rng = np.random.default_rng(0)
    speed, effort = np.sin(0.02 * np.arange(500)), rng.standard_normal(500)
    tracking = 1e-3 * rng.standard_normal(500)
    found = dict(zip(FEATURES, _features(speed, effort, tracking, 0.01, 0.01).tolist(), strict=True))
    slewing = np.abs(speed) > 0.03
    assert found["effort rms while slewing"] == pytest.approx(np.sqrt(np.mean(effort[slewing] ** 2)))
    assert found["effort peak"] == pytest.approx(np.quantile(np.abs(effort), 0.98))
    acceleration = np.gradient(speed, 0.01)
    assert found["effort against acceleration"] == pytest.approx(np.corrcoef(acceleration, effort)[0, 1])
    assert found["rate error rms while slewing"] == pytest.approx(np.std(np.gradient(tracking, 0.01)[slewing]))
    assert np.isnan(found["effort mean at rest"])
    still = dict(zip(FEATURES, _features(0.0 * speed, effort, tracking, 0.01, 0.01).tolist(), strict=True))
    assert still["effort mean at rest"] == pytest.approx(effort.mean())
    assert still["tracking trend"] == pytest.approx(tracking[250:].mean() - tracking[:250].mean())
    assert np.isnan(still["effort rms while slewing"])


def test_what_is_shown_stays_few_and_even_however_long_the_batch() -> None:
    kept, rows = Thinned(), np.arange(1_000_003.0)[:, None]
    for start in range(0, len(rows), 7_001):
        kept.add(rows[start : start + 7_001])
    shown = kept.rows()[:, 0]
    assert POINTS < len(shown) <= 4 * POINTS
    assert np.ptp(np.diff(shown)) == 0
    assert shown[0] == 0


def test_the_median_of_fewer_blocks_wanders_more() -> None:
    rng, scatter, whole = np.random.default_rng(4), 0.7, 13
    usual = np.array([0.0, 0.1, 8.0, scatter**2, float(whole)])
    assert _spread(usual, whole, 0.5 * scatter**2) == _spread(usual, 99.0, scatter**2) == pytest.approx(0.1)
    for count in (1, 5):
        medians = np.median(scatter * rng.standard_normal((20_000, count)), axis=1)
        less = np.median(scatter * rng.standard_normal((20_000, whole)), axis=1)
        wander = np.sqrt(0.1**2 + medians.var() - less.var())
        assert _spread(usual, count, np.nan) == pytest.approx(wander, rel=0.05)
    assert _spread(usual[:3], 1.0, 1.0) == pytest.approx(0.1)  # as a baseline was kept before blocks were counted


def test_the_median_of_blocks_that_disagree_is_known_no_better_than_they_agree() -> None:
    rng, usual = np.random.default_rng(5), np.array([0.0, 0.01, 8.0, 0.1**2, 12.0])
    medians = np.median(2.0 * rng.standard_normal((20_000, 12)), axis=1)
    assert _spread(usual, 12.0, 2.0**2) == pytest.approx(medians.std(), rel=0.05)
