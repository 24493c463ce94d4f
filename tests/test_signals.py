import numpy as np
import pytest

from gsfdi.detectors.signals import FEATURES, POINTS, Thinned, _features


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
