"""Reconciling recordings that the simulator made: the engine on its own ground, where every number is known."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from joints import MODEL, along_ramps, ramped, torn, without_speed
from rigid import JOINT as NOMINAL

from gsfdi.fit import Knob
from gsfdi.model import Controller, JointModel, Sensors, TermUse
from gsfdi.modelfile import dump, load_models
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile import Reconciliation, reconcile, signs, twin, verdict
from gsfdi.reconcile.bench import HOLD_OUT, bench
from gsfdi.reconcile.calibrate import bar, inflations
from gsfdi.reconcile.clean import learn_law
from gsfdi.reconcile.compete import is_dated, is_over, opening
from gsfdi.reconcile.contest import Contest, to_settle
from gsfdi.reconcile.dating import dated, middle, moments_of
from gsfdi.reconcile.driving import levels
from gsfdi.reconcile.entries import ranked
from gsfdi.reconcile.finalists import FINALISTS, finalists_of, is_at_bound, never_slips
from gsfdi.reconcile.gaps import at_corners, at_jolts, stretches
from gsfdi.reconcile.hand import Round, settle, with_term
from gsfdi.reconcile.judge import Name, Rival, alike, contest_of, is_nothing
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.reconcile.lagging import beside_positions, kinematic_lag
from gsfdi.reconcile.law import check_law, densest, is_missed, is_no_plateau, is_pinned, plainest
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.offer import SHARE, Offer, offers
from gsfdi.reconcile.offering import FEWEST, MATERIAL, share_to_try
from gsfdi.reconcile.screen import Entry, matched
from gsfdi.reconcile.sensing import noise_of
from gsfdi.reconcile.sheet import Held, LawFinding, Log, sheet_of
from gsfdi.reconcile.signs import (
    gives_by_speed,
    is_far,
    is_in_pieces,
    is_series,
    never_ends,
    never_levels,
    sets_in_anew,
    strained,
    sways,
)
from gsfdi.reconcile.simpler import fewer
from gsfdi.reconcile.trifles import is_void, least_share
from gsfdi.reconcile.turning import DOUBT, spread_of
from gsfdi.reconcile.window import dating_window, typical_window
from gsfdi.registry import shelf
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord

COULOMB = (TermUse("coulomb_friction", {"torque_nm": 0.4}),)


def recorded(model: JointModel, seed: int = 1) -> JointRecord:
    return simulate_record(model, seed=seed, duration=30.0)


def told(*terms: TermUse, nominal: JointModel = NOMINAL, seed: int = 1) -> Reconciliation:
    return reconcile([recorded(replace(NOMINAL, physics=terms), seed)], nominal)


def test_nothing_is_found_where_nothing_is_missing() -> None:
    answer = told()
    assert answer.verdict == "no_mismatch"
    assert answer.omitted_physics == ()


def test_nothing_smaller_than_could_be_seen_is_named_and_what_is_far_larger_is() -> None:
    least = {item["term"]: item["parameters"] for item in told().mismatch["smallest_seen"]}
    for term in ("coulomb_friction", "viscous_friction"):
        ((name, value),) = least[term].items()
        assert [e["term"] for e in told(TermUse(term, {name: 30 * value})).omitted_physics] == [term]
        assert told(TermUse(term, {name: 0.5 * value})).omitted_physics == ()


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_joint_that_stands_still_tells_nothing(noise: float) -> None:
    record = recorded(NOMINAL)
    rng = np.random.default_rng(0)
    level = {"setpoint": 0.3, "position": 0.3}
    width = {"position": 1e-5, "joint_velocity": 1e-3, "drive_torque": 0.01}
    channels = {
        name: level.get(name, 0.0) + noise * width.get(name, 0.0) * rng.standard_normal(len(record.t))
        for name in record.channels
    }
    answer = reconcile([replace(record, channels=channels)], NOMINAL)
    assert answer.verdict == "not_enough_data"
    assert answer.updated_model is None


def test_a_joint_that_once_slips_by_a_step_of_its_sensor_stands_still() -> None:
    record = recorded(NOMINAL)
    place = np.where(np.arange(len(record.t)) < 700, 0.3, 0.3001)
    rng = np.random.default_rng(0)
    channels = {"position": place, "drive_torque": 0.3 + 0.05 * rng.standard_normal(len(record.t))}
    bare = replace(NOMINAL, controller=None, sensors=Sensors())
    answer = reconcile([replace(record, channels=channels, valid={})], bare)
    assert answer.verdict == "not_enough_data"


@pytest.mark.parametrize("count", [3, 5, 8, 20])
@pytest.mark.parametrize("sensors", [NOMINAL.sensors, Sensors()])
def test_a_few_samples_tell_nothing(count: int, sensors: Sensors) -> None:
    record = recorded(NOMINAL)
    channels = {name: record[name][:count] for name in record.channels}
    answer = reconcile(
        [replace(record, t=record.t[:count], channels=channels, valid={})], replace(NOMINAL, sensors=sensors)
    )
    assert answer.verdict == "not_enough_data"


def test_friction_is_named_measured_and_written_back() -> None:
    answer = told(TermUse("coulomb_friction", {"torque_nm": 0.4}))
    assert answer.verdict == "explained"
    (entry,) = answer.omitted_physics
    assert entry["term"] == "coulomb_friction"
    low, high = entry["parameters"]["torque_nm"]["ci95"]
    assert low < 0.4 < high
    assert entry["parameters"]["torque_nm"]["value"] == pytest.approx(0.4, rel=0.02)
    assert answer.fit["after"]["drive_torque_nm"] < 0.3 * answer.fit["before"]["drive_torque_nm"]
    assert answer.updated_model is not None
    assert [use.term for use in answer.updated_model.physics] == ["coulomb_friction"]


def test_a_number_that_is_off_is_no_physics() -> None:
    heavy = replace(NOMINAL, plant=replace(NOMINAL.plant, output_inertia=2.4))
    answer = reconcile([recorded(heavy)], NOMINAL)
    assert {entry["term"] for entry in answer.omitted_physics} == {"output_inertia_change"}


def test_a_wrong_gain_is_the_controllers() -> None:
    law = NOMINAL.controller
    assert law is not None
    answer = reconcile([recorded(replace(NOMINAL, controller=replace(law, proportional=240.0)))], NOMINAL)
    assert answer.location["component"] == "controller"
    assert answer.omitted_physics[0]["parameters"]["ratio"]["value"] == pytest.approx(1.2, rel=0.01)


def test_a_law_that_a_recording_without_noise_holds_to_the_last_digit_lacks_nothing() -> None:
    silent = replace(NOMINAL, sensors=Sensors(), controller=replace(NOMINAL.controller, integral=0.0))
    check = check_law([recorded(silent)], silent)
    assert check is not None
    assert (check.before, check.findings) == (0.0, ())


def test_what_is_sure_of_a_law_is_found_however_little_of_the_misfit_it_is() -> None:
    off = replace(MODEL.controller, proportional=0.9985 * MODEL.controller.proportional)
    check = check_law([simulate_record(replace(MODEL, controller=off), duration=180.0)], MODEL)
    assert check is not None
    (finding,) = check.findings
    assert finding.term == "controller_proportional"
    assert finding.values["ratio"] == pytest.approx(0.9985, abs=3 * finding.spread)
    assert finding.share < 0.05


def test_a_current_that_is_off_by_less_than_a_tick_does_is_named_where_the_law_leaves_no_more() -> None:
    scaled = replace(MODEL, physics=(TermUse("current_gain", {"ratio": 0.9976}),))
    (entry,) = reconcile([simulate_record(scaled, seed=3, duration=60.0)], MODEL).omitted_physics
    assert entry["term"] == "current_gain"
    low, high = entry["parameters"]["ratio"]["ci95"]
    assert low < 0.9976 < high < 1.0


def test_the_same_recording_gives_the_same_answer() -> None:
    record = recorded(replace(NOMINAL, physics=(TermUse("viscous_friction", {"coefficient_nms_rad": 0.5}),)))
    first, second = (reconcile([record], NOMINAL).to_json() for _ in range(2))
    np.testing.assert_equal(first, second)


def test_two_effects_at_once_are_both_named_and_nothing_besides() -> None:
    both = (TermUse("coulomb_friction", {"torque_nm": 0.4}), TermUse("cogging", COGGING))
    answer = reconcile([simulate_record(replace(NOMINAL, physics=both), seed=1, duration=45.0)], NOMINAL)
    assert {entry["term"] for entry in answer.omitted_physics} == {"coulomb_friction", "cogging"}


@pytest.mark.thorough
def test_a_second_effect_is_named_beside_one_that_is_a_hundred_times_as_large() -> None:
    both = (
        TermUse("constant_load", {"torque_nm": 4.5}, "output"),
        TermUse("gearbox_damping", {"coefficient_nms_rad": 900.0}),
    )
    answer = reconcile([simulate_record(replace(MODEL, physics=both), seed=1, duration=60.0)], MODEL)
    assert {entry["term"] for entry in answer.omitted_physics} == {"constant_load", "gearbox_damping"}


@pytest.mark.parametrize("order", [43.3, 81.7, 333.3, 1111.1])
def test_a_wave_along_a_travel_is_found_whatever_its_pitch(order: float) -> None:
    slide = replace(NOMINAL, axis="linear")
    wave = TermUse("cogging", {"amplitude_nm": 0.3, "order": order, "phase_rad": 0.7})
    answer = reconcile([simulate_record(replace(slide, physics=(wave,)), seed=1, duration=30.0)], slide)
    (entry,) = answer.omitted_physics
    assert entry["term"] == "cogging"
    assert entry["parameters"]["order"]["value"] == pytest.approx(order, abs=0.05)


def entered(term: str, onset: float | None, linear: float) -> Entry:
    """One that regression promises so much."""
    return Entry(Offer(term, None, ({"torque_nm": 1.0},), lambda c: None), onset, np.ones(1), linear)


def test_a_term_from_the_start_competes_wherever_it_may_set_in() -> None:
    others = [entered(f"term_{i}", None, 50.0 - i) for i in range(FINALISTS - 1)]
    later, always, last = (
        entered("constant_load", 3.0, 30.0),
        entered("constant_load", None, 2.0),
        entered("x", None, 1.0),
    )
    competing = [(entry.offer.term, entry.onset) for entry in finalists_of([*others, later, always, last])]
    assert competing[-2:] == [("constant_load", None), ("constant_load", 3.0)]
    assert len(competing) == FINALISTS + 1


def test_what_is_there_from_the_start_is_settled_beside_all_that_sets_in() -> None:
    late = [entered(term, 20.0, gain) for gain, term in enumerate(("cogging", "coulomb_friction", "constant_load"))]
    late += [entered("cable_harness", 20.0, 9.0), entered("end_stop", None, 1.0), entered("stiffening", None, 0.5)]
    settled = to_settle(late, shelf("gsfdi.terms", PhysicsTerm))
    assert [entry.offer.term for entry in settled][3:] == ["cable_harness", "end_stop"]


@pytest.mark.parametrize(
    ("use", "lever", "void"),
    [
        (TermUse("velocity_gain", {"ratio": 0.99997}), 0.0, True),
        (TermUse("velocity_gain", {"ratio": 1.0002}), 0.0, False),
        (TermUse("position_gain", {"ratio": 1.0001}), 0.1, True),
        (TermUse("position_gain", {"ratio": 1.0003}), 0.1, False),
        (TermUse("coulomb_friction", {"torque_nm": 5e-5}), 0.0, True),
        (TermUse("coulomb_friction", {"torque_nm": 5e-4}), 0.0, False),
        (TermUse("position_bias", {"bias_rad": 1e-9}), 0.0, False),
        (TermUse("current_limit", {"limit_a": 0.0}), 0.0, False),  # none is no limit
    ],
)
def test_what_has_no_size_is_no_name(use: TermUse, lever: float, void: bool) -> None:
    hand = SimpleNamespace(stand=SimpleNamespace(scales=SimpleNamespace(torque=10.0), lever=lever))
    assert is_void(hand, use, shelf("gsfdi.terms", PhysicsTerm)) is void  # type: ignore[arg-type]


@pytest.mark.parametrize(("count", "order", "series"), [(3, 2.97, True), (3, 2.99, False), (2, 2.97, False)])
def test_many_like_waves_at_the_end_of_what_they_may_be_draw_a_curve(count: int, order: float, series: bool) -> None:
    waves = [SimpleNamespace(term="cogging")] * count
    knobs = [Knob(i, "order", 0.01, 2.97, 3.03) for i in range(count)]
    fitted = SimpleNamespace(knobs=knobs, values=[3.0] * (count - 1) + [order], model=SimpleNamespace(physics=waves))
    found = [SimpleNamespace(use=wave) for wave in waves]
    case = SimpleNamespace(found=found, hand=SimpleNamespace(fitted=fitted))
    assert is_series(case) is series  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([1.08, 0.92], ["motor_inertia_change", "stiffness_change"]),
        ([1.08, 0.93], []),
    ],
)
def test_numbers_that_went_as_far_as_they_are_believed_are_told(values: list[float], said: list[str]) -> None:
    knobs = [Knob(-1, name, 0.03, 0.92, 1.08, 1.0, 0.03) for name in ("motor_inertia", "stiffness")]
    held = Knob(-1, "output_inertia", 0.03, 1.0, 1.0, 1.0, 0.03)  # by a term that changes it
    fitted = SimpleNamespace(knobs=[*knobs, held], values=[*values, 1.0])
    case = SimpleNamespace(hand=SimpleNamespace(fitted=fitted))
    assert strained(case) == said  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("term", "name", "value", "far"),
    [
        ("gearbox_hysteresis", "torque_nm", 60.0, True),
        ("gearbox_hysteresis", "torque_nm", 59.0, False),
        ("gearbox_hysteresis", "torque_nm", 0.0, False),
        ("stribeck_friction", "velocity_rad_s", 60.0, True),
        ("stribeck_friction", "velocity_rad_s", 0.0, False),
        ("cogging", "order", 60.0, True),
        ("cogging", "order", 59.0, False),
        ("cogging", "amplitude_nm", 0.0, False),
    ],
)
def test_what_goes_as_far_as_it_may_stands_for_something_else(term: str, name: str, value: float, far: bool) -> None:
    fitted = SimpleNamespace(
        knobs=[Knob(-1, "stiffness", 1.0, 0.0, 60.0), Knob(0, name, 1.0, 0.0, 60.0)],
        values=[60.0, value],
        model=SimpleNamespace(physics=[TermUse(term, {name: value})]),
    )
    settled = SimpleNamespace(model=SimpleNamespace(physics=()))
    case = SimpleNamespace(
        hand=SimpleNamespace(fitted=fitted),
        settled=settled,
        terms=shelf("gsfdi.terms", PhysicsTerm),
        stand=SimpleNamespace(scales=bench([recorded(NOMINAL)], NOMINAL).scales),
    )
    assert is_far(case) is far  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("widths", "low", "high", "unseen"),
    [(0.3, 0.0, 20.0, False), (2.1, 8.5, 11.5, False), (1.9, 0.0, 20.0, False), (2.1, 6.0, 14.0, True)],
)
def test_a_wide_loop_of_unknown_height_is_no_whole_answer(widths: float, low: float, high: float, unseen: bool) -> None:
    scales = bench([recorded(NOMINAL)], NOMINAL).scales
    for term, said in (("gearbox_hysteresis", unseen), ("presliding_friction", False)):
        use = TermUse(term, {"torque_nm": 10.0, "width_rad": widths * scales.windup})
        found = [Name(use, 1.0, 1.0, {"torque_nm": (low, high)}, ())]
        assert never_levels(SimpleNamespace(found=found, stand=SimpleNamespace(scales=scales))) is said  # type: ignore[arg-type]


def test_a_bristle_that_never_lets_go_is_a_spring() -> None:
    scales = bench([recorded(NOMINAL)], NOMINAL).scales
    for reaches, springs in ((0.1, False), (1.9, False), (2.1, True)):
        torque = 10.0 * scales.reach * reaches
        use = TermUse("presliding_friction", {"torque_nm": torque, "stiffness_nm_rad": 10.0})
        assert never_slips(use, scales) is springs
    assert not never_slips(TermUse("coulomb_friction", {"torque_nm": 1e9}), scales)


@pytest.mark.parametrize(
    ("won", "ended", "named", "says"),
    [
        (5, False, ("stiffness_change", "coulomb_friction"), True),
        (5, True, ("stiffness_change", "coulomb_friction"), False),  # chance explained what was left
        (4, False, ("stiffness_change", "coulomb_friction"), False),
        (5, False, ("cogging", "coulomb_friction", "gravity_unbalance", "cable_harness"), False),
        (5, False, ("backlash",), False),  # its flanks are made in many ways
    ],
)
def test_winners_that_are_worth_no_name_and_no_end_of_them_are_pieces_of_another(
    won: int, ended: bool, named: tuple[str, ...], says: bool
) -> None:
    contests = [SimpleNamespace(winner=object())] * won + [SimpleNamespace(winner=None)] * ended
    case = SimpleNamespace(found=[SimpleNamespace(use=TermUse(term)) for term in named], contests=contests)
    assert never_ends(case) is says  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("won", "named", "says"),
    [
        (("gearbox_hysteresis", "gearbox_damping"), ("gearbox_hysteresis",), True),
        (("gearbox_hysteresis", "gearbox_damping"), ("gearbox_hysteresis", "gearbox_damping"), False),
        (("gearbox_hysteresis", "encoder_eccentricity"), ("gearbox_hysteresis",), False),
        (("stiffness_change", "gearbox_damping"), ("stiffness_change",), False),
    ],
)
def test_a_loop_that_speed_widens_is_no_hysteresis(won: tuple[str, ...], named: tuple[str, ...], says: bool) -> None:
    winners = [SimpleNamespace(offer=TermUse(term)) for term in won]
    contests = [SimpleNamespace(winner=winner) for winner in (*winners, None)]
    case = SimpleNamespace(found=[SimpleNamespace(use=TermUse(term)) for term in named], contests=contests)
    assert gives_by_speed(case) is says  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("onsets", "anew"),
    [
        ({"coulomb_friction": [66.0], "cogging": [66.2, None]}, False),
        ({"coulomb_friction": [66.0], "cogging": [81.4]}, True),
        ({"position_dependent_friction": [66.0, 66.2]}, True),
    ],
)
def test_what_sets_in_again_and_again_is_pieces_of_another(onsets: dict[str, list[float | None]], anew: bool) -> None:
    uses = [TermUse(term, onset=onset) for term, begun in onsets.items() for onset in begun]
    case = SimpleNamespace(
        found=[SimpleNamespace(use=use) for use in uses],
        stand=SimpleNamespace(scales=SimpleNamespace(seconds=180.0)),
    )
    assert sets_in_anew(case) is anew  # type: ignore[arg-type]


@pytest.mark.parametrize(("speed", "torque", "pieces"), [(0.068, 3.3, True), (0.072, 3.3, False), (0.068, 0.3, False)])
def test_two_laws_of_one_speed_and_one_torque_are_pieces_of_another(speed: float, torque: float, pieces: bool) -> None:
    uses = [
        TermUse("shear_thinning_friction", {"torque_nm": 3.31, "velocity_rad_s": 0.0681}),
        TermUse("stribeck_friction", {"excess_nm": torque, "velocity_rad_s": speed}),
        TermUse("viscous_friction", {"coefficient_nms_rad": 1.0}),
    ]
    assert is_in_pieces(SimpleNamespace(found=[SimpleNamespace(use=use) for use in uses])) is pieces  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("term", "by_twin", "held_out", "expected"),
    [
        ("position_bias", 0.0, 1.0, "explained"),
        ("cogging", 0.0, 1.0, "unexplained"),
        ("cogging", 0.0, 0.3, "partly_explained"),
        ("cogging", 0.0045, 1.0, "explained"),
    ],
)
def test_a_torque_explains_where_a_twin_leaves_as_much_or_held_out_data_say_so(
    term: str, by_twin: float, held_out: float, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verdict, "left_by_twin", lambda *args: by_twin)
    monkeypatch.setattr(verdict, "left_over", lambda *args: held_out)
    monkeypatch.setattr(verdict, "strays", lambda *args, **kwargs: False)
    monkeypatch.setattr(signs, "inconstant", lambda *args: [])
    use = TermUse(term, {})
    fitted = SimpleNamespace(knobs=[], values=[], model=SimpleNamespace(physics=[use]))
    stand = SimpleNamespace(scales=SimpleNamespace(torque=10.0, seconds=60.0, period=0.01))
    case = SimpleNamespace(
        found=[SimpleNamespace(use=use)],
        contests=[SimpleNamespace(winner=None)],
        hand=SimpleNamespace(fitted=fitted, torque=np.array([0.05, 0.0])),
        floor=np.array([0.01, 0.0]),
        settled=SimpleNamespace(model=SimpleNamespace(physics=())),
        terms=shelf("gsfdi.terms", PhysicsTerm),
        stand=stand,
        logged=stand,
        refitted=None,
        updated=None,
    )
    assert verdict.verdict_of(case, [{"term": term}], 0.7) == expected  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("left", "torque", "by_twin", "held_out", "hopeless"),
    [
        (0.9, 0.2, 0.0, 0.9, True),
        (0.7, 0.2, 0.0, 0.9, False),
        (0.9, 0.2, 0.0, 0.7, False),
        (0.9, 0.2, 0.018, 0.9, False),
        (0.9, 0.02, 0.0, 0.9, False),
    ],
)
def test_what_leaves_nearly_all_of_a_mismatch_is_going_to_be_no_name(
    left: float, torque: float, by_twin: float, held_out: float, hopeless: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verdict, "left_by_twin", lambda *args: by_twin)
    monkeypatch.setattr(verdict, "left_over", lambda *args: held_out)
    stand = SimpleNamespace(scales=SimpleNamespace(torque=10.0, seconds=60.0, period=0.01))
    fitted = SimpleNamespace(knobs=[], values=[], model=NOMINAL)
    case = SimpleNamespace(
        hand=SimpleNamespace(fitted=fitted, torque=np.array([torque, 0.0])), floor=np.array([0.01, 0.0]),
        stand=stand, logged=stand, refitted=None, updated=None, settled=None,
    )  # fmt: skip
    assert verdict.is_hopeless(case, left) is hopeless  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("won", "terms", "left", "unsaid", "over"),
    [
        (1, ("cogging",), (1.0,), 1.0, False),
        (2, ("cogging", "cable_harness"), (0.95,), 0.98, True),
        (2, ("cogging", "position_bias"), (0.95,), 0.98, False),  # what is seen wrongly is no torque
        (2, ("cogging", "cable_harness"), (0.8,), 0.98, False),
        (2, ("cogging", "cable_harness"), (0.95,), 0.2, False),
        (3, ("cogging", "cable_harness", "viscous_friction"), (0.3,), 0.2, True),
        (3, ("cogging", "cable_harness", "viscous_friction"), (0.1,), 0.2, False),
        (3, ("cogging", "cable_harness", "viscous_friction"), (1.0, 0.15, 0.15, 0.15), 0.2, True),
        (3, ("cogging", "cable_harness", "viscous_friction"), (1.0, 0.18, 0.18, 0.15), 0.2, False),
        (3, ("cogging", "cable_harness", "viscous_friction"), (1.0, 0.05, 0.05, 0.05), 0.2, False),
        (5, ("cogging",), (0.0,), 0.0, True),
    ],
)
def test_a_competition_is_over_where_its_winners_explain_little(
    won: int, terms: tuple[str, ...], left: tuple[float, ...], unsaid: float, over: bool
) -> None:
    assert is_over(won, [TermUse(term) for term in terms], left, unsaid) is over


@pytest.mark.parametrize("stiffness", [0.0, 1.0])
def test_a_like_of_one_term_may_make_another_needless(stiffness: float) -> None:
    load, cable = TermUse("constant_load", {"torque_nm": 1.0}), {"stiffness_nm_rad": stiffness, "rest_rad": 0.0}
    weight = TermUse("gravity_unbalance", {"torque_nm": 1.0, "angle_rad": -0.5 * np.pi})
    true = (load, TermUse("cable_harness", cable)) if stiffness else (load,)
    stand = bench([recorded(replace(NOMINAL, physics=true))], NOMINAL)
    first = opening(stand, NOMINAL, 0.0)

    def fitted(*uses: TermUse) -> Round:
        model = with_term(with_term(first.fitted.model, uses[0]), uses[1])
        knobs = [*first.fitted.knobs, *term_knobs(stand, model, 0), *term_knobs(stand, model, 1)]
        return settle(stand, model, knobs, effort_floor(stand))

    spring = TermUse("cable_harness", {"stiffness_nm_rad": 0.1 + stiffness, "rest_rad": 0.0})
    hand, like = fitted(spring, weight), fitted(spring, load)
    less = fewer(hand, 0, [[hand.fitted], [like.fitted]])
    assert (less is None) is (stiffness > 0.0)
    assert less is None or [use.term for use in less.model.physics] == ["constant_load"]


def test_a_lubricant_that_yields_shapes_the_friction_that_is_there() -> None:
    known = (
        TermUse("coulomb_friction", {"torque_nm": 0.2}),
        TermUse("viscous_friction", {"coefficient_nms_rad": 0.2}),
    )
    film = TermUse("shear_thinning_friction", {"torque_nm": 0.3, "velocity_rad_s": 0.006})
    answer = told(*known, film, nominal=replace(NOMINAL, physics=known))
    assert [entry["term"] for entry in answer.omitted_physics] == ["shear_thinning_friction"]
    numbers = answer.omitted_physics[0]["parameters"]
    assert numbers["torque_nm"]["value"] == pytest.approx(0.3, rel=0.02)
    assert numbers["velocity_rad_s"]["value"] == pytest.approx(0.006, rel=0.02)


def test_a_mixture_of_two_frictions_is_no_third() -> None:
    both = (
        TermUse("coulomb_friction", {"torque_nm": 0.4}),
        TermUse("viscous_friction", {"coefficient_nms_rad": 0.3}),
    )
    assert {e["term"] for e in told(*both).omitted_physics} == {"coulomb_friction", "viscous_friction"}


COGGING = {"amplitude_nm": 0.2, "order": 40.0, "phase_rad": 0.3}


def test_what_sets_in_is_dated() -> None:
    answer = told(TermUse("constant_load", {"torque_nm": 0.1}, None, 14.0))
    assert answer.location["when"][0]["from_s"] == pytest.approx(14.0, abs=0.2)


def test_an_onset_that_was_only_fitted_beside_a_rival_is_moved_to_its_sample() -> None:
    load = TermUse("constant_load", {"torque_nm": 2.0}, onset=52.347)
    stand = bench([simulate_record(replace(NOMINAL, physics=(load,)), seed=1, duration=120.0)], NOMINAL)
    first = opening(stand, NOMINAL, 0.0)
    model = with_term(first.fitted.model, replace(load, onset=52.38))
    knobs = [*first.fitted.knobs, *term_knobs(stand, model, 0)]
    onset = dated(settle(stand, model, knobs, effort_floor(stand)), 0).fitted.model.physics[0].onset
    assert onset == pytest.approx(52.347, abs=0.01)


def test_only_what_accounts_for_most_is_worth_another_part_for_judging() -> None:
    usual = replace(NOMINAL, physics=(TermUse("viscous_friction", {"coefficient_nms_rad": 2.0}),))
    load = TermUse("constant_load", {"torque_nm": 2.0}, onset=14.0)
    for true, dates in ((with_term(usual, load), True), (usual, False)):
        stand = bench([recorded(true)], NOMINAL)
        first = opening(stand, NOMINAL, 0.0)
        model = with_term(with_term(first.fitted.model, usual.physics[0]), load)
        knobs = [*first.fitted.knobs, *term_knobs(stand, model, 0), *term_knobs(stand, model, 1)]
        assert is_dated(settle(stand, model, knobs, effort_floor(stand)), 0, effort_floor(stand)) is dates


@pytest.mark.parametrize(
    ("onsets", "moments"), [([], 0), ([None, 3.0], 1), ([3.0, 5.9], 1), ([3.0, 5.0, 7.0], 2), ([90.0, 30.0, 60.0], 3)]
)
def test_moments_count_where_they_are_apart(onsets: list[float | None], moments: int) -> None:
    assert moments_of([TermUse("constant_load", onset=onset) for onset in onsets], 100.0) == moments


def test_a_step_of_the_position_sensor_is_found_where_it_is() -> None:
    answer = told(TermUse("position_bias", {"bias_rad": 5e-4}, None, 12.0))
    (entry,) = answer.omitted_physics
    assert (entry["term"], entry["component"]) == ("position_bias", "sensor")
    assert entry["onset_s"] == pytest.approx(12.0, abs=0.1)
    assert entry["parameters"]["bias_rad"]["value"] == pytest.approx(5e-4, rel=0.05)


def test_a_step_is_matched_however_late_and_only_where_it_is_alone() -> None:
    rng = np.random.default_rng(4)
    shape, noise = 3.0 * 0.8 ** np.arange(500.0), 0.1 * rng.standard_normal(1000)
    late = noise.copy()
    late[940:] += 2.0 * shape[:60]
    found = matched(late, shape, 1, 1000)
    assert found is not None
    assert found[0] == 940
    assert found[1] == pytest.approx(2.0, rel=0.05)
    late[200:700] += 2.0 * shape
    assert matched(late, shape, 1, 1000) is None


def test_no_part_is_kept_for_judging_in_which_something_seems_to_set_in() -> None:
    stand = bench([recorded(NOMINAL)], NOMINAL)
    load = TermUse("constant_load", {"torque_nm": 0.1})
    assert dating_window(stand, [load, replace(load, onset=0.4 * stand.scales.seconds)]) == stand.window
    low, high = dating_window(stand, [replace(load, onset=0.71 * stand.scales.seconds)])
    assert not low < 0.71 < high


def test_an_onset_that_may_be_anywhere_in_a_rest_is_put_into_its_middle() -> None:
    bare = replace(NOMINAL, physics=(TermUse("viscous_friction", {"coefficient_nms_rad": 1.0}, None, 10.5),))

    def misfit(models: list[JointModel]) -> np.ndarray:
        onsets = np.array([model.physics[0].onset for model in models], dtype=np.float64)
        return 10.0 * np.maximum(np.abs(onsets - 14.0) - 4.0, 0.0)[:, None]

    hand = SimpleNamespace(
        misfit=misfit, fitted=SimpleNamespace(model=bare), stand=SimpleNamespace(scales=SimpleNamespace(seconds=60.0))
    )
    assert middle(hand, 0, 10.5) == pytest.approx(14.0, abs=0.5)  # type: ignore[arg-type]


def test_a_current_bias_is_dated_although_the_recording_has_a_gap() -> None:
    whole = recorded(replace(NOMINAL, physics=(TermUse("current_bias", {"bias_a": 0.05}, None, 9.0),)))
    found = check_law(bench([torn(whole, 14.0, 20.0)], NOMINAL).records, NOMINAL)
    assert found is not None
    (bias,) = found.findings
    assert bias.term == "current_bias"
    assert bias.onset == pytest.approx(9.0, abs=0.05)
    assert bias.values["bias_a"] == pytest.approx(0.05, rel=0.05)


def test_a_current_bias_is_sized_by_the_samples_that_the_law_can_be_held_to() -> None:
    biased = replace(MODEL, physics=(TermUse("current_bias", {"bias_a": 1e-3}, None, 25.0),))
    found = check_law(bench([along_ramps(biased, seed=1)], MODEL).records, MODEL)  # at corners nobody knows the rate
    assert found is not None
    (bias,) = found.findings
    assert bias.values["bias_a"] == pytest.approx(1e-3, rel=0.03)
    assert bias.onset == pytest.approx(25.0, abs=0.3)


def test_terms_are_tried_at_the_size_of_what_is_missing() -> None:
    hand = opening(bench([recorded(NOMINAL)], NOMINAL), NOMINAL, 0.0)
    drive = hand.stand.scales.torque
    shares = [share_to_try(replace(hand, torque=np.array([share * drive]))) for share in (0.0, 0.01, 0.02, 10.0)]
    assert shares[0] == FEWEST * MATERIAL
    assert shares[2] == pytest.approx(2 * shares[1])
    assert shares[3] == SHARE


def test_a_recording_with_a_gap_begins_anew_with_a_level_of_its_own() -> None:
    whole = recorded(NOMINAL)
    split = torn(whole, 14.0, 20.0)
    first, later = levels(bench([split], NOMINAL))
    assert first.onset is None
    assert later.onset == pytest.approx(20.0, abs=0.02)
    assert len(levels(bench([whole, whole], NOMINAL))) == 1
    assert reconcile([split], NOMINAL).verdict == "no_mismatch"


def test_a_setpoint_has_corners_where_its_acceleration_jumps() -> None:
    t = 0.01 * np.arange(1000)
    assert not at_corners(np.sin(t), t).any()
    speed = np.clip(t - 2.0, 0.0, 1.0)
    corners = np.flatnonzero(at_corners(0.01 * np.cumsum(speed), t))
    assert {200, 300} <= set(corners.tolist())
    assert len(corners) < 16
    assert {200, 300} <= set(np.flatnonzero(at_jolts(0.01 * np.cumsum(speed), t)).tolist())


def test_a_setpoint_that_ramps_its_acceleration_has_corners_and_no_jolts() -> None:
    ramps = ramped()
    assert np.mean(at_corners(ramps, 0.01 * np.arange(len(ramps)))) > 0.2
    assert np.mean(at_jolts(ramps, 0.01 * np.arange(len(ramps)))) < 0.01


def test_what_the_library_lacks_is_not_explained_away() -> None:
    answer = reconcile(
        [recorded(replace(NOMINAL, physics=(TermUse("cogging", COGGING),)))], NOMINAL, without=["cogging"]
    )
    assert answer.verdict in ("unexplained", "partly_explained")


def test_a_term_that_was_offered_and_never_refitted_is_held_against_the_others() -> None:
    contests = [Contest((entered(term, None, 5.0),), None, 1) for term in ("cogging", "constant_load")]
    assert contest_of(TermUse("constant_load", {"torque_nm": 1.0}), contests) is contests[1]
    assert contest_of(TermUse("backlash", {"half_width_rad": 1e-4}), contests) is None


def test_twins_are_listed_as_twins() -> None:
    answer = told(TermUse("velocity_gain", {"ratio": 1.02}))
    assert any({"position_gain", "velocity_gain"} <= set(group) for group in answer.indistinguishable)


def test_a_limit_is_found_although_the_integral_goes_on_at_it() -> None:
    free = recorded(NOMINAL)
    limit = 0.6 * float(np.max(np.abs(free["drive_torque"])))
    answer = told(TermUse("current_limit", {"limit_a": limit}))
    entry = answer.omitted_physics[0]
    assert entry["term"] == "current_limit"
    assert entry["parameters"]["limit_a"]["value"] == pytest.approx(limit, rel=0.01)


@pytest.mark.parametrize("windup", ["goes_on", "unwinds"])
def test_a_limit_is_told_with_what_the_integral_does_at_it(windup: str) -> None:
    assert MODEL.controller is not None
    nominal = replace(MODEL, controller=replace(MODEL.controller, integral=20.0))
    limit = 0.7 * float(np.max(np.abs(simulate_record(nominal, seed=1, duration=30.0)["motor_current"])))
    drive = replace(nominal, physics=(TermUse("current_limit", {"limit_a": limit}),))
    law = replace(MODEL, controller=replace(MODEL.controller, integral=20.0, limit=limit))
    limited = drive if windup == "goes_on" else law
    record = simulate_record(limited, seed=1, duration=30.0)
    found, again = check_law([record], nominal), check_law([record], limited)
    assert found is not None
    assert [(f.term, f.windup) for f in found.findings] == [("current_limit", windup)]
    assert found.findings[0].values["limit_a"] == pytest.approx(limit, rel=1e-3)
    assert found.after < 1.05 * MODEL.sensors.effort_noise
    assert again is not None
    assert again.findings == ()


def test_efforts_at_a_limit_are_told_from_those_below_it() -> None:
    rng = np.random.default_rng(4)
    values = np.concatenate([1.0 + 1e-3 * rng.standard_normal(200), rng.uniform(0.7, 1.0, 180)])
    assert densest(values) == pytest.approx(1.0, abs=3e-4)
    assert np.median(values) < 0.999


def test_efforts_are_at_no_limit_where_they_lie_elsewhere() -> None:
    assert not is_no_plateau(np.full(5, 0.98), 1.0, 0.01)
    assert is_no_plateau(np.full(5, 0.25), 1.0, 0.2)
    assert is_no_plateau(np.array([0.0, 0.5, 1.0]), 1.0, 0.5)  # noise so large tells no plateau
    peaks = np.linspace(1.0, 1.1, 30)
    assert is_no_plateau(peaks, 1.0, 0.1, 0.002)
    assert not is_no_plateau(peaks, 1.0, 0.1, 0.03)
    assert not is_no_plateau(peaks, 1.0, 0.1)  # nothing is said of the sensor


@pytest.mark.parametrize(("gain", "believed"), [(12.0, True), (225.0, False), (1457.0, False)])
def test_a_limit_beside_an_unseen_speed_is_likelier_than_a_bias_that_sets_in(gain: float, believed: bool) -> None:
    limit = LawFinding("current_limit", {"limit_a": 1.6}, None, 231.0, 0.06, 1e-3)
    step = LawFinding("current_bias", {"bias_a": 0.1}, 7.0, gain, 0.3, 1e-3)
    assert plainest([limit, step]) == [limit] * believed


def test_a_limit_that_explains_little_is_believed_where_efforts_are_pinned_to_it() -> None:
    limit = LawFinding("current_limit", {"limit_a": 1.6}, None, 547.0, 0.05, 1e-3, "goes_on")
    assert plainest([limit]) == []
    assert plainest([limit], [limit]) == [limit]


@pytest.mark.parametrize("share", [0.8, 2.0])
def test_efforts_are_pinned_to_a_limit_that_is_met_and_not_to_the_tops_of_peaks(share: float) -> None:
    assert MODEL.controller is not None
    highest = float(np.max(np.abs(simulate_record(MODEL, seed=1, duration=30.0)["motor_current"])))
    drive = replace(MODEL, physics=(TermUse("current_limit", {"limit_a": share * highest}),))
    record = without_speed(simulate_record(drive, seed=1, duration=30.0))
    top = LawFinding("current_limit", {"limit_a": min(share, 1.0) * highest}, None, 547.0, 0.05, 1e-3)
    assert is_pinned(Held(Log([record], MODEL), MODEL.controller), top) == (share < 1.0)


def lossy(whole: JointRecord) -> JointRecord:
    """Give a record without one sample in 25, nor the setpoint's rate."""
    keep = np.random.default_rng(3).random(len(whole.t)) > 0.04
    channels = {name: whole[name][keep] for name in whole.channels if name != "setpoint_rate"}
    return replace(whole, t=whole.t[keep], channels=channels, valid={})


