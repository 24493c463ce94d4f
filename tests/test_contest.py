"""Who is settled in a contest, each under the noise that suits it."""

from types import SimpleNamespace

import numpy as np
import pytest

from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import compete
from gsfdi.reconcile.compete import SETTLED, to_settle
from gsfdi.reconcile.offer import Offer
from gsfdi.reconcile.screen import Entry
from gsfdi.registry import shelf


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


def round_of(name: str, missing: float) -> SimpleNamespace:
    return SimpleNamespace(name=name, lacks=missing, stand=None)


@pytest.mark.parametrize(("left", "taken"), [(0.01, "without it"), (0.5, "with it")])
def test_all_is_held_without_a_first_winner_that_leads_nowhere(
    left: float, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A gap and a cable together explain what a third of the stiffness, which gains more than either, does not."""
    first = round_of("parameters only", 1.0)
    winner = SimpleNamespace(offer=SimpleNamespace(term="stiffness_change"))
    held: list[set[str]] = []

    def rounds(opened: SimpleNamespace, terms: set[str], *_: int) -> tuple[object, ...]:
        held.append(set(terms))
        with_it = "stiffness_change" in terms
        hand = round_of("with it", 0.8) if with_it else round_of("without it", left)
        return opened, hand, [SimpleNamespace(winner=winner if with_it else None)]

    monkeypatch.setattr(compete, "rounds", rounds)
    monkeypatch.setattr(compete, "effort_floor", lambda stand: 0.0)
    monkeypatch.setattr(compete, "leaves_nothing", lambda hand, floor: False)
    monkeypatch.setattr(compete, "missing", lambda hand, floor: hand.lacks)
    monkeypatch.setattr(compete, "likelier", lambda new, old: 1.0)
    terms = shelf("gsfdi.terms", PhysicsTerm)
    _, hand, _ = compete.other_way(first, terms, 0, 5)  # type: ignore[arg-type]
    assert hand.name == taken  # type: ignore[attr-defined]
    assert held == [set(terms), set(terms) - {"stiffness_change"}]
