"""When something set in, found beside moments that are nearly as good."""

from dataclasses import replace

import pytest
from joints import MODEL, ramped

from gsfdi.model import TermUse
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.finalists import settled_onset
from gsfdi.reconcile.hand import settle, with_term
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.reconcile.noise import effort_floor
from gsfdi.simulate import simulate_record


def test_a_spring_gave_way_where_the_gearbox_began_to_ring_not_in_the_rest_after_it() -> None:
    setpoint, onset, rest = ramped(), 38.3, 38.9
    asked = simulate_record(MODEL, duration=0.01 * len(setpoint))
    asked = replace(asked, t=asked.t[: len(setpoint)], channels={"setpoint": setpoint}, valid={})
    spring = TermUse("stiffness_change", {"ratio": 0.72}, None, onset)
    record = simulate_record(replace(MODEL, physics=(spring,)), replay=asked, seed=1)
    hand = opening(bench([record], MODEL), MODEL, 0.0)
    model = with_term(hand.fitted.model, replace(spring, onset=rest))
    floor = effort_floor(hand.stand)
    late = settle(hand.stand, model, [*hand.fitted.knobs, *term_knobs(hand.stand, model, 0)], floor)
    assert settled_onset(late, 0, floor).fitted.model.physics[0].onset == pytest.approx(onset, abs=0.02)
