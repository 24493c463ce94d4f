"""Who is settled in a contest, each under the noise that suits it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from joints import MODEL

from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import compete, contest
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.compete import PROMISED, least_promise, opening
from gsfdi.reconcile.contest import SETTLED, TRIVIAL, pursued, to_settle
from gsfdi.reconcile.finalists import shows_at_once
from gsfdi.reconcile.offer import Offer
from gsfdi.reconcile.screen import LEAST, Entry
from gsfdi.registry import shelf
from gsfdi.simulate import simulate_record


@pytest.mark.parametrize(("last", "settled"), [(0.997, SETTLED + 1), (0.9, SETTLED)])
def test_none_that_is_level_with_the_best_is_left_out_for_being_the_fifth(last: float, settled: int) -> None:
    terms = shelf("gsfdi.terms", PhysicsTerm)
    gains = [9000.0] * SETTLED + [last * 9000.0]
    entries = [
        Entry(Offer(name, None, ({"size": 1.0},), lambda c: None), None, np.ones(1), gain, gain=gain)
        for name, gain in zip(terms, gains, strict=False)
    ]
    assert to_settle(entries, terms) == entries[:settled]
    assert to_settle([], terms) == []


def test_beside_a_play_a_term_must_be_promised_a_share_of_what_was_gained(monkeypatch: pytest.MonkeyPatch) -> None:
    def having(term: str) -> Any:
        return SimpleNamespace(fitted=SimpleNamespace(model=SimpleNamespace(physics=(TermUse(term, {}),))))

    monkeypatch.setattr(compete, "likelier", lambda new, old: 50_000.0)
    assert least_promise(having("backlash"), having("backlash"), 1.0) == PROMISED * 50_000.0
    assert least_promise(having("cogging"), having("cogging"), 1.0) == 0.0
    assert least_promise(having("cogging"), having("cogging"), 0.5 * TRIVIAL) == LEAST
    monkeypatch.setattr(compete, "likelier", lambda new, old: 0.0)
    assert least_promise(having("backlash"), having("backlash"), 0.5 * TRIVIAL) == LEAST


@pytest.mark.parametrize(
    ("gains", "left_at"), [((0.1, 0.9), "glance"), ((0.2, 0.3), "turn"), ((0.2, 0.6), "round"), ((0.9, 0.9), "round")]
)
def test_a_rival_is_left_where_it_is_far_behind(
    monkeypatch: pytest.MonkeyPatch, gains: tuple[float, float], left_at: str
) -> None:
    of = {"best": 1000.0, "glance": gains[0] * 1000.0, "turn": gains[1] * 1000.0}
    monkeypatch.setattr(contest, "likelier", lambda new, old: of[new])
    monkeypatch.setattr(contest, "at_a_glance", lambda *_: "glance")
    monkeypatch.setattr(contest, "coarse", lambda *_: "turn")
    monkeypatch.setattr(contest, "refined", lambda *_: "round")
    anything: Any = SimpleNamespace(stand=None, model=None, knobs=())
    best: Any = "best"
    assert pursued(anything, anything, best, np.ones(1)) == left_at


def test_the_first_is_settled_whatever_its_first_turn_gains(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contest, "likelier", lambda new, old: -1e5)
    monkeypatch.setattr(contest, "settle", lambda *_: "round")
    anything: Any = SimpleNamespace(stand=None, model=None, knobs=())
    assert pursued(anything, anything, None, np.ones(1)) == "round"


def test_a_step_of_the_position_shows_at_once() -> None:
    stepped = replace(MODEL, physics=(TermUse("position_bias", {"bias_rad": 1e-4}, None, 20.1),))

    def shows(true: JointModel, held: JointModel) -> bool:
        return shows_at_once(opening(bench([simulate_record(true, duration=40.0)], held), held, 0.0))

    assert shows(stepped, stepped)
    assert not shows(MODEL, stepped)
    assert shows(MODEL, replace(MODEL, physics=(TermUse("constant_load", {"torque_nm": 1.0}, "output"),)))
