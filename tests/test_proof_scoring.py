"""What a right, an equivalent, a silent and a wrong answer score."""

from typing import Any

import pytest

from gsfdi.proof.scoring import score
from gsfdi.proof.summary import calibration, confusion, rate, summarise


def truth(**changed: Any) -> dict[str, Any]:
    effect = {
        "term": "coulomb_friction",
        "component": "friction",
        "family": "physics",
        "variant": 0,
        "side": "motor",
        "parameters": {"torque_nm": 2.0},
        "onset_s": 30.0,
        "equivalents": ["constant_load"],
    }
    base: dict[str, Any] = {
        "group": "single",
        "kinds": ["coulomb_friction"],
        "size": "plain",
        "axis": "rotary",
        "effects": [effect],
        "known": ["viscous_friction"],
        "known_off": ["viscous_friction"],
        "nominal_off": {"torque_constant_change": 1.04, "stiffness_change": 0.97},
        "seconds": 100.0,
        "scales": {"reach": 0.5},
        "oracle": {"motor_current_a": 2e-4},
        "concealment": {"visible": 500.0, "tracking": 0.001, "effort": 5.0, "windup": 1.0},
    }
    return base | changed


def reply(*named: str, verdict: str = "explained", **changed: Any) -> dict[str, Any]:
    parameters = {"torque_nm": {"value": 2.0 / 1.04, "ci95": [1.8, 2.0]}}
    joint = {
        "verdict": verdict,
        "location": {"component": "friction", "when": [{"from_s": 31.0, "to_s": 100.0}]},
        "omitted_physics": [{"term": term, "parameters": parameters} for term in named],
        "indistinguishable": [["coulomb_friction", "presliding_friction"]],
        "fit": {"before": {"motor_current_a": 1e-2}, "after": {"motor_current_a": 3e-4}},
    }
    return {"answer": {"joints": [joint | changed]}, "seconds": 1.0, "trespasses": []}


def test_the_right_name_scores_everywhere() -> None:
    one = score(truth(), reply("coulomb_friction"))
    assert one["first_right"]
    assert one["covered"]
    assert one["located"]
    assert one["onset_right"]
    assert one["extra"] == []
    assert one["set_size"] == 2
    assert one["fit"]["motor_current_a"]["after"] == 3e-4


def test_torque_is_compared_in_what_can_be_identified() -> None:
    """The nominal torque constant is 4 % low, so that a perfect fit reads 4 % low as well."""
    (parameter,) = score(truth(), reply("coulomb_friction"))["parameters"]
    assert parameter["error"] == pytest.approx(0.0, abs=1e-12)
    assert parameter["covered"]


def test_numbers_that_really_are_off_are_set_aside() -> None:
    one = score(truth(), reply("stiffness_change", "viscous_friction", "coulomb_friction"))
    assert one["named"] == ["coulomb_friction"]
    assert one["first_right"]


def test_a_number_that_is_right_counts_as_a_discovery() -> None:
    one = score(truth(), reply("output_inertia_change", "coulomb_friction"))
    assert not one["first_right"]
    assert one["covered"]
    assert one["extra"] == ["output_inertia_change"]


def test_an_equivalent_covers_but_is_not_right() -> None:
    one = score(truth(), reply("constant_load"))
    assert not one["first_right"]
    assert one["first_equivalent"]
    assert one["covered"]


def test_a_neighbour_in_the_stated_set_covers() -> None:
    one = score(truth(), reply("presliding_friction"))
    assert not one["first_right"]
    assert one["covered"]


def test_a_name_for_nothing_is_a_false_discovery() -> None:
    null = truth(group="null", kinds=[], effects=[])
    rows = [score(null, reply("cogging")), score(null, reply("stiffness_change")), score(null, reply())]
    assert summarise(rows)["false_discovery_in_nulls"]["hits"] == 1
    assert confusion(rows)["(nothing)"]["cogging"] == 1


def test_probabilities_are_held_against_what_came_true() -> None:
    said = [("coulomb_friction", 0.95), ("cogging", 0.45), ("coulomb_friction", 1.0), ("cogging", 0.4)]
    rows = [score(truth(), reply(omitted_physics=[{"term": term, "probability": p}])) for term, p in said]
    low, high, sure = calibration(rows)
    assert (low["from"], low["to"], low["hits"], low["of"]) == (0.0, 0.5, 0, 2)
    assert low["said"] == pytest.approx(0.425)
    assert (high["said"], high["hits"], high["of"]) == (0.95, 1, 1)
    assert (sure["to"], sure["rate"]) == (1.0, 1.0)
    assert calibration([score(truth(), {"answer": None, "seconds": 1.0, "trespasses": []})]) == []
    assert calibration([score(truth(group="unknown"), reply("cogging"))]) == []


def test_strangers_want_to_be_admitted() -> None:
    stranger = truth(group="unknown", kinds=["gear_creep"])
    rows = [score(stranger, reply(verdict="unexplained")), score(stranger, reply("cogging"))]
    assert [row["puzzled"] for row in rows] == [True, False]
    assert summarise(rows)["unknown_physics_admitted"]["rate"] == 0.5


def test_what_nobody_can_see_may_be_left_unsaid() -> None:
    faint = truth(concealment={"visible": 3.0, "tracking": 0.0, "effort": 0.01, "windup": 0.0})
    one = score(faint, reply(verdict="no_mismatch"))
    assert not one["visible"]
    figures = summarise([one])
    assert figures["below_detection_silent_or_right"]["rate"] == 1.0
    assert figures["first_name_right"]["of"] == 0


def test_no_answer_and_a_trespass_are_wrong() -> None:
    lost = {"answer": None, "seconds": 180.0, "trespasses": []}
    assert score(truth(), lost)["first_right"] is False
    stolen = score(truth(), reply("coulomb_friction") | {"trespasses": ["open seal.json"]})
    assert stolen["first_right"] is False
    assert stolen["trespassed"]


def test_an_exact_interval() -> None:
    assert rate(1, 100)["ci95"] == pytest.approx([0.000253, 0.0545], abs=1e-4)
    assert rate(0, 0)["rate"] is None
