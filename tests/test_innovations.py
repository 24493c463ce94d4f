"""What the innovations' test takes a fault-free joint's wander to be known from."""

import numpy as np
import pytest

from gsfdi.detectors import innovations
from gsfdi.detectors.innovations import Lean, _as_likely, _freedom, _met
from gsfdi.directions import grouped, library

KIND = np.array([1.0, 1.0, 0.0])
COUNT = len(library(True, True, False))


def test_normal_scores_keep_every_block_and_rare_ones_few() -> None:
    rng = np.random.default_rng(0)
    h = np.ones((60, COUNT))
    noise = rng.standard_normal(h.shape)
    assert (_freedom(noise, h, np.ones(COUNT), KIND, 60.0) == 59.0).all()  # noise alone is known by theory
    assert np.median(_freedom(noise, h, np.full(COUNT, 4.0), KIND, 60.0)) > 40.0
    rare = np.where(rng.random(h.shape) < 0.05, 30.0, 1.0) * noise
    assert np.median(_freedom(rare, h, np.mean(rare**2, axis=0), KIND, 60.0)) < 12.0


def test_blocks_without_the_motion_tell_nothing_of_what_the_model_lacks() -> None:
    rng = np.random.default_rng(2)
    h = np.ones((60, COUNT))
    noise = 2.0 * rng.standard_normal(h.shape)
    everywhere = _freedom(noise, h, np.full(COUNT, 4.0), KIND, 60.0)
    h[6:] = 1e-6
    seldom = _freedom(noise, h, np.full(COUNT, 4.0), KIND, 60.0)
    assert (seldom < 0.3 * everywhere).all()
    assert (_freedom(noise, h, np.ones(COUNT), KIND, 60.0) == 59.0).all()  # noise alone is known by theory


def test_what_one_order_of_a_wave_met_another_may_meet() -> None:
    keys = [one.key for one in library(True, True, False)]
    within = np.ones(COUNT)
    within[keys.index("cogging:12s")] = 400.0
    met = _met(within, np.full(COUNT, 10.0), KIND)
    cogging = np.array([key.startswith("cogging") for key in keys])
    assert (met[cogging] > 100.0).all()
    assert met[keys.index("cogging:12s")] == 400.0
    np.testing.assert_array_equal(met[~cogging], within[~cogging])
    rng = np.random.default_rng(3)
    chance = rng.chisquare(57.0, COUNT) / 57.0
    assert np.median(_met(chance, np.full(COUNT, 57.0), KIND) / chance) == 1.0


def test_a_lean_that_is_known_from_few_blocks_counts_for_less() -> None:
    lean = Lean("cogging:4", 16.0, 12.0, 0.0, 0.0, 1.0, 0, False, (0,))
    learnt = {"blocks": np.array([60.0]), "freedom": np.array([8.0])}
    told = _as_likely(lean, learnt)
    assert 5.0 < told.robust < told.z < 8.0
    assert _as_likely(lean, {**learnt, "freedom": np.array([59.0])}) == lean
    assert _as_likely(lean, {"blocks": np.array([60.0])}) == lean
    strong = _as_likely(lean._replace(z=1e6, robust=1e5), learnt)
    assert strong.z > strong.robust > 15.0
    assert _as_likely(lean._replace(robust=0.0), learnt).robust == pytest.approx(0.0, abs=1e-9)


def test_what_was_fitted_to_the_baseline_is_no_freedom_of_it() -> None:
    def gathered(terms: float) -> list[dict[str, np.ndarray]]:
        rng = np.random.default_rng(1)
        sums = {"g": 4.0 * rng.standard_normal((160, COUNT)), "h": np.ones((160, COUNT)), "x": np.zeros((160, COUNT))}
        about = {"width": np.array([0.25]), "kind": KIND, "terms": np.array([terms])}
        return [{**sums, "energy": np.full((160, 2), 25.0), **about}] * 4

    settings = innovations.DETECTOR.settings
    free, fitted = (innovations.learn(gathered(terms), settings) for terms in (0.0, 8.0))
    assert (free["blocks"], fitted["blocks"]) == (32.0, 24.0)
    lone = [members[0] for _, members in grouped(library(True, True, False)) if len(members) == 1]
    assert fitted["within"][lone] == pytest.approx(free["within"][lone] * 32.0 / 24.0)
    assert (fitted["freedom"] < free["freedom"]).all()