def test_no_law_is_held_against_the_slope_of_a_setpoint_beside_lost_samples() -> None:
    found = check_law(bench([lossy(recorded(NOMINAL))], NOMINAL).records, NOMINAL)
    assert found is not None
    assert found.findings == ()
    assert found.after < 1.1 * NOMINAL.sensors.effort_noise


def test_the_integral_sweeps_a_lost_error_between_its_neighbours() -> None:
    t, law = np.arange(500) / 100.0, NOMINAL.controller
    assert law is not None
    channels = {"setpoint": 0.5 * t**2, "position": 0.5 * t**2 - 1e-3, NOMINAL.effort: np.sin(t)}
    (stretch,) = stretches(lossy(JointRecord("arm", "J", 0, t, channels)), 0.01, 1.0)
    sheet = sheet_of(stretch, NOMINAL, law)
    assert sheet is not None
    assert np.ptp(sheet.parts["integral"]) == pytest.approx(law.integral * 1e-3 * np.ptp(sheet.t), rel=1e-6)


def test_a_limit_at_which_the_integral_waits_once_is_no_bias() -> None:
    """What is left of an integral that waits asks for no more than the limit."""
    law = NOMINAL.controller
    assert law is not None
    sensors = replace(NOMINAL.sensors, effort_noise=1e-4)
    nominal = replace(NOMINAL, controller=replace(law, integral=400.0), sensors=sensors)
    limit = 0.999 * float(np.max(np.abs(simulate_record(nominal, seed=3, duration=30.0)["drive_torque"])))
    limited = replace(nominal, controller=replace(law, integral=400.0, limit=limit))
    found = check_law([simulate_record(limited, seed=3, duration=30.0)], nominal)
    assert found is not None
    assert [f.term for f in found.findings] == ["current_limit"]
    assert found.findings[0].values["limit_a"] == pytest.approx(limit, rel=2e-3)


