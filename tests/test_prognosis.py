from datetime import date

import numpy as np
import pytest

from gsfdi.prognosis import SCHEMA, due, forecast, row
from gsfdi.types import Finding


def history(shares: np.ndarray, errors: float = 0.004, key: str = "torque_constant_change") -> list[dict[str, object]]:
    return [
        {"schema": SCHEMA, "when": 86400.0 * (20_000 + k), "level": "normal", "fault": None,
         "shares": {key: [float(value), errors], "coulomb_friction:motor": [0.0, 0.01]}}
        for k, value in enumerate(shares)
    ]  # fmt: skip


def test_a_steady_loss_is_dated() -> None:
    rng = np.random.default_rng(0)
    nights = np.arange(20)
    values = -0.005 * np.maximum(nights - 5, 0) + 0.003 * rng.standard_normal(20)
    found = due(history(values), None, 0.3)
    truth = date(1970, 1, 1).toordinal() + 20_000 + 5 + 60
    assert found.when is not None
    assert found.interval90 is not None
    low, high = (date.fromisoformat(one).toordinal() for one in found.interval90)
    assert low <= truth <= high
    assert abs(date.fromisoformat(found.when).toordinal() - truth) < 25
    assert "torque constant" in found.reason


def test_no_trend_no_date() -> None:
    rng = np.random.default_rng(1)
    found = due(history(0.004 * rng.standard_normal(30)), None, 0.3)
    assert (found.when, found.interval90) == (None, None)


def test_a_short_history_says_so() -> None:
    assert "too short" in due(history(np.zeros(2)), None, 0.3).reason


def test_rows_of_another_make_are_left_out() -> None:
    assert "too short" in due([{"schema": "other"} for _ in range(9)], None, 0.3).reason


@pytest.mark.parametrize("power", [1, 2])
def test_the_interval_covers_what_it_promises(power: int) -> None:
    rng, inside, told = np.random.default_rng(2), 0, 0
    for _ in range(40):
        nights, onset = np.arange(20.0), rng.uniform(0, 8)
        rate = rng.uniform(0.003, 0.006) if power == 1 else rng.uniform(3e-4, 6e-4)
        values = rate * np.maximum(nights - onset, 0) ** power + 0.004 * rng.standard_normal(20)
        found = forecast(nights, values, np.full(20, 0.004), 0.3)
        assert found is not None
        if found.clarity > 16:
            told += 1
            inside += found.low <= onset + (0.3 / rate) ** (1 / power) - nights[-1] <= found.high
    assert told > 30
    assert inside / told >= 0.8


def test_a_limit_already_reached_is_due_now() -> None:
    found = forecast(np.arange(12.0), 0.05 * np.arange(12.0), np.full(12, 0.003), 0.3)
    assert found is not None
    assert found.high == 0.0


def test_a_row_keeps_what_the_innovations_say() -> None:
    evidence = {"names": ["a", "b"], "share": np.array([0.1, np.inf]), "share_error": np.array([0.01, 1.0])}
    finding = Finding("innovations", "parity", "J", False, 1.0, 0.0, 1.0, "", "", None, evidence)
    assert row([finding], 5.0, "normal", None)["shares"] == {"a": [0.1, 0.01]}
    assert row([], 5.0, "not_assessed", None)["shares"] == {}
