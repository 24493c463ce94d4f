"""The showcase is the best hidden of the causes that were named right, and is told without a number that is none."""

import json
from types import MappingProxyType

import numpy as np
import pytest

from gsfdi.proof import showcase as told
from gsfdi.reconcile import Reconciliation


def score(tracking: float, effort: float, **other: object) -> dict[str, object]:
    right = {"first_right": True, "extra": [], "kinds": ["backlash"]}
    return {**right, "concealment": {"tracking": tracking, "effort": effort}, **other}


def test_the_best_hidden_of_the_right_ones_is_chosen() -> None:
    scores = {
        "loud": score(0.5, 40.0),
        "hidden": score(-0.002, 30.0),
        "fainter": score(0.0001, 3.0),
        "wrong": score(0.0, 99.0, first_right=False),
        "null": score(0.0, 99.0, first_right=None, kinds=[], concealment=None),
        "more": score(0.0, 99.0, extra=["cogging"]),
    }
    assert told.best_hidden(scores) == "hidden"
    assert told.best_hidden({"wrong": scores["wrong"]}) is None


def test_curves_are_thinned_and_strict() -> None:
    t = np.arange(10_000) * 1e-3
    overlay = told.thinned({"name": "position_rad", "t": t, "recorded": np.where(t < 1, np.nan, t)})
    assert len(overlay["t"]) == len(overlay["recorded"]) <= told.MOST
    assert json.loads(json.dumps(overlay, allow_nan=False))["recorded"][0] is None


def test_the_case_is_told_with_what_the_seal_says(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(100) * 0.01
    evidence = MappingProxyType({"overlays": [{"name": "motor_current_a", "t": t, "recorded": t, "before": t}]})
    answer = Reconciliation("J", "explained", {}, {}, (), (), {}, {}, "It is backlash.", None, evidence)
    monkeypatch.setattr(told, "asked_again", lambda files: answer)
    truth = {"effects": [{"term": "backlash", "parameters": {"half_width_rad": 1e-3}, "onset_s": 4.0}]}
    case = told.showcase({"a": score(0.002, 30.0)}, {"a": truth}, lambda name: {})
    assert case is not None
    assert "0.2 %" in case["says"]
    assert case["truth"] == "backlash, half_width_rad 0.001, from 4.0 s on."
    assert told.showcase({}, {}, lambda name: {}) is None