def test_efforts_that_noise_lifts_are_at_no_limit() -> None:
    friction = TermUse("coulomb_friction", {"torque_nm": 2.0, "smooth_rad_s": 2e-4})
    sound = replace(NOMINAL, physics=(friction,), sensors=replace(NOMINAL.sensors, effort_noise=0.03))
    found = check_law([simulate_record(sound, seed=918, duration=49.0)], sound)
    assert found is not None
    assert found.findings == ()


@pytest.mark.parametrize("share", [0.6, 0.75])
def test_a_limit_is_found_to_the_sample_beside_lost_samples(share: float) -> None:
    limit = share * float(np.max(np.abs(recorded(NOMINAL)["drive_torque"])))
    held = replace(NOMINAL, physics=(TermUse("current_limit", {"limit_a": limit}),))
    record = recorded(held)
    keep = np.random.default_rng(3).random(len(record.t)) > 0.04
    channels = {name: record[name][keep] for name in record.channels}
    found = check_law(bench([replace(record, t=record.t[keep], channels=channels, valid={})], NOMINAL).records, NOMINAL)
    assert found is not None
    assert [f.term for f in found.findings] == ["current_limit"]
    assert found.findings[0].values["limit_a"] == pytest.approx(limit, abs=NOMINAL.sensors.effort_noise)
    assert found.after < 1.05 * NOMINAL.sensors.effort_noise


