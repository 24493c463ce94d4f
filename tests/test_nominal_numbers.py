"""Numbers of the plant that are off: one alone, beside others that are as they should be or nearly so."""

from dataclasses import replace

import pytest
from joints import MODEL

from gsfdi.model import JointModel
from gsfdi.reconcile import entries, reconcile, run
from gsfdi.simulate import simulate_record


def off(**ratios: float) -> JointModel:
    """Give the joint with numbers of its plant off by these ratios."""
    return replace(
        MODEL, plant=replace(MODEL.plant, **{name: r * getattr(MODEL.plant, name) for name, r in ratios.items()})
    )


@pytest.mark.parametrize(
    "beside", [{}, {"torque_constant": 1.004, "stiffness": 0.994}], ids=["others exact", "others nearly so"]
)
def test_one_number_that_is_off_is_named_alone_and_is_all_that_the_updated_model_moves(
    beside: dict[str, float],
) -> None:
    true = off(motor_inertia=0.88, **beside)
    answer = reconcile([simulate_record(true, seed=3, duration=60.0)], MODEL)
    assert [entry["term"] for entry in answer.omitted_physics] == ["motor_inertia_change"]
    assert answer.parameters.keys() == {"motor_inertia_change"}
    assert answer.updated_model is not None
    for name in ("motor_inertia", "torque_constant", "stiffness", "output_inertia"):
        assert getattr(answer.updated_model.plant, name) == pytest.approx(getattr(true.plant, name), rel=0.015)


@pytest.mark.parametrize(("left", "named"), [(0.03, True), (0.3, False)])
def test_a_number_that_is_nearly_all_has_its_name_although_nothing_else_has(
    left: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "verdict_of", lambda *args: "unexplained")
    monkeypatch.setattr(entries, "left_over", lambda *args: left)
    answer = reconcile([simulate_record(off(motor_inertia=0.88), seed=3, duration=30.0)], MODEL)
    assert answer.verdict == ("partly_explained" if named else "unexplained")
    assert [entry["term"] for entry in answer.omitted_physics] == ["motor_inertia_change"] * named
    assert (answer.updated_model is not None) is named
    assert ("3 % of the held-out misfit remains" in answer.says) is named
