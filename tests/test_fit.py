"""Fits by replay, on misfits so plain that everything is known of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from rigid import JOINT

from gsfdi.fit import Knob, covariance, levenberg, slopes
from gsfdi.model import JointModel
from gsfdi.types import Array

INERTIA, CONSTANT = JOINT.plant.output_inertia, JOINT.plant.torque_constant
ROWS = np.random.default_rng(0).standard_normal((400, 2))
NOISE = np.random.default_rng(1).standard_normal(400)


def bent(models: Sequence[JointModel]) -> Array:
    """Misfit that bends with the inertia and is a straight line in the torque constant."""
    off = [(m.plant.output_inertia / INERTIA - 1, m.plant.torque_constant / CONSTANT - 1) for m in models]
    return np.array([NOISE + ROWS[:, 0] * (a + 5 * a * a) + ROWS[:, 1] * b for a, b in off])


def knobs(**ends: float) -> list[Knob]:
    inertia = Knob(-1, "output_inertia", 0.03 * INERTIA, 0.2 * INERTIA, 5 * INERTIA)
    return [replace(inertia, **ends), Knob(-1, "torque_constant", 0.03 * CONSTANT, 0.2 * CONSTANT, 5 * CONSTANT)]


def test_slopes_from_both_sides_do_not_feel_a_bend() -> None:
    found = slopes(bent, JOINT, knobs(), np.array([INERTIA, CONSTANT]), bent([JOINT])[0])
    np.testing.assert_allclose(found, 0.03 * ROWS, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("end", ["low", "high"])
def test_a_knob_at_its_end_is_turned_the_other_way(end: str) -> None:
    seen: list[float] = []

    def watched(models: Sequence[JointModel]) -> Array:
        seen.extend(m.plant.output_inertia for m in models)
        return bent(models)

    found = slopes(watched, JOINT, knobs(**{end: INERTIA}), np.array([INERTIA, CONSTANT]), bent([JOINT])[0])
    assert min(seen) >= INERTIA if end == "low" else max(seen) <= INERTIA
    np.testing.assert_allclose(found, 0.03 * ROWS, rtol=0.05, atol=1e-12)


def test_a_knob_that_is_held_has_no_slope() -> None:
    found = slopes(bent, JOINT, knobs(low=INERTIA, high=INERTIA), np.array([INERTIA, CONSTANT]), bent([JOINT])[0])
    np.testing.assert_allclose(found, 0.03 * ROWS * [0, 1], rtol=1e-9, atol=1e-12)


def test_the_covariance_of_white_innovations_is_that_of_least_squares() -> None:
    fitted = levenberg(bent, JOINT, knobs()[1:], 8)
    spread = covariance(fitted, np.arange(400) // 4)
    assert np.sqrt(spread[0, 0]) == pytest.approx(CONSTANT / np.linalg.norm(ROWS[:, 1]), rel=0.2)


def test_a_fit_whose_slopes_run_away_stays_where_it_was() -> None:
    def runs_away(models: Sequence[JointModel]) -> Array:
        return np.array([NOISE if m == JOINT else np.full(400, 1e200) for m in models])

    fitted = levenberg(runs_away, JOINT, knobs())
    np.testing.assert_array_equal(fitted.values, [INERTIA, CONSTANT])
    assert fitted.cost == pytest.approx(0.5 * NOISE @ NOISE)


def test_a_fit_whose_step_leads_over_a_cliff_goes_half_way_to_its_end() -> None:
    def cliff(models: Sequence[JointModel]) -> Array:
        off = np.array([m.plant.output_inertia / INERTIA for m in models])
        return np.array([[1e9 if x < 0.3 else np.tanh(8 * (x - 0.35))] * 400 for x in off])

    fitted = levenberg(cliff, JOINT, [Knob(-1, "output_inertia", 0.7 * INERTIA, 0.05 * INERTIA, 2 * INERTIA)])
    assert fitted.values[0] == pytest.approx(0.35 * INERTIA, rel=1e-3)


def test_slopes_that_were_kept_too_long_are_taken_anew() -> None:
    def curved(models: Sequence[JointModel]) -> Array:
        off = [(m.plant.output_inertia / INERTIA - 1.5, m.plant.torque_constant / CONSTANT - 1) for m in models]
        return np.array([NOISE + 100 * (ROWS[:, 0] * np.expm1(-6 * a) + ROWS[:, 1] * (b + 3 * a * a)) for a, b in off])

    inertia, constant = knobs()
    fitted = levenberg(curved, JOINT, [inertia, replace(constant, prior=CONSTANT, doubt=1e-3 * CONSTANT)], 12)
    assert fitted.values[0] == pytest.approx(1.5 * INERTIA, rel=1e-3)
