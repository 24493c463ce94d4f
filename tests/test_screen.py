"""What regression promises each term, before any is fitted."""

import math
from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL

from gsfdi.model import TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.offer import offers
from gsfdi.reconcile.offering import all_offers
from gsfdi.reconcile.screen import best_entry, screen
from gsfdi.registry import shelf
from gsfdi.simulate import simulate_record

LOADS = ("gravity_unbalance", "constant_load")
ROUGH = replace(MODEL, physics=(TermUse("coulomb_friction", {"torque_nm": 5.0}, "motor"),))


@pytest.mark.parametrize("angle", [0.5 * math.pi, -0.5 * math.pi])
def test_a_weight_is_promised_as_much_as_a_load_whichever_way_it_pulls_where_the_joint_sticks(angle: float) -> None:
    weight = TermUse("gravity_unbalance", {"torque_nm": 10.0, "angle_rad": angle})
    record = simulate_record(replace(ROUGH, physics=(*ROUGH.physics, weight)), seed=1, duration=60.0)
    hand = opening(bench([record], ROUGH), ROUGH, 0.0)
    terms = {name: term for name, term in shelf("gsfdi.terms", PhysicsTerm).items() if name in LOADS}
    always = [e for e in screen(hand, all_offers(hand, terms, 1)).entries if e.onset is None]
    found = {entry.offer.term: entry for entry in always}
    assert found["gravity_unbalance"].linear > 0.98 * found["constant_load"].linear
    told = found["gravity_unbalance"].offer.mix(found["gravity_unbalance"].coefficients)
    assert told is not None
    assert math.cos(told["angle_rad"] - angle) > 0.7


def test_a_drag_of_the_temperature_is_promised_where_a_viscous_friction_takes_over_all_but_its_change() -> None:
    """What is left of its two columns is one, either way round; by regression on both it was a drag below nothing."""
    cold = replace(simulate_record(MODEL, duration=20.0), valid={})
    cold = replace(cold, channels={**cold.channels, "temperature": np.linspace(20.0, -10.0, len(cold.t))})
    term = shelf("gsfdi.terms", PhysicsTerm)["temperature_dependent_friction"]
    offer = next(iter(offers(term, bench([cold], MODEL).scales, {})))
    both, beside = np.array([0.5, -0.6]), -0.95
    score = -np.array([[1.0, beside], [beside, 1.0]]) @ both
    assert offer.mix(both) is None
    own = np.array([[[1.0, beside], [1.0, 0.0]]])
    entry = best_entry(offer, slice(0, 2), [None], own, np.zeros((1, 2, 1)), score[None])
    assert entry is not None
    told = offer.mix(entry.coefficients)
    assert told is not None
    assert told["per_degc"] < 0
    assert entry.linear == pytest.approx(0.5 * score[0] ** 2)
