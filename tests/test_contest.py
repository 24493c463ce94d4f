"""Who is settled in a contest, each under the noise that suits it."""

import numpy as np
import pytest

from gsfdi.motion import PhysicsTerm
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