def test_a_limit_that_the_law_states_is_nothing_new() -> None:
    limit = 0.6 * float(np.max(np.abs(recorded(NOMINAL)["drive_torque"])))
    assert NOMINAL.controller is not None
    stated = replace(NOMINAL, controller=replace(NOMINAL.controller, limit=limit))
    found = check_law(bench([recorded(stated)], stated).records, stated)
    assert found is not None
    assert found.findings == ()
    assert found.after < 1.05 * NOMINAL.sensors.effort_noise


def test_a_law_is_learnt_beside_lost_samples() -> None:
    unknown, law = replace(NOMINAL, controller=None), NOMINAL.controller
    learnt = learn_law(bench([lossy(recorded(NOMINAL))], unknown).records, unknown)
    assert law is not None
    assert learnt is not None
    assert (learnt.proportional, learnt.derivative) == pytest.approx((law.proportional, law.derivative), rel=0.03)


def test_the_age_of_a_speed_that_is_not_logged_is_read_off_the_law() -> None:
    law = NOMINAL.controller
    assert law is not None
    record = recorded(replace(NOMINAL, controller=replace(law, derivative_delay=0.01), sensors=Sensors()))
    found = check_law([without_speed(record)], replace(NOMINAL, sensors=Sensors()))
    assert found is not None
    assert found.derivative_delay == pytest.approx(0.01)


