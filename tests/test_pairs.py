"""Two loads that depend on the place: while only one of them is there, it is fitted to the sum of both."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from rigid import WET, swept

from gsfdi.model import TermUse
from gsfdi.reconcile import pairs
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.offer import Offer


@pytest.mark.parametrize(
    "told",
    [
        (
            TermUse("gravity_unbalance", {"torque_nm": 1.39, "angle_rad": 1.81}),
            TermUse("cable_harness", {"stiffness_nm_rad": 2.72, "rest_rad": 0.091}),
        ),
        (
            TermUse("gravity_unbalance", {"torque_nm": 0.6, "angle_rad": 0.96}),
            TermUse("constant_load", {"torque_nm": 0.38}),
        ),
        pytest.param(
            (
                TermUse("cogging", {"amplitude_nm": 0.46, "order": 6.0, "phase_rad": -2.23}),
                TermUse("cable_harness", {"stiffness_nm_rad": 2.88, "rest_rad": -0.014}),
                TermUse("viscous_friction", {"coefficient_nms_rad": 3.19}, onset=21.48),
            ),
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_two_loads_are_not_taken_for_two_others(told: tuple[TermUse, ...]) -> None:
    """They were a larger weight and a wave of order 2, a harness and such a wave, and a weight and two waves."""
    answer = swept(*told, own=(WET,))
    assert answer.verdict == "explained"
    found = {entry["term"]: entry["parameters"] for entry in answer.omitted_physics}
    assert set(found) == {use.term for use in told}
    for use in told:
        for name, value in use.values.items():
            assert found[use.term][name]["value"] == pytest.approx(value, rel=0.03, abs=0.003)


def test_a_harness_and_a_constant_load_are_no_two_loads(monkeypatch: pytest.MonkeyPatch) -> None:
    """A constant load says where a harness rests: both took the place of a wave, with a load nobody put there."""
    offered = [
        Offer(name, "output", ({"size": 1.0},), lambda c: {"size": float(c[0])})
        for name in ("cable_harness", "constant_load")
    ]
    hand = SimpleNamespace(fitted=SimpleNamespace(model=SimpleNamespace(physics=(TermUse("cogging", {}),) * 2)))
    monkeypatch.setattr(pairs, "loads", lambda *_: iter(offered))
    monkeypatch.setattr(pairs, "signatures_of", lambda *_: (np.ones(4), np.eye(4)[:2]))
    assert list(pairs.likeliest_pairs(cast("Round", hand), (0, 1), {})) == []
