"""Numbers of the plant that are off: one alone, beside others that are as they should be or nearly so."""

from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL, off, without_speed

from gsfdi.reconcile import entries, reconcile, run
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.entries import APART, UNSEEN_APART
from gsfdi.reconcile.parameters import Lone, lone_changes, shifts
from gsfdi.simulate import simulate_record


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


@pytest.mark.parametrize(("seed", "duration"), [(0, 12.0), (2, 12.0), (0, 20.0)])
def test_the_one_number_is_found_where_neither_speed_nor_law_is_known(seed: int, duration: float) -> None:
    """Fits that began at the nominal value stopped far short, and a stiffness of 1.09 or nothing had the name."""
    record = without_speed(simulate_record(off(motor_inertia=0.9), seed=seed, duration=duration))
    (entry,) = reconcile([record], replace(MODEL, controller=None)).omitted_physics
    assert entry["term"] == "motor_inertia_change"
    assert entry["parameters"]["ratio"]["value"] == pytest.approx(0.9, rel=0.005)


@pytest.mark.parametrize("seen", [True, False])
def test_numbers_are_told_apart_more_readily_where_a_law_and_a_speed_are_known(
    seen: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lone(*args: object) -> list[Lone]:
        return [replace(one, cost=8.0 * place) for place, one in enumerate(lone_changes(*args))]  # type: ignore[arg-type]

    monkeypatch.setattr(entries, "lone_changes", lone)
    record = simulate_record(off(motor_inertia=1.13), seed=1, duration=12.0)
    answer = reconcile([record], MODEL) if seen else reconcile([without_speed(record)], replace(MODEL, controller=None))
    (entry,) = answer.omitted_physics
    assert (len(answer.indistinguishable) == 0) is seen
    odds = [np.exp(-8.0 * place * (1.0 if seen else APART / UNSEEN_APART)) for place in range(4)]
    assert entry["probability"] == pytest.approx(1.0 / sum(odds))


def test_a_number_is_no_surer_than_the_sensor_whose_scale_does_the_same() -> None:
    record = without_speed(simulate_record(off(torque_constant=0.9), seed=1, duration=30.0))
    answer = reconcile([record], replace(MODEL, controller=None))
    (entry,) = answer.omitted_physics
    assert entry["term"] == "torque_constant_change"
    assert entry["probability"] == pytest.approx(1 / 1.6, abs=0.01)  # a scale of the current, and one of the position
    shown = answer.evidence["ranking"][:6]
    assert [row["term"] for row in shown[:3]] == [entry["term"], "current_gain", "position_gain"]
    assert sum(row["probability"] for row in shown) == pytest.approx(1.0)
    assert answer.mismatch["effect"] > 0.5
    assert answer.mismatch["p_value"] < 1e-9


def test_a_number_beside_others_is_as_sure_as_its_interval_is_clear_of_what_may_be() -> None:
    record = simulate_record(off(motor_inertia=1.3, stiffness=1.05), seed=1, duration=30.0)
    moved = {shift.term: shift for shift in shifts(opening(bench([record], MODEL), MODEL, 0.0))}
    assert {shift.is_news for shift in moved.values()} == {True, False}
    for shift in moved.values():
        assert (shift.probability > 0.5) is shift.is_news
        assert (shift.probability > 0.975) is (shift.is_news and shift.is_sure)


@pytest.mark.parametrize(
    ("torque_constant", "cost", "named"), [(0.948, 13.0, True), (0.94, 13.0, True), (0.948, 1e4, False)]
)
def test_one_number_that_leaves_a_trifle_has_its_name(
    torque_constant: float, cost: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """How another simulator steps a joint may cost a number more than 12, where all of them gain thousands."""

    def lone(*args: object) -> list[Lone]:
        first, *others = lone_changes(*args)  # type: ignore[arg-type]
        return [replace(first, cost=cost), *(replace(one, cost=10 * cost) for one in others)]

    monkeypatch.setattr(entries, "lone_changes", lone)
    answer = reconcile([simulate_record(off(torque_constant=torque_constant), seed=1, duration=30.0)], MODEL)
    assert [entry["term"] for entry in answer.omitted_physics] == ["torque_constant_change"] * named