QUIET = replace(NOMINAL, sensors=Sensors(position_noise=1e-6, motor_velocity_noise=1e-5, effort_noise=1e-3))


def unseen(model: JointModel) -> JointRecord:
    """Record `model` without any speed."""
    return without_speed(recorded(model))


@pytest.mark.parametrize("name", ["proportional", "integral", "derivative"])
def test_a_wrong_gain_is_found_although_no_speed_is_logged(name: str) -> None:
    law = QUIET.controller
    assert law is not None
    other = replace(QUIET, controller=replace(law, **{name: 0.9 * getattr(law, name)}))
    found = check_law([unseen(other)], QUIET)
    assert found is not None
    assert [finding.term for finding in found.findings] == [f"controller_{name}"]
    assert found.findings[0].values["ratio"] == pytest.approx(0.9, rel=0.01)


@pytest.mark.parametrize(
    ("term", "value"),
    [("position_gain", {"ratio": 1.02}), ("timestamp_latency", {"delay_s": 0.002}), ("current_gain", {"ratio": 1.05})],
)
def test_a_faulty_sensor_is_found_although_no_speed_is_logged(term: str, value: dict[str, float]) -> None:
    found = check_law([unseen(replace(QUIET, physics=(TermUse(term, value),)))], QUIET)
    assert found is not None
    assert [finding.term for finding in found.findings] == [term]
    assert dict(found.findings[0].values) == pytest.approx(value, rel=0.1)


