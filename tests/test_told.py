"""The speed that a law tells where none is logged, and gains that only such a speed shows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from joints import MODEL, ramping, without_speed
from rigid import JOINT

from gsfdi.errors import UnusableInputError
from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.reconcile import Reconciliation, gains, reconcile
from gsfdi.reconcile.bench import bench, shared_noise
from gsfdi.reconcile.clean import learn_law, rough_law
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.contract import settle_contract
from gsfdi.reconcile.law import check_law
from gsfdi.reconcile.noise import effort_floor, surprise
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.reconcile.suspects import suspects
from gsfdi.reconcile.twin import twin_of
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord
from gsfdi.whiten import observed, whitener


def unseen(model: JointModel, seed: int = 1) -> JointRecord:
    """Record `model` without any speed."""
    return without_speed(simulate_record(model, seed=seed, duration=60.0))


def answered(*terms: TermUse, model: JointModel = MODEL) -> Reconciliation:
    return reconcile([unseen(replace(model, physics=terms))], MODEL)


def test_the_law_tells_the_speed_to_within_the_noise_of_both_its_sensors() -> None:
    true = simulate_record(MODEL, seed=1, duration=60.0)
    stand = settle_contract([unseen(MODEL)], MODEL, ()).stand
    assert stand.model.controller is not None
    lever = MODEL.plant.gear_ratio / stand.model.controller.derivative
    assert stand.lever == pytest.approx(lever)
    off = stand.records[0]["motor_velocity"] - true["motor_velocity"]
    assert np.std(off) == pytest.approx(lever * MODEL.sensors.effort_noise, rel=0.05)
    assert np.sqrt(stand.system.R[1]) == pytest.approx(
        np.hypot(np.std(off), MODEL.sensors.motor_velocity_noise), rel=0.1
    )


def test_innovations_are_white_and_likelier_once_the_noise_that_drive_and_speed_share_is_told_apart() -> None:
    gains = []
    for seed in range(3):
        stand = settle_contract([unseen(MODEL, seed)], MODEL, ()).stand
        floor, innovations = effort_floor(stand), [e[0] for e in stand.innovations([stand.model])]
        white = stand.white([e[None] for e in innovations], stand.whiteners(floor))[0].reshape(-1, 2)
        awake = white[stand.awake(0)[::2] > 0]
        assert np.std(awake, axis=0) == pytest.approx([1.0, 1.0], abs=0.04)
        apart = replace(stand, system=stand.system._replace(common=0 * stand.system.common))
        gains.append(surprise(apart, innovations, floor) - surprise(stand, innovations, floor))
    assert min(gains) > 10.0


@pytest.mark.parametrize("name", ["proportional", "integral", "derivative"])
def test_a_gain_is_known_to_a_fraction_of_a_thousandth(name: str) -> None:
    law = MODEL.controller
    assert law is not None
    answer = answered(model=replace(MODEL, controller=replace(law, **{name: 0.98 * getattr(law, name)})))
    (entry,) = answer.omitted_physics
    assert entry["term"] == f"controller_{name}"
    assert entry["parameters"]["ratio"]["value"] == pytest.approx(0.98, abs=2e-3)


def test_a_sum_that_is_worth_a_third_is_not_drawn_by_noise_where_the_model_is_a_little_off() -> None:
    rough = replace(MODEL, physics=(TermUse("coulomb_friction", {"torque_nm": 4.0}, "motor"),))
    plant = replace(MODEL.plant, torque_constant=0.625, motor_inertia=0.00115, stiffness=137e3)
    assert MODEL.controller is not None
    off = replace(rough, plant=plant, controller=replace(MODEL.controller, integral=0.3 * MODEL.controller.integral))
    check = check_law([unseen(off)], rough)
    assert check is not None
    assert [f.term for f in check.findings] == ["controller_integral"]
    assert check.findings[0].values["ratio"] == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize(("name", "ratio"), [("position_gain", 1.06), ("current_gain", 1.03)])
def test_a_sensors_scale_is_no_gain_of_the_law(name: str, ratio: float) -> None:
    answer = answered(TermUse(name, {"ratio": ratio}))
    first = answer.omitted_physics[0]
    assert first["term"] == name
    assert first["parameters"]["ratio"]["value"] == pytest.approx(ratio, abs=1e-3)
    assert not any(entry["term"].startswith("controller_") for entry in answer.omitted_physics)


@pytest.mark.parametrize(("term", "ratio"), [("position_gain", 1.1), ("controller_derivative", 0.91)])
def test_how_much_the_joint_weighs_tells_a_scale_of_the_positions_from_a_gain_of_the_law(
    term: str, ratio: float
) -> None:
    """Where no speed is asked for, both show as too little of it."""
    law = JOINT.controller
    assert law is not None
    asks = replace(JOINT, controller=replace(law, rate_feedforward=0.0))
    slack = replace(asks, controller=replace(asks.controller, derivative=ratio * law.derivative))  # type: ignore[type-var]
    true = slack if term == "controller_derivative" else replace(asks, physics=(TermUse(term, {"ratio": ratio}),))
    answer = reconcile([unseen(true)], asks)
    assert answer.omitted_physics[0]["term"] == term
    assert answer.omitted_physics[0]["parameters"]["ratio"]["value"] == pytest.approx(ratio, rel=2e-3)
    assert {"controller_derivative", "position_gain"} <= set(answer.indistinguishable[0])


def test_a_scale_that_must_not_be_found_is_not_found_in_the_place_of_a_gain() -> None:
    law = JOINT.controller
    assert law is not None
    asks = replace(JOINT, controller=replace(law, rate_feedforward=0.0))
    record = unseen(replace(asks, physics=(TermUse("position_gain", {"ratio": 1.1}),)))
    answer = reconcile([record], asks, without=["position_gain"])
    assert "position_gain" not in {entry["term"] for entry in answer.omitted_physics}


@pytest.mark.parametrize("ratio", [1.004, 0.88])
def test_a_scale_of_the_current_is_no_age_of_the_speed_although_both_act_as_acceleration_does(ratio: float) -> None:
    record = simulate_record(
        replace(MODEL, physics=(TermUse("current_gain", {"ratio": ratio}),)), seed=3, duration=60.0
    )
    first = reconcile([without_speed(record)], MODEL).omitted_physics[0]
    assert first["term"] == "current_gain"
    assert first["parameters"]["ratio"]["value"] == pytest.approx(ratio, abs=1e-3)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_setpoint_on_ramps_whose_rate_is_not_logged_makes_no_gearbox_damp(seed: int) -> None:
    assert reconcile([ramping(MODEL, seed)], MODEL).verdict == "no_mismatch"


@pytest.mark.parametrize("seed", [1, 2])
def test_no_law_is_read_off_noisy_slopes(seed: int) -> None:
    unknown = replace(MODEL, controller=None)
    assert learn_law([unseen(MODEL, seed)], unknown) is None
    assert learn_law([simulate_record(MODEL, seed=seed, duration=60.0)], unknown) is not None


def test_a_joint_without_a_law_has_a_twin_under_one_that_is_roughly_its_own() -> None:
    law, unknown = MODEL.controller, replace(MODEL, controller=None)
    assert law is not None
    found = rough_law([unseen(MODEL)], unknown)
    assert found is not None
    assert found[0].proportional == pytest.approx(law.proportional, rel=0.15)
    stand = bench([unseen(MODEL)], unknown)
    hand = twin_of(stand, unknown, unknown)
    assert hand is not None
    assert np.std(hand.stand.records[0]["position"]) == pytest.approx(np.std(stand.records[0]["position"]), rel=0.02)
    silent = replace(stand.records[0], channels={k: v for k, v in unseen(MODEL).channels.items() if k != "setpoint"})
    assert twin_of(bench([silent], unknown), unknown, unknown) is None


@pytest.mark.parametrize(("bias", "within"), [(2e-3, 0.2), pytest.param(2e-2, 0.01, marks=pytest.mark.thorough)])
def test_a_bias_of_the_current_is_dated_although_no_speed_is_logged(bias: float, within: float) -> None:
    answer = answered(TermUse("current_bias", {"bias_a": bias}, None, 25.003))
    (entry,) = answer.omitted_physics
    assert entry["term"] == "current_bias"
    assert entry["onset_s"] == pytest.approx(25.003, abs=within)
    assert entry["parameters"]["bias_a"]["value"] == pytest.approx(bias, rel=0.02)


def test_play_of_the_teeth_is_told_from_losses_although_no_speed_is_logged() -> None:
    answer = answered(TermUse("backlash", {"half_width_rad": 3e-5}))
    (entry,) = answer.omitted_physics
    assert entry["term"] == "backlash"
    assert entry["parameters"]["half_width_rad"]["value"] == pytest.approx(3e-5, rel=0.05)


def test_late_stamps_are_found_to_a_hundredth_of_a_tick() -> None:
    (entry,) = answered(TermUse("timestamp_latency", {"delay_s": 0.013})).omitted_physics
    assert entry["term"] == "timestamp_latency"
    assert entry["parameters"]["delay_s"]["value"] == pytest.approx(0.013, abs=1e-4)


def test_a_law_that_acts_on_an_older_speed_tells_none() -> None:
    law = MODEL.controller
    assert law is not None
    answer = answered(model=replace(MODEL, controller=replace(law, derivative_delay=0.01)))
    assert answer.omitted_physics == ()


@pytest.mark.parametrize("value", [0.0, np.inf])
def test_an_effort_that_stands_while_the_joint_moves_is_refused_in_one_line(value: float) -> None:
    record = unseen(MODEL)
    stuck = replace(record, channels={**record.channels, "motor_current": np.full(len(record.t), value)})
    with pytest.raises(UnusableInputError, match="no drive effort that moves"):
        reconcile([stuck], MODEL)


@pytest.mark.parametrize("late", [0.005, 0.0137])
@pytest.mark.parametrize("logged", [True, False])
def test_stamps_that_are_late_by_a_part_of_a_tick_bring_nothing_else(late: float, logged: bool) -> None:
    record = simulate_record(
        replace(MODEL, physics=(TermUse("timestamp_latency", {"delay_s": late}),)), seed=11, duration=60.0
    )
    (entry,) = reconcile([record if logged else without_speed(record)], MODEL).omitted_physics
    assert entry["term"] == "timestamp_latency"
    assert entry["parameters"]["delay_s"]["value"] == pytest.approx(late, abs=1e-4)


def stiff(*terms: TermUse, inertia: float = 90.0) -> JointModel:
    """Model of a drive of 1 kHz whose law sums nothing and asks for no speed, under friction."""
    friction = (
        TermUse("coulomb_friction", {"torque_nm": 30.0}),
        TermUse("viscous_friction", {"coefficient_nms_rad": 130.0}),
    )
    return replace(
        JOINT,
        plant=replace(JOINT.plant, output_inertia=inertia),
        controller=Controller(1.3e6, 0.0, 8e3, 1000.0, rate_feedforward=0.0, effort="drive_torque"),
        sensors=Sensors(1e-7, position_noise=2e-7, motor_velocity_noise=1e-4, effort_noise=0.1),
        physics=(*friction, *terms),
    )


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.thorough)])
def test_stamps_of_a_stiff_law_are_late_and_bring_nothing_else(seed: int) -> None:
    late = TermUse("timestamp_latency", {"delay_s": 9.07e-4})
    record = without_speed(simulate_record(stiff(late, inertia=92.0), seed=seed, duration=20.0))
    entry, *others = reconcile([record], stiff()).omitted_physics
    assert entry["term"] == "timestamp_latency"
    assert entry["parameters"]["delay_s"]["value"] == pytest.approx(9.07e-4, abs=2e-6)
    assert {other["term"] for other in others} <= {"output_inertia_change"}


def test_what_is_being_put_right_is_made_exact_before_another_number_is_blamed() -> None:
    late = TermUse("timestamp_latency", {"delay_s": 9.07e-4})
    record = without_speed(simulate_record(stiff(late, inertia=92.0), seed=0, duration=20.0))
    nearly = LawFinding("timestamp_latency", {"delay_s": 9.02e-4}, None, 1e3, 1.0, 0.0)
    settled = settle_contract([record], stiff(), (), (nearly,))
    first = opening(settled.stand, settled.model, settled.level)
    before = {f.term for f in suspects(first)}
    assert "controller_derivative" in before
    assert "timestamp_latency" not in before
    found = {f.term: f.values for f in suspects(first, "timestamp_latency")}
    assert "controller_derivative" not in found
    assert found["timestamp_latency"]["delay_s"] == pytest.approx(5e-6, abs=1e-6)


def test_a_bias_of_the_current_is_as_likely_as_the_load_that_it_looks_like() -> None:
    answer = answered(TermUse("current_bias", {"bias_a": 0.05}))
    assert {"current_bias", "constant_load"} <= set(answer.indistinguishable[0])


def test_a_wave_is_fitted_to_its_last_turn() -> None:
    use = TermUse("cogging", {"amplitude_nm": 2.0, "order": 12.0, "phase_rad": 0.0})
    answer = answered(use)
    (entry,) = answer.omitted_physics
    assert entry["parameters"]["amplitude_nm"]["value"] == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize(
    ("use", "like"),
    [
        (TermUse("current_gain", {"ratio": 1.02}), "torque_constant_change"),
        (TermUse("timestamp_latency", {"delay_s": 0.005}), "actuation_delay"),
    ],
)
def test_where_no_law_is_known_what_does_the_same_is_listed(use: TermUse, like: str) -> None:
    unknown = replace(MODEL, controller=None)
    answer = reconcile([unseen(replace(MODEL, physics=(use,)))], unknown)
    assert {use.term, like} <= set(answer.indistinguishable[0])


def test_one_number_that_is_off_is_found_however_the_gearbox_rings() -> None:
    true = replace(MODEL, physics=(TermUse("stiffness_change", {"ratio": 0.9}),))
    (entry,) = reconcile([unseen(true)], replace(MODEL, controller=None)).omitted_physics
    assert entry["term"] == "stiffness_change"


def test_a_coarser_position_sensor_is_found_by_its_values() -> None:
    (entry,) = answered(TermUse("quantisation", {"step_rad": 1e-4})).omitted_physics
    assert entry["parameters"]["step_rad"]["value"] == pytest.approx(1e-4)


def test_what_rarely_sets_in_is_dated_where_it_plainly_does() -> None:
    answer = answered(TermUse("cogging", {"amplitude_nm": 2.0, "order": 12.0, "phase_rad": 0.0}, None, 25.0))
    (entry,) = answer.omitted_physics
    assert entry["term"] == "cogging"
    assert entry["onset_s"] == pytest.approx(25.0, abs=0.2)


@pytest.mark.parametrize(("ticks", "share"), [(0.0, 1.0), (0.25, 0.75), (2.0, 0.0)])
def test_an_effort_that_acts_late_shares_less_of_its_noise_with_the_speed_it_tells(ticks: float, share: float) -> None:
    late = replace(MODEL, physics=(TermUse("actuation_delay", {"delay_s": 0.01 * ticks}),))
    whole = shared_noise(MODEL, "motor_current", 15.0)
    assert shared_noise(late, "motor_current", 15.0) == pytest.approx(share * whole)


@pytest.mark.parametrize(("seed", "share"), [(2, 0.97), (3, 0.9), (4, 0.97)])
def test_a_limit_at_which_the_integral_waits_is_no_bias_that_sets_in(seed: int, share: float) -> None:
    limit = share * float(np.max(np.abs(unseen(MODEL, seed)["motor_current"])))
    assert MODEL.controller is not None
    limited = replace(MODEL, controller=replace(MODEL.controller, limit=limit))
    (entry,) = reconcile([unseen(limited, seed)], MODEL).omitted_physics
    assert entry["term"] == "current_limit"
    assert entry["parameters"]["limit_a"]["value"] == pytest.approx(limit, rel=3e-3)


COARSE = JointModel(
    "J1",
    "flexible",
    Plant(4.5, 0.00015, 160.0, 42000.0, 3.0, 0.14),
    controller=Controller(37.0, 18.0, 7.4, 250.0),
    sensors=Sensors(4.8e-5, 0.0, 0.0, 0.1, 0.0, 0.02),
)
"""A joint of which a coarse encoder shows the position, and a noisy effort what the law made of its speed."""


def test_innovations_are_white_where_a_coarse_position_goes_with_a_told_speed() -> None:
    record = without_speed(simulate_record(COARSE, seed=3, duration=30.0))
    stand = settle_contract([record], COARSE, ()).stand
    assert stand.grains
    assert stand.lever > 0
    white = stand.white(stand.innovations([stand.model]), stand.whiteners(effort_floor(stand)))[0].reshape(-1, 2)
    for channel in white[stand.awake(0)[::2] > 0].T:
        beside = [float(np.mean(channel[lag:] * channel[:-lag])) / float(np.var(channel)) for lag in (2, 3, 4)]
        assert np.abs(beside) == pytest.approx([0.0] * 3, abs=0.07)


def test_a_told_speed_shares_no_more_noise_with_the_drive_than_either_has() -> None:
    system = observed(MODEL, 0.01, (1e-10, 1e-2), shared=1.0)
    steps, present = np.r_[0, np.ones(99, dtype=np.int64)], np.ones((100, 2), dtype=np.bool_)
    torque = np.array([0.5, 0.1])
    assert np.isfinite(whitener(system, np.zeros((4, 2)), 1e-6 * np.eye(4), torque, steps, present).weights).all()


@pytest.mark.parametrize(
    ("delay", "before", "tried"), [(-0.016, True, False), (-0.016, False, True), (0.01, True, True)]
)
def test_a_speed_that_is_younger_than_now_takes_no_finding_away(
    delay: float, before: bool, tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    late = LawFinding("derivative_delay", {"delay_s": delay}, None, 504.0, 0.1, 1e-4)
    gain = LawFinding("current_gain", {"ratio": 0.9}, None, 25000.0, 1.0, 1e-3)
    monkeypatch.setattr(gains, "suspects", lambda *args: [late])
    monkeypatch.setattr(gains, "best_term", lambda *args: None)
    monkeypatch.setattr(gains, "likelier_law", lambda *args: 0.0)
    monkeypatch.setattr(gains, "is_better", lambda *args: False)
    opened: list[tuple[LawFinding, ...]] = []
    bare = SimpleNamespace(settled=SimpleNamespace(model=JOINT), first=None, beyond=(gain,) if before else ())

    def opener(beyond: tuple[LawFinding, ...]) -> SimpleNamespace:
        opened.append(beyond)
        return bare

    assert not list(gains.better_ones(bare, opener, {}, ()))  # type: ignore[arg-type]
    assert bool(opened) is tried


def test_a_rival_of_a_limit_gains_nothing_by_samples_at_which_the_limit_is_met(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the limit explains there counts for neither: a step of the position at one had gained 9323 against 7998."""
    gained = {"all": 9323.0, "what both count": 5000.0}
    monkeypatch.setattr(gains, "effort_floor", lambda stand: np.zeros(1))
    monkeypatch.setattr(gains, "leaves_nothing", lambda *args: True)
    monkeypatch.setattr(gains, "refit", lambda *args: SimpleNamespace(fitted=SimpleNamespace(model=None, knobs=())))
    monkeypatch.setattr(gains, "settle", lambda *args: "all")
    monkeypatch.setattr(gains, "over_the_same", lambda one, other: "what both count")
    monkeypatch.setattr(gains, "likelier", lambda new, old: gained[new])
    other = first = SimpleNamespace(stand=SimpleNamespace(lever=1.0))
    rival = SimpleNamespace(linear=8250.0)
    assert gains.is_better(7998.0, other, first, rival)  # type: ignore[arg-type]
    assert not gains.is_better(4000.0, other, first, rival)  # type: ignore[arg-type]


def test_rows_that_are_not_held_against_a_law_do_not_make_its_noise_look_smaller() -> None:
    whole = simulate_record(MODEL, seed=1, duration=60.0)
    kept = np.random.default_rng(1).random(len(whole.t)) > 0.08
    channels = {name: whole[name][kept] for name in whole.channels if name != "setpoint_rate"}
    stand = bench([replace(whole, t=whole.t[kept], channels=channels, valid={})], MODEL)
    check = check_law(stand.records, replace(MODEL, sensors=replace(MODEL.sensors, effort_noise=1e-4)))
    assert check is not None
    assert check.samples < 0.9 * len(whole.t)
    assert check.after == pytest.approx(MODEL.sensors.effort_noise, rel=0.05)
