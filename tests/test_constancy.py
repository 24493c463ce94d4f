"""A size that differs between slow and fast, early and late, there and back is no constant of what was named."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL

from gsfdi.model import TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import constancy
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.constancy import inconstant
from gsfdi.registry import shelf
from gsfdi.simulate import simulate_record

VISCOUS = TermUse("viscous_friction", {"coefficient_nms_rad": 40.0}, "motor")
NOMINAL = replace(MODEL, physics=(VISCOUS,))
TERMS = shelf("gsfdi.terms", PhysicsTerm)


def told(*physics: TermUse) -> list[str]:
    """Where the viscous friction of the nominal model is another, fitted to a joint of such physics."""
    record = simulate_record(replace(MODEL, physics=physics), seed=3, duration=60.0)
    return [where for _, where in inconstant(opening(bench([record], NOMINAL), NOMINAL, 0.0), 0, TERMS)]


def test_a_constant_is_the_same_in_every_half() -> None:
    assert told(VISCOUS) == []


@pytest.mark.parametrize(
    ("other", "where"),
    [
        (TermUse("viscous_friction", {"coefficient_nms_rad": 6.0}, "motor", 31.0), "in the earlier half"),
        (TermUse("quadratic_friction", {"coefficient_nms2_rad2": 150.0}, "motor"), "where the joint is slow"),
        (
            TermUse("asymmetric_friction", {"difference_nms_rad": 6.0, "difference_nm": 0.0}, "motor"),
            "where it moves back",
        ),
    ],
)
def test_what_stands_for_more_is_another_early_or_slow_or_one_way(other: TermUse, where: str) -> None:
    assert told(VISCOUS, other) == [where]


def test_what_a_half_cannot_tell_from_the_whole_is_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(constancy, "halves", lambda stand: [("", np.ones(sum(len(r.t) for r in stand.records)))])
    monkeypatch.setattr(constancy, "SURE", -1.0)
    monkeypatch.setattr(constancy, "APART", -1.0)
    assert told(VISCOUS) == []