def test_a_setpoint_that_stands_while_the_joint_is_pushed_blames_no_law() -> None:
    record = unseen(QUIET)
    law = QUIET.controller
    assert law is not None
    still = np.full(len(record.t), 0.3)
    pushed = 0.3 + 0.01 * np.sin(record.t)
    asked = law.proportional * (still - pushed) - law.derivative * 0.01 * np.cos(record.t)
    asked += law.integral * 0.01 * (np.cos(record.t) - 1)
    channels = {"setpoint": still, "setpoint_rate": 0 * still, "position": pushed, "drive_torque": asked}
    found = check_law([replace(record, channels=channels)], QUIET)
    assert found is not None
    assert found.findings == ()


def test_stamps_that_are_late_by_a_hundredth_of_a_tick_are_found() -> None:
    found = check_law([recorded(replace(QUIET, physics=(TermUse("timestamp_latency", {"delay_s": 1e-4}),)))], QUIET)
    assert found is not None
    (finding,) = found.findings
    assert finding.values["delay_s"] == pytest.approx(1e-4, rel=0.1)
    assert abs(finding.values["delay_s"] - 1e-4) < 3 * finding.spread < 5e-5


@pytest.mark.parametrize("lag", [0.0, 0.001, 0.02])
def test_way_and_speed_tell_a_lag_whatever_the_speeds_scale(lag: float) -> None:
    uses = (TermUse("velocity_lag", {"lag_s": lag}), TermUse("velocity_gain", {"ratio": 1.03}))
    shown, spread = kinematic_lag([recorded(replace(QUIET, physics=uses))], QUIET)
    assert shown == pytest.approx(lag, abs=max(4 * spread, 0.04 * lag))
    assert spread < 1e-4


@pytest.mark.parametrize("lag", [0.0, 0.02])
def test_a_lag_that_the_positions_show_competes_whatever_regression_promises(lag: float) -> None:
    record = recorded(replace(QUIET, physics=(TermUse("velocity_lag", {"lag_s": lag}),)))
    stand = SimpleNamespace(records=[record], model=QUIET)
    (offer, *_) = offers(shelf("gsfdi.terms", PhysicsTerm)["velocity_lag"], bench([record], QUIET).scales, {})
    hardly = Entry(offer, None, np.array([0.1]), 1.0)
    found = beside_positions([replace(hardly, onset=5.0), hardly], stand)  # type: ignore[arg-type]
    shown = [(entry.onset, entry.offer.mix(entry.coefficients)) for entry in found]
    assert shown == ([(None, {"lag_s": pytest.approx(lag, rel=0.04)})] if lag else [])
    assert beside_positions([], stand) == []  # type: ignore[arg-type]


@pytest.mark.parametrize("factor", [0.103, 0.12, 8.0])  # at a tenth the loop rings for ever
def test_a_payload_is_named_however_large(factor: float) -> None:
    loaded = replace(NOMINAL, plant=replace(NOMINAL.plant, output_inertia=factor * NOMINAL.plant.output_inertia))
    (entry,) = reconcile([recorded(loaded)], NOMINAL).omitted_physics
    assert entry["term"] == "output_inertia_change"
    assert entry["parameters"]["ratio"]["value"] == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(
    ("use", "name", "value", "ended"),
    [
        (TermUse("load_dependent_friction", {"ratio": 0.5}), "ratio", 0.5, True),
        (TermUse("load_dependent_friction", {"ratio": 0.5}), "ratio", 0.49, False),
        (TermUse("load_dependent_friction", {"ratio": 0.5}), "ratio", 0.0, False),
        (TermUse("gearbox_hysteresis", {"torque_nm": 1.0, "width_rad": 0.5}), "width_rad", 0.5, True),
        (TermUse("gearbox_hysteresis", {"torque_nm": 1.0, "width_rad": 0.5}), "width_rad", 0.0, False),
        (TermUse("position_dependent_friction", {"torque_nm": 1.0, "width_rad": 0.5}), "width_rad", 0.5, True),
        (TermUse("position_dependent_friction", {"torque_nm": 1.0, "width_rad": 0.5}), "width_rad", 0.0, True),
        (TermUse("position_dependent_friction", {"torque_nm": 1.0, "width_rad": 0.5}), "width_rad", 0.2, False),
        (TermUse("presliding_friction", {"torque_nm": 1.0, "stiffness_nm_rad": 0.5}), "stiffness_nm_rad", 0.0, True),
        (TermUse("structural_mode", {"inertia_kg_m2": 1.0, "damping_ratio": 0.5}), "damping_ratio", 0.5, True),
        (TermUse("structural_mode", {"inertia_kg_m2": 1.0, "frequency_hz": 0.5}), "frequency_hz", 0.5, True),
        (TermUse("structural_mode", {"inertia_kg_m2": 1.0, "frequency_hz": 0.5}), "frequency_hz", 0.4, False),
    ],
)
def test_what_would_have_to_be_more_than_is_plausible_or_would_never_slip_is_no_name(
    use: TermUse, name: str, value: float, ended: bool
) -> None:
    knob = Knob(0, name, 0.1, 0.0, 0.5)
    fitted = SimpleNamespace(model=replace(NOMINAL, physics=(use,)), knobs=(knob,), values=np.array([value]))
    assert is_at_bound(fitted, shelf("gsfdi.terms", PhysicsTerm)) is ended  # type: ignore[arg-type]


@pytest.mark.parametrize("ticks", [0.4, 1.0, 2.5])
def test_late_stamps_are_found_in_noise(ticks: float) -> None:
    found = check_law(
        [recorded(replace(NOMINAL, physics=(TermUse("timestamp_latency", {"delay_s": ticks / 100}),)))], NOMINAL
    )
    assert found is not None
    (finding,) = found.findings
    assert finding.term == "timestamp_latency"
    assert finding.values["delay_s"] == pytest.approx(ticks / 100, rel=0.25)


@pytest.mark.parametrize(
    "use",
    [
        TermUse("gravity_unbalance", {"torque_nm": 3.0, "angle_rad": 0.3}),
        TermUse("coulomb_friction", {"torque_nm": 0.4}),
        TermUse("structural_mode", {"inertia_kg_m2": 0.3, "frequency_hz": 3.0, "damping_ratio": 0.02}),
    ],
    ids=lambda use: use.term,
)
def test_physics_is_no_wrong_law_where_no_speed_is_logged(use: TermUse) -> None:
    found = check_law([unseen(replace(QUIET, physics=(use,)))], QUIET)
    assert found is not None
    assert found.findings == ()


@pytest.mark.parametrize("nominal", [QUIET, replace(QUIET, controller=None)], ids=["law", "no law"])
def test_a_speed_that_lags_blames_no_law(nominal: JointModel) -> None:
    record = recorded(replace(QUIET, physics=(TermUse("velocity_lag", {"lag_s": 0.004}),)))
    (entry,) = reconcile([record], nominal).omitted_physics
    assert entry["term"] == "velocity_lag"
    low, high = entry["parameters"]["lag_s"]["ci95"]
    assert low < 0.004 < high
    assert high - low < 0.002


def test_noise_is_that_of_the_sensor_however_unevenly_it_is_sampled() -> None:
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.choice([0.010, 0.012], 4000))
    assert noise_of(t, np.sin(3 * t) + 1e-5 * rng.standard_normal(4000)) == pytest.approx(1e-5, rel=0.1)


def test_the_scale_of_torque_is_known_from_the_model_alone() -> None:
    plant = replace(NOMINAL.plant, torque_constant=0.5)
    joint = replace(NOMINAL, plant=plant, effort="motor_current", controller=None)
    truth = replace(joint, controller=Controller(400.0, 200.0, 80.0, 100.0), physics=COULOMB)
    hand = opening(bench([recorded(truth)], replace(joint, physics=COULOMB)), replace(joint, physics=COULOMB), 0.0)
    knobs = {knob.name: i for i, knob in enumerate(hand.fitted.knobs)}
    spread = np.sqrt(np.diag(spread_of(hand.fitted, hand.stand.blocks()))) / np.abs(hand.fitted.values)
    # three numbers scale together, each believed to within DOUBT
    assert spread[knobs["output_inertia"]] == pytest.approx(DOUBT / 3**0.5, rel=0.05)
    assert spread[knobs["torque_nm"]] == pytest.approx(DOUBT / 3**0.5, rel=0.05)


def test_a_slight_term_mends_the_law_of_a_weightier_one() -> None:
    shelf_terms = shelf("gsfdi.terms", PhysicsTerm)
    stribeck = TermUse("stribeck_friction", {"excess_nm": 1.0, "velocity_rad_s": 0.01})
    viscous = TermUse("viscous_friction", {"coefficient_nms_rad": 2.0})
    less = TermUse("viscous_friction", {"coefficient_nms_rad": -2.0})
    cogging = TermUse("cogging", {"amplitude_nm": 1.0, "order": 6.0, "phase_rad": 0.0})
    least = [least_share(1, [(stribeck, 0.99), (use, 0.01)], shelf_terms) for use in (cogging, viscous, less)]
    assert 0.0 < least[0] < 0.01 < least[1] < least[2]
    backlash = TermUse("backlash", {"half_width_rad": 1e-4})
    assert least[0] < least_share(1, [(backlash, 0.99), (stribeck, 0.01)], shelf_terms) < least[1]
    assert least_share(0, [(stribeck, 0.99), (viscous, 0.01)], shelf_terms) == 0.0
    one_way = TermUse("asymmetric_friction", {"difference_nm": 1.0, "difference_nms_rad": 0.0})
    assert least_share(1, [(stribeck, 0.99), (one_way, 0.01)], shelf_terms) == 0.0
    lag, inertia = TermUse("velocity_lag", {"lag_s": 0.01}), TermUse("motor_inertia_change", {"ratio": 1.85})
    assert least_share(1, [(lag, 0.994), (inertia, 0.006)], shelf_terms) > 0.006
    assert least_share(1, [(viscous, 0.994), (inertia, 0.006)], shelf_terms) == 0.0


def test_a_bristle_that_bends_within_a_sample_is_dry_friction() -> None:
    stand = SimpleNamespace(scales=SimpleNamespace(torque=10.0, reach=1.0, speed=0.1, period=0.01))
    dry = TermUse("coulomb_friction", {"torque_nm": 1.0})
    stiff, soft = (
        TermUse("presliding_friction", {"torque_nm": 1.0, "stiffness_nm_rad": stiffness}) for stiffness in (2e4, 5e3)
    )
    assert alike(SimpleNamespace(stand=stand), dry, stiff)  # type: ignore[arg-type]
    assert not alike(SimpleNamespace(stand=stand), dry, soft)  # type: ignore[arg-type]


def test_a_term_that_gains_nothing_is_no_name() -> None:
    mode = TermUse("structural_mode", {"inertia_kg_m2": 0.0, "frequency_hz": 2.4, "damping_ratio": 0.001})
    term = shelf("gsfdi.terms", PhysicsTerm)["structural_mode"]
    assert is_nothing(Name(mode, 1.0, 0.0, {"inertia_kg_m2": (0.0, 0.5)}, ()), term)
    assert not is_nothing(Name(mode, 1.0, 0.1, {"inertia_kg_m2": (0.0, 0.5)}, ()), term)


def test_a_term_on_the_other_side_is_the_same_name() -> None:
    motor, output = (TermUse("viscous_friction", {"coefficient_nms_rad": 2.0}, side) for side in ("motor", "output"))
    likes = (Rival(output, -0.1, 0.4), Rival(TermUse("coulomb_friction", {"torque_nm": 1.0}), -2.0, 0.1))
    name = Name(motor, 0.9, 1.0, {}, likes)
    assert name.close == ("coulomb_friction",)
    assert name.is_on_either_side
    assert not Name(motor, 0.9, 1.0, {}, likes[1:]).is_on_either_side


def test_a_term_with_an_exact_twin_is_as_sure_as_both() -> None:
    load, twin = TermUse("constant_load", {"torque_nm": -0.9}), TermUse("current_bias", {"bias_a": -0.006})
    mode = TermUse("structural_mode", {"inertia_kg_m2": 0.3, "frequency_hz": 7.7, "damping_ratio": 0.07})
    whole = Name(load, 0.4, 1.0, {}, (Rival(twin, 0.0, 0.4),))
    trifle = Name(mode, 1.0, 0.0, {}, ())
    assert ranked([trifle, whole]) == [whole, trifle]
    assert ranked([replace(whole, rivals=()), trifle]) == [trifle, replace(whole, rivals=())]


def test_a_number_that_may_be_as_the_model_has_it_is_no_name() -> None:
    term = shelf("gsfdi.terms", PhysicsTerm)["output_inertia_change"]
    use = TermUse("output_inertia_change", {"ratio": 1.001}, None, 9.0)
    assert is_nothing(Name(use, 1.0, 1.0, {"ratio": (0.998, 1.004)}, ()), term)
    assert not is_nothing(Name(use, 1.0, 1.0, {"ratio": (1.0005, 1.0015)}, ()), term)
    seen = TermUse("velocity_gain", {"ratio": 0.9998})
    gain = shelf("gsfdi.terms", PhysicsTerm)["velocity_gain"]
    assert not is_nothing(Name(seen, 1.0, 1.0, {"ratio": (0.997, 1.003)}, ()), gain)


@pytest.mark.parametrize(
    ("gain", "level", "sees_speed", "feigned"),
    [(25.0, 0.0, False, True), (90.0, 0.0, False, False), (25.0, 0.1, False, False), (25.0, 0.0, True, False)],
)
def test_a_faint_gain_whose_like_twins_show_is_none(
    gain: float, level: float, sees_speed: bool, feigned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    gains = iter([1.0, 20.0, -3.0, 19.0])
    stand = SimpleNamespace(sees_speed=sees_speed)
    hand = SimpleNamespace(fitted=SimpleNamespace(model=NOMINAL), stand=stand)
    settled = SimpleNamespace(model=NOMINAL, as_logged=lambda model: model, level=level)
    monkeypatch.setattr(twin, "twin_of", lambda *args: hand)
    monkeypatch.setattr(twin, "rewritten", lambda *args: hand)
    monkeypatch.setattr(twin, "effort_floor", lambda stand: np.zeros(2))
    found = twin.is_feigned(gain, hand, settled, NOMINAL.plant, lambda twin: next(gains))  # type: ignore[arg-type]
    assert found is feigned


def test_a_term_gains_on_a_twin_beside_terms_that_suit_it(monkeypatch: pytest.MonkeyPatch) -> None:
    stand = bench([recorded(NOMINAL)], NOMINAL)
    hand, restated = opening(stand, NOMINAL, 0.0), SimpleNamespace()
    entry = Entry(Offer("cogging", None, (), lambda c: None), None, np.ones(1), 9.0, gain=7.0, fitted=hand.fitted)
    held: list[object] = []

    def contended(hand: object, *args: object) -> tuple[Contest, None]:
        held.append(hand)
        return Contest((entry,), None, 1), None

    monkeypatch.setattr(twin, "rewritten", lambda *args: restated)
    monkeypatch.setattr(twin, "contend", contended)
    assert twin.gain_of_term(hand, shelf("gsfdi.terms", PhysicsTerm)["cogging"]) == 7.0
    assert held == [restated]


@pytest.mark.thorough
def test_a_joint_that_moves_does_not_slip() -> None:
    """A step of the position that is six times its noise, which no speed tells from a slip of a joint that sticks."""
    physics = (TermUse("coulomb_friction", {"torque_nm": 2.0}, "motor"),)
    sound = replace(MODEL, physics=physics)
    step = TermUse("position_bias", {"bias_rad": 6 * MODEL.sensors.position_noise}, None, 20.1)
    record = simulate_record(replace(sound, physics=(*physics, step)), seed=2, duration=60.0)
    (entry,) = reconcile([without_speed(record)], replace(sound, controller=None)).omitted_physics
    assert entry["term"] == "position_bias"


@pytest.mark.parametrize(
    "onset",
    [25.003, pytest.param(25.01, marks=pytest.mark.thorough), pytest.param(31.37, marks=pytest.mark.thorough)],
)
def test_a_large_step_of_the_position_is_found_to_the_sample(onset: float) -> None:
    step = TermUse("position_bias", {"bias_rad": 1.6e-3}, None, onset)
    record = simulate_record(replace(MODEL, physics=(step,)), seed=2, duration=60.0)
    (entry,) = reconcile([record], MODEL).omitted_physics
    assert entry["term"] == "position_bias"
    assert entry["onset_s"] == pytest.approx(onset, abs=0.0101)
    assert entry["parameters"]["bias_rad"]["value"] == pytest.approx(1.6e-3, rel=0.01)


@pytest.mark.parametrize(
    ("term", "size", "deviation", "says"),
    [
        ("stiffness_change", 0.3, 1e-6, True),
        ("stiffness_change", 0.0, 1e-6, False),
        ("viscous_friction", 0.3, 1e-6, False),
        ("stiffness_change", 0.3, 1e-7, False),
        ("stiffness_change", 30.0, 1e-7, True),
    ],
)
def test_a_number_of_the_plant_does_not_explain_what_sways(
    term: str, size: float, deviation: float, says: bool
) -> None:
    noise = np.random.default_rng(0).standard_normal((9000, 2))
    noise[:, 0] += size * np.sin(np.linspace(0.0, 60.0, 9000))
    noise[:40] = 0.0  # no innovations while the observer warms up
    hand = SimpleNamespace(fitted=SimpleNamespace(residual=noise.ravel()))
    system = SimpleNamespace(rows=(0, 1), R=(deviation**2, 1e-6))
    stand = SimpleNamespace(system=system, scales=SimpleNamespace(reach=0.5))
    found = [SimpleNamespace(use=TermUse(term))]
    assert sways(SimpleNamespace(findings=(), found=found, hand=hand, stand=stand)) is says  # type: ignore[arg-type]


@pytest.mark.parametrize(("asked", "missed"), [(2.3, True), (0.001, False)])
def test_a_limit_is_met_wherever_the_law_surely_asks_for_more(asked: float, missed: bool) -> None:
    """A step of the position asks for twenty times the highest effort, were it a speed."""
    off, beyond = np.array([0.0, 0.001, -0.055, -0.02, -0.006]), np.array([-0.01, -0.02, asked, asked, 0.001])
    assert is_missed(off, beyond, 0.004) is missed


def test_a_stop_that_is_met_once_is_named() -> None:
    reach = float(np.max(recorded(NOMINAL)["position"]))
    stop = TermUse("end_stop", {"angle_rad": 0.97 * reach, "stiffness_nm_rad": 200.0})
    (entry,) = told(stop).omitted_physics
    assert entry["term"] == "end_stop"
    assert entry["parameters"]["angle_rad"]["value"] == pytest.approx(0.97 * reach, rel=1e-3)


def test_a_part_that_holds_all_of_the_misfit_is_not_kept_for_judging() -> None:
    stand = bench([recorded(NOMINAL)], NOMINAL)
    when = stand.records[0].t / stand.scales.seconds
    inside = (when > 0.7) & (when < 0.88)
    assert typical_window(stand, [np.where(inside, 1.0, 0.0)[:, None] * np.ones(2)]) != HOLD_OUT
    assert typical_window(stand, [np.ones((len(when), 2))]) == HOLD_OUT
    kept = stand.judged_in((0.34, 0.52))
    assert typical_window(kept, [np.ones((len(when), 2))]) == kept.window


def test_an_offer_that_lives_in_one_block_has_a_high_bar_of_its_own() -> None:
    rng = np.random.default_rng(0)
    blocks = np.repeat(np.arange(20), 50)
    residual = rng.standard_normal(1000)
    residual[:50] += 10.0
    spread, lone = rng.standard_normal(1000), np.where(blocks == 0, 1.0, 0.0)
    bare = np.array([spread, lone])
    calm, wild = inflations(bare, np.sum(bare**2, axis=1), residual, blocks)
    assert calm < 20.0
    assert bar(wild, 2, 0.005) > 0.5 * (lone @ residual) ** 2 / (lone @ lone)


@pytest.mark.thorough
def test_an_observer_does_not_work_the_bristles() -> None:
    use = TermUse("presliding_friction", {"torque_nm": 2.0, "stiffness_nm_rad": 1e4})
    found = []
    for seed in (1, 2, 3, 9):  # each alone is known to 2 to 5 %
        (entry,) = told(use, seed=seed).omitted_physics
        assert entry["term"] == "presliding_friction"
        found.append(entry["parameters"]["stiffness_nm_rad"]["value"])
    assert np.mean(found) == pytest.approx(1e4, rel=0.03)


def test_a_model_may_leave_out_the_numbers_of_its_terms(tmp_path: Path) -> None:
    path = tmp_path / "joint.toml"
    dump(NOMINAL, path)
    path.write_text(path.read_text() + '\n[[physics]]\nterm = "coulomb_friction"\n')
    model = load_models(path).for_joint(NOMINAL.name)
    answer = reconcile([recorded(model)], model)
    assert not [entry for entry in answer.omitted_physics if not entry["term"].endswith("_change")]
