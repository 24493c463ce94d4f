import math
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from oracle import Oracle, closed_loop
from rigid import JOINT as RIGID
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import gsfdi
from gsfdi.model import Controller, JointModel, Plant, TermUse
from gsfdi.modelfile import load_models
from gsfdi.packed import pack
from gsfdi.replay import compiling, kernel, layout
from gsfdi.replay.flow import transitions
from gsfdi.simulate import Drive, Signals, Start, at_once, drive_from, innovations_of, replay, replay_many
from gsfdi.training import training
from gsfdi.types import Array

ROOT = Path(gsfdi.__file__).parents[1]
ERA = load_models(ROOT / "configs" / "era_joint.toml").for_joint("era")
EMPS = load_models(ROOT / "configs" / "emps_joint.toml").for_joint("emps")
REST = Start(0.0, 0.0, 0.0, 0.0, 0.0)


def matrices(plant: Plant) -> tuple[Array, Array]:
    j, i = plant.gear_ratio**2 * plant.motor_inertia, plant.output_inertia
    c, b = plant.stiffness, plant.damping
    a = np.array([[0, 1, 0, 0], [0, 0, c / j, 0], [0, 0, 0, 1], [0, -b / i, -c / j - c / i, -b / i]])
    return a, np.array([0, 1 / j, 0, -1 / j]) * plant.gear_ratio * plant.torque_constant


def commanded(t: Array, setpoint: Array, model: JointModel, **more: Array) -> Drive:
    blank = np.full(t.size, np.nan)
    signals = Signals(t, setpoint, np.gradient(setpoint, t), 0 * t, blank, blank, blank, 0 * t + 20.0)
    return drive_from(signals._replace(**more), model, REST)


def wave(rate: float, seconds: float) -> tuple[Array, Array]:
    t = np.arange(round(rate * seconds)) / rate
    return t, 0.02 * np.sin(2 * np.pi * t / 4) ** 3


def with_terms(*uses: TermUse, model: JointModel = ERA) -> JointModel:
    return replace(model, physics=uses)


def test_numba_is_told_when_any_file_of_the_kernel_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    told = compiling.stamp()
    assert told in [cell.cell_contents for cell in kernel.run_many.py_func.__closure__]
    assert {"flow.py", "layout.py", "motion.py"} <= {path.name for path in compiling.SOURCES}
    for left_out in compiling.SOURCES:
        monkeypatch.setattr(compiling, "SOURCES", [path for path in compiling.SOURCES if path != left_out])
        assert compiling.stamp() != told


# The linear joint


def test_closed_loop_matches_the_matrix_exponential() -> None:
    drive = drive_from(training("rotary", 100.0, 30.0, 1), ERA, REST)
    a, b = matrices(ERA.plant)
    flow = expm(np.block([[a, b[:, None]], [np.zeros((1, 5))]]) * 0.01)
    x, integral, before, law = np.zeros(4), 0.0, None, ERA.controller
    assert law is not None
    trace = replay(ERA, drive)
    for k in range(drive.t.size):
        error = drive.signals.setpoint[k] - x[0] - x[2]
        integral += 0.0 if before is None else law.integral * 0.005 * (error + before)
        before = error
        effort = law.proportional * error + integral + law.derivative * (drive.signals.setpoint_rate[k] - x[1])
        assert trace.effort[k] == pytest.approx(effort, abs=1e-12)
        assert trace.position[k] == pytest.approx(x[0] + x[2], abs=1e-13)
        assert trace.motor_velocity[k] == pytest.approx(260.6 * x[1], abs=1e-11)
        x = flow[:4, :4] @ x + flow[:4, 4] * effort


def test_open_loop_matches_python_control() -> None:
    t, effort = np.arange(2000) / 100.0, np.random.default_rng(1).normal(size=2000).repeat(1)
    trace = replay(ERA, commanded(t, 0 * t, ERA, effort=effort), "open_loop")
    a, b = matrices(ERA.plant)
    flow = control.c2d(control.ss(a, b[:, None], np.eye(4), 0), 0.01)
    response = control.forced_response(flow, t, effort)
    np.testing.assert_allclose(trace.position, response.outputs[0] + response.outputs[2], atol=1e-10)
    np.testing.assert_allclose(trace.windup, response.outputs[2], atol=1e-10)


def test_a_rigid_linear_drive_matches_its_closed_form() -> None:
    t = np.arange(500) / 1000.0
    model = replace(EMPS, plant=replace(EMPS.plant, damping=200.0))
    trace = replay(model, commanded(t, 0 * t, model, effort=0 * t + 30.0), "open_loop")
    mass, drag = 95.1, 200.0
    closed = 30.0 / drag * (t - mass / drag * (1 - np.exp(-drag * t / mass)))
    np.testing.assert_allclose(trace.position, closed, rtol=1e-10, atol=1e-14)
    assert trace.joint_velocity[-1] == pytest.approx(30.0 / drag * (1 - math.exp(-drag * t[-1] / mass)))


def test_free_response_rings_at_the_spring_mode() -> None:
    t = np.arange(4096) / 200.0
    start = np.array([-1e-3 * 400 / 474.7, 0.0, 1e-3, 0.0, 0.0])
    trace = replay(ERA, commanded(t, 0 * t, ERA, effort=0 * t), "open_loop", x0=start)
    spectrum = np.abs(np.fft.rfft(trace.windup * np.hanning(t.size)))
    assert np.fft.rfftfreq(t.size, 1 / 200.0)[np.argmax(spectrum)] == pytest.approx(7.23, abs=0.05)


@pytest.mark.parametrize("step", [0.3, 3e-3])
def test_any_spacing_gives_the_same_motion(step: float) -> None:
    """Stamps with gaps and jitter: the joint is where a regular recording finds it."""
    rng = np.random.default_rng(3)
    t, r = wave(100.0, 8.0)
    dense = replay(ERA, commanded(t, r, ERA))
    keep = np.sort(rng.choice(np.arange(1, t.size - 1), 500, replace=False))
    keep = np.concatenate([[0], keep, [t.size - 1]])
    thin = commanded(t[keep], r[keep], ERA)
    full = drive_from(thin.signals, ERA, REST)
    assert full.clock.events.shape[0] == t.size
    # Between samples the setpoint is known only by interpolation, so the command is compared at that.
    r_between = np.interp(t, t[keep], r[keep])
    rate_between = np.interp(t, t[keep], thin.signals.setpoint_rate)
    oracle = replay(ERA, commanded(t, r_between, ERA, setpoint_rate=rate_between))
    np.testing.assert_allclose(replay(ERA, thin).position, oracle.position[keep], atol=1e-12)
    assert np.max(np.abs(oracle.position - dense.position)) < 0.1 * step


def test_irregular_stamps_are_integrated_over_their_own_steps() -> None:
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.005, 0.094, 300))
    effort = rng.normal(size=t.size)
    model = replace(ERA, controller=None)
    trace = replay(model, commanded(t, 0 * t, model, effort=effort), "open_loop")
    a, b = matrices(ERA.plant)
    x = np.zeros(4)
    for k in range(t.size - 1):
        assert trace.position[k] == pytest.approx(x[0] + x[2], abs=1e-9)
        flow = expm(np.block([[a, b[:, None]], [np.zeros((1, 5))]]) * (t[k + 1] - t[k]))
        x = flow[:4, :4] @ x + flow[:4, 4] * effort[k]


@pytest.mark.parametrize("phase", [1e-4, 9e-4, 1.1e-3, 0.029, 0.031, 0.149, 0.151, 0.25])
def test_flows_match_the_matrix_exponential(phase: float) -> None:
    """Half a step's and a step's, whichever terms of the series its fastest mode, of 45 rad/s, asks for."""
    plant = replace(ERA.plant, damping=30.0)
    _, _, flow, powers, _ = kernel.scratch(1)
    model, (a, b) = pack(replace(ERA, plant=plant)), matrices(plant)
    kernel.lay_out(model, layout.ERA_ROWS, powers)
    half = phase / math.sqrt(-a[3, 2])
    transitions(model, powers[0], half, flow, 0)
    for k, step in enumerate((half, 2 * half)):
        exact = expm(np.block([[a, b[:, None]], [np.zeros((1, 5))]]) * step)
        np.testing.assert_allclose(flow[k, :4].T, exact[:4, :4], rtol=1e-12, atol=1e-15)
        gain = plant.gear_ratio * plant.torque_constant
        np.testing.assert_allclose(gain * flow[k, 4], exact[:4, 4], rtol=1e-12, atol=1e-18)


def test_a_recording_faster_than_its_controller() -> None:
    t, r = wave(1000.0, 4.0)
    fast = replay(ERA, commanded(t, r, ERA))
    assert np.count_nonzero(np.diff(fast.effort)) <= 400
    slow = replay(ERA, commanded(t[::10], r[::10], ERA, setpoint_rate=np.gradient(r, t)[::10]))
    np.testing.assert_allclose(fast.position[::10], slow.position, atol=1e-12)


# Physics against adaptive integration with events

MOTOR = TermUse("coulomb_friction", {"torque_nm": 3.0}, "motor")
OUTPUT = TermUse("coulomb_friction", {"torque_nm": 2.0}, "output")
STRIBECK = TermUse("stribeck_friction", {"excess_nm": 2.0, "velocity_rad_s": 0.003}, "motor")
P = ERA.plant
CASES = {
    "stick on the motor": ((MOTOR,), Oracle(P, motor_dry=lambda _a, _v: 3.0), 5e-6),
    "stick on both sides": ((MOTOR, OUTPUT), Oracle(P, lambda _a, _v: 3.0, lambda _a, _v: 2.0), 5e-6),
    "stick-slip": ((MOTOR, STRIBECK), Oracle(P, lambda _a, v: 3.0 + 2.0 * math.exp(-((v / 0.003) ** 2))), 2e-4),
    "a harness that hardens": (
        (TermUse("cable_harness", {"stiffness_nm_rad": 300.0, "rest_rad": 0.1, "hardening_per_rad2": 50.0}),),
        Oracle(P, output_torque=lambda a, _v: 300.0 * (a - 0.1) * (1.0 + 50.0 * (a - 0.1) ** 2)),
        3e-5,
    ),
    "a tight spot": (
        (TermUse("position_dependent_friction", {"torque_nm": 4.0, "centre_rad": 0.01, "width_rad": 0.004}, "output"),),
        Oracle(P, output_dry=lambda a, _v: 4.0 * math.exp(-0.5 * ((a - 0.01) / 0.004) ** 2)),
        1e-5,
    ),
    "backlash": ((TermUse("backlash", {"half_width_rad": 1e-3}),), Oracle(P, half_gap=1e-3), 3e-3),
    "an end stop": (
        (TermUse("end_stop", {"angle_rad": 0.01, "stiffness_nm_rad": 1e4}),),
        Oracle(P, stop=0.01, stop_stiffness=1e4),
        3e-4,
    ),
    "smooth resistance": (
        (
            TermUse("viscous_friction", {"coefficient_nms_rad": 50.0}, "motor"),
            TermUse("quadratic_friction", {"coefficient_nms2_rad2": 500.0}, "motor"),
            TermUse("gravity_unbalance", {"torque_nm": 50.0, "angle_rad": 0.3}),
            TermUse("cable_harness", {"stiffness_nm_rad": 300.0, "rest_rad": 0.1}),
            TermUse("constant_load", {"torque_nm": 5.0}),
        ),
        Oracle(
            P,
            motor_torque=lambda _a, v: 50.0 * v + 500.0 * v * abs(v),
            output_torque=lambda a, _v: 50.0 * math.sin(a - 0.3) + 300.0 * (a - 0.1) + 5.0,
        ),
        3e-5,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_physics_matches_integration_with_events(name: str) -> None:
    uses, oracle, tolerance = CASES[name]
    t, r = wave(100.0, 5.0)
    rate = np.gradient(r, t)
    assert ERA.controller is not None
    states, efforts = closed_loop(oracle, ERA.controller, r, rate, 0.01)
    errors = []
    for finer in (1, 4):
        trace = replay(with_terms(*uses), commanded(t, r, ERA), x0=np.zeros(5), finer=finer)
        for got, true in ((trace.effort, efforts), (trace.position, states[:, 0] + states[:, 2])):
            assert np.max(np.abs(got - true)) < tolerance / finer * np.max(np.abs(true))
        errors.append(np.sqrt(np.mean((trace.effort - efforts) ** 2)))
    assert math.log(errors[0] / errors[1], 4) > 1.5  # second order; corners cost a little of it


def test_friction_that_turns_round_smoothly_matches_integration() -> None:
    """Steps in which it turns are taken in parts: what they get wrong there would be called a delay."""
    t, r = wave(100.0, 5.0)
    oracle = Oracle(P, motor_torque=lambda _a, v: 3.0 * math.tanh(v / 5e-4))
    assert ERA.controller is not None
    states, efforts = closed_loop(oracle, ERA.controller, r, np.gradient(r, t), 0.01)
    smooth = with_terms(replace(MOTOR, values={"torque_nm": 3.0, "smooth_rad_s": 5e-4}))
    trace = replay(smooth, commanded(t, r, ERA), x0=np.zeros(5))
    for got, true in ((trace.effort, efforts), (trace.position, states[:, 0] + states[:, 2])):
        np.testing.assert_allclose(got, true, rtol=0.0, atol=5e-5 * np.max(np.abs(true)))


def test_a_rigid_joint_turns_round_as_smoothly_as_integration_says() -> None:
    """Its speed decays three thousand times a second where it turns, and the controller acts a hundred times."""
    t, r = wave(100.0, 5.0)
    law, friction = RIGID.controller, TermUse("coulomb_friction", {"torque_nm": 3.0, "smooth_rad_s": 5e-4})
    assert law is not None

    def rate(_t: float, x: Array, drive: float) -> tuple[float, float]:
        return x[1], (drive - 3.0 * math.tanh(x[1] / 5e-4)) / RIGID.plant.output_inertia

    x, integral, before, efforts = np.zeros(2), 0.0, None, np.empty(t.size)
    for k, (goal, speed) in enumerate(zip(r, np.gradient(r, t), strict=True)):
        error = goal - x[0]
        integral += 0.0 if before is None else law.integral * 0.005 * (error + before)
        before = error
        efforts[k] = law.proportional * error + integral + law.derivative * (speed - x[1])
        x = solve_ivp(rate, (0.0, 0.01), x, "Radau", rtol=1e-8, atol=1e-12, args=(efforts[k],)).y[:, -1]
    got = replay(with_terms(friction, model=RIGID), commanded(t, r, RIGID), x0=np.zeros(5)).effort
    np.testing.assert_allclose(got, efforts, rtol=0.0, atol=5e-3 * np.max(np.abs(efforts)))


def test_smooth_laws_converge_with_second_order() -> None:
    uses, _, _ = CASES["smooth resistance"]
    t, r = wave(100.0, 5.0)
    traces = [replay(with_terms(*uses), commanded(t, r, ERA), finer=n).effort for n in (1, 2, 4, 64)]
    errors = [np.max(np.abs(trace - traces[-1])) for trace in traces[:3]]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(
    ("use", "error"),
    [
        (TermUse("cogging", {"amplitude_nm": 2.0, "order": 12.0, "phase_rad": 0.4}, "motor"), 8e-6),
        (TermUse("torque_ripple", {"amplitude_ratio": 0.1, "order": 6.0}), 1.5e-5),
        (TermUse("transmission_error", {"amplitude_rad": 5e-5, "order": 3.0}), 3e-5),
    ],
)
def test_waves_need_no_shorter_steps_than_other_laws(use: TermUse, error: float) -> None:
    t, r = wave(100.0, 5.0)
    got, true = (replay(with_terms(use), commanded(t, r, ERA), finer=n).effort for n in (1, 64))
    assert np.max(np.abs(got - true)) < error  # held at its mean alone, each errs by twice that and more


def rates(x: Array, uses: str, drive: float) -> list[float]:
    """Equations of motion with a memory, for scipy: the last state is the term's own."""
    p = ERA.plant
    omega, v, windup, rate, z, zr = x
    j, i, c = p.gear_ratio**2 * p.motor_inertia, p.output_inertia, p.stiffness
    spring, on_motor, on_output, dz, dzr = c * windup, 0.0, p.damping * (v + rate), 0.0, 0.0
    if uses == "presliding_friction":
        dz = v * 2e4 / 4.0 - abs(v) * 2e4 / 4.0 * z
        on_motor = 4.0 * z
    elif uses == "gearbox_hysteresis":
        dz = (rate - abs(rate) * z) / 2e-4
        spring += 10.0 * z
    else:
        w = 2 * math.pi * 2.0
        pull = 20.0 * (w * w * (omega + windup - z) + 2 * 0.02 * w * (v + rate - zr))
        on_output += pull
        dz, dzr = zr, pull / 20.0
    a = (drive + spring - on_motor) / j
    return [v, a, rate, (-spring - on_output) / i - a, dz, dzr]


@pytest.mark.parametrize(
    "use",
    [
        TermUse("presliding_friction", {"torque_nm": 4.0, "stiffness_nm_rad": 2e4}, "motor"),
        TermUse("gearbox_hysteresis", {"torque_nm": 10.0, "width_rad": 2e-4}),
        TermUse("structural_mode", {"inertia_kg_m2": 20.0, "frequency_hz": 2.0, "damping_ratio": 0.02}),
    ],
    ids=lambda use: str(use.term),
)
def test_memories_match_adaptive_integration(use: TermUse) -> None:
    t = np.arange(300) / 100.0
    effort = 0.2 * np.sin(2 * np.pi * t / 1.5)
    trace = replay(with_terms(use), commanded(t, 0 * t, ERA, effort=effort), "open_loop")
    x, found = np.zeros(6), []
    for k in range(t.size):
        found.append(x[0] + x[2])
        drive = ERA.plant.gear_ratio * ERA.plant.torque_constant * effort[k]
        sol = solve_ivp(lambda _t, y, u=drive: rates(y, use.term, u), (0, 0.01), x, "LSODA", rtol=1e-9, atol=1e-13)
        x = sol.y[:, -1]
    assert np.max(np.abs(trace.position - found)) < 2e-3 * np.ptp(found)


# Closed forms


def test_steady_speed_costs_the_friction_torque() -> None:
    t = np.arange(2000) / 100.0
    model = with_terms(MOTOR, OUTPUT, TermUse("viscous_friction", {"coefficient_nms_rad": 40.0}, "motor"))
    trace = replay(model, commanded(t, 0.05 * t, model, setpoint_rate=0 * t + 0.05))
    torque = 3.0 + 2.0 + (40.0 + ERA.plant.damping) * 0.05
    assert trace.effort[-1] == pytest.approx(torque / (260.6 * 0.6), rel=1e-4)
    assert trace.windup[-1] == pytest.approx(-(2.0 + 0.4 * 0.05) / 130000.0, rel=1e-3)


def test_friction_holds_below_its_level_and_yields_above_it() -> None:
    t = np.arange(1000) / 100.0
    push = t * 0.4  # [N m] at the output, per second: breaks away at 3 N m
    model = with_terms(MOTOR)
    trace = replay(model, commanded(t, 0 * t, model, effort=push / (260.6 * 0.6)), "open_loop")
    stuck = push < 3.0
    assert np.max(np.abs(trace.motor_velocity[stuck])) < 1e-9
    assert np.max(np.abs(trace.position[stuck])) < 1e-12
    assert trace.position[-1] > 1e-3


def test_a_motor_that_sticks_does_not_creep_while_the_spring_swings() -> None:
    t = np.arange(200) / 100.0
    model = with_terms(TermUse("coulomb_friction", {"torque_nm": 500.0}, "motor"))
    trace = replay(model, commanded(t, 0 * t, model, effort=0 * t), "open_loop", x0=np.array([0, 0, 1e-4, 0, 0.0]))
    assert np.ptp(trace.windup) > 1e-4  # the load swings on the spring
    assert np.max(np.abs(trace.position - trace.windup)) < 1e-15


def test_friction_that_turns_within_a_sample_is_as_good_as_with_finer_steps() -> None:
    t, r = wave(100.0, 10.0)
    rigid = with_terms(TermUse("coulomb_friction", {"torque_nm": 20.0}), model=EMPS)
    for model in (with_terms(MOTOR), rigid):
        coarse, fine = (replay(model, commanded(t, r, model), finer=n).position for n in (1, 64))
        assert np.sqrt(np.mean((coarse - fine) ** 2)) < 1e-7 * np.ptp(fine)


def test_backlash_shows_its_width_at_reversal() -> None:
    """Friction on the link keeps the teeth apart on the flank that drives: the wind-up is half width plus F / c."""
    t = np.arange(6000) / 100.0
    uses = (TermUse("backlash", {"half_width_rad": 2e-3}), TermUse("gearbox_damping", {"coefficient_nms_rad": 2000.0}))
    model = with_terms(*uses, OUTPUT)
    trace = replay(model, commanded(t, 0.1 * np.sin(2 * np.pi * t / 30), model))
    steady = (np.abs(trace.joint_velocity) > 0.015) & (t > 8)
    expected = -np.sign(trace.joint_velocity[steady]) * (2e-3 + 2.0 / 130000.0)
    np.testing.assert_allclose(np.median(np.abs(trace.windup[steady])), 2e-3 + 2.0 / 130000.0, rtol=0.03)
    assert np.mean(np.sign(expected) == np.sign(trace.windup[steady])) > 0.9


def test_integral_action_hunts_with_stiction() -> None:
    """A limit cycle that the linear joint does not have: an integrator, and friction that is greater at rest."""
    t = np.arange(12000) / 100.0
    law = Controller(28.0, 100.0, 17.0, 100.0)
    excess = TermUse("stribeck_friction", {"excess_nm": 6.0, "velocity_rad_s": 0.003}, "motor")
    sticky = replace(with_terms(TermUse("coulomb_friction", {"torque_nm": 1.0}, "motor"), excess), controller=law)
    setpoint = 0.01 * np.minimum(t, 1.0)
    trace = replay(sticky, commanded(t, setpoint, sticky))
    late = t > 60
    assert np.ptp(trace.position[late]) > 5e-5
    assert np.mean(np.abs(trace.motor_velocity[late]) < 1e-9) > 0.5  # most of a cycle is spent stuck
    assert np.ptp(np.sign(trace.position[late] - 0.01)) == 2  # on either side of the goal
    still = replay(replace(sticky, physics=()), commanded(t, setpoint, sticky))
    assert np.ptp(still.position[late]) < 1e-9


def test_presliding_is_a_spring_for_small_torques() -> None:
    t = np.arange(6000) / 100.0
    model = with_terms(TermUse("presliding_friction", {"torque_nm": 10.0, "stiffness_nm_rad": 1e5}, "motor"))
    push = np.minimum(t / 20, 1.0) * 0.1
    trace = replay(model, commanded(t, 0 * t, model, effort=push / (260.6 * 0.6)), "open_loop")
    assert trace.motor_angle[-200:].mean() == pytest.approx(0.1 / 1e5, rel=0.02)


def test_delay_shifts_the_torque() -> None:
    t = np.arange(400) / 100.0
    effort = np.where(t >= 1.0, 0.1, 0.0)
    late = with_terms(TermUse("actuation_delay", {"delay_s": 0.025}))
    trace = replay(late, commanded(t, 0 * t, ERA, effort=effort), "open_loop")
    fine = np.arange(4000) / 1000.0
    plain = replay(
        replace(ERA, controller=None),
        commanded(fine, 0 * fine, ERA, effort=np.where(fine >= 1.025, 0.1, 0.0)),
        "open_loop",
    )
    np.testing.assert_allclose(trace.position, plain.position[::10], atol=2e-7)


def test_late_stamps_show_the_past() -> None:
    t, r = wave(100.0, 8.0)
    late = with_terms(TermUse("timestamp_latency", {"delay_s": 0.025}))
    trace, fresh = replay(late, commanded(t, r, ERA)), replay(ERA, commanded(t, r, ERA))
    np.testing.assert_allclose(trace.effort, fresh.effort, atol=1e-12)
    then = np.interp(t - 0.025, t, fresh.position)
    np.testing.assert_allclose(trace.position[5:], then[5:], atol=2e-6)


@pytest.mark.parametrize("lag", [0.004, 0.025])
def test_a_speed_that_lags_shows_the_past_beside_the_position_of_now(lag: float) -> None:
    t, r = wave(100.0, 8.0)
    slow = with_terms(TermUse("velocity_lag", {"lag_s": lag}))
    trace, fresh = replay(slow, commanded(t, r, ERA)), replay(ERA, commanded(t, r, ERA))
    np.testing.assert_allclose(trace.effort, fresh.effort, atol=1e-12)
    np.testing.assert_array_equal(trace.position, fresh.position)
    then = np.interp(t - lag, t, fresh.motor_velocity)
    np.testing.assert_allclose(trace.motor_velocity[5:], then[5:], atol=1e-9)


def test_the_limit_holds_without_windup() -> None:
    t = np.arange(3000) / 100.0
    law = Controller(28.0, 40.0, 17.0, 100.0, limit=0.05)
    model = replace(ERA, controller=law)
    trace = replay(model, commanded(t, np.where(t > 1, 0.2, 0.0), model, setpoint_rate=0 * t))
    assert np.max(np.abs(trace.effort)) == 0.05
    integral = trace.state[:, 4]
    saturated = np.abs(trace.effort) == 0.05
    wound_up = np.diff(integral)[saturated[1:]] * np.sign(trace.effort[1:][saturated[1:]])
    assert np.max(wound_up) <= 1e-12
    assert abs(trace.position[-1] - 0.2) < 0.05


# Modes


def test_restarts_take_the_states_they_are_given() -> None:
    t, r = wave(100.0, 8.0)
    drive = commanded(t, r, ERA)
    whole = replay(ERA, drive)
    starts = [100, 350, 700]
    shots = replay(ERA, drive, restarts=starts, states=whole.state[starts])
    np.testing.assert_allclose(shots.position, whole.position, atol=1e-4)
    np.testing.assert_array_equal(shots.state[starts, :4], whole.state[starts, :4])
    shifted = whole.state[starts] + [1e-3, 0, 0, 0, 0]
    moved = replay(ERA, drive, restarts=starts, states=shifted)
    assert moved.position[100] == pytest.approx(whole.position[100] + 1e-3)
    np.testing.assert_array_equal(moved.position[:100], whole.position[:100])


def test_a_batch_is_its_members() -> None:
    t, r = wave(100.0, 4.0)
    drive = commanded(t, r, ERA)
    models = [with_terms(MOTOR), ERA, with_terms(TermUse("backlash", {"half_width_rad": 1e-3}), OUTPUT, STRIBECK)]
    singly = [replay(m, drive) for m in models]
    for hands in (1, 2, 5):
        with at_once(hands):
            batch = replay_many(models, drive)
        for together, alone in zip(batch, singly, strict=True):
            np.testing.assert_array_equal(together.effort, alone.effort)


@pytest.mark.parametrize("mode", ["predict", "predict_controller"])
def test_an_observer_has_no_innovation_where_the_model_is_true(mode: str) -> None:
    drive = drive_from(training("rotary", 100.0, 10.0, 1), ERA, REST)
    model = with_terms(MOTOR)
    true = replay(model, drive)
    measured = drive.signals._replace(effort=true.effort, position=true.position, velocity=true.motor_velocity)
    gain = np.array([[0.2, 0.0], [1.0, 1e-3], [0.0, 0.0], [0.0, 0.0]])
    seen = replay(model, drive_from(measured, model, REST), mode, gain=gain)  # type: ignore[arg-type]
    assert np.max(np.abs(seen.innovation / [4e-6, 2e-3])) < 1e-3
    # A wrong start is forgotten, and what is masked corrects nothing.
    holes = measured.position.copy()
    holes[200:260] = np.nan
    drive = drive_from(measured._replace(position=holes), model, REST)
    off = replay(model, drive, mode, gain=gain, x0=np.array([1e-3, 0, 0, 0, 0]))  # type: ignore[arg-type]
    assert abs(off.innovation[0, 0]) == pytest.approx(1e-3)
    assert abs(off.innovation[-1, 0]) < 1e-5
    assert np.isnan(off.innovation[200:260, 0]).all()
    assert np.isfinite(off.position).all()


def test_innovations_are_those_of_the_whole_replays() -> None:
    drive = drive_from(training("rotary", 100.0, 4.0, 1), ERA, REST)
    true = replay(with_terms(MOTOR), drive)
    holes = np.where((true.t > 1.0) & (true.t < 1.5), np.nan, true.position)
    measured = drive.signals._replace(effort=true.effort, position=holes, velocity=true.motor_velocity)
    models = [with_terms(MOTOR), ERA, with_terms(TermUse("backlash", {"half_width_rad": 1e-3}), OUTPUT, STRIBECK)]
    drive, gain, x0 = drive_from(measured, ERA, REST), np.full((4, 2), 1e-3), np.zeros((3, 9))
    whole = replay_many(models, drive, "predict", gain=gain, x0=x0)
    for hands in (1, 2):
        with at_once(hands):
            shown = innovations_of(models, drive, gain, x0)
        np.testing.assert_array_equal(shown, [trace.innovation for trace in whole])
    assert innovations_of([], drive, gain, x0[:0]).shape == (0, drive.t.size, 2)


def test_a_model_that_runs_away_is_not_a_number_from_there() -> None:
    t, r = wave(100.0, 8.0)
    wild = replace(ERA, controller=Controller(-1e7, 0.0, -1e5, 100.0))
    trace = replay(wild, commanded(t, r, wild))
    assert np.isfinite(trace.position[:2]).all()
    assert np.isnan(trace.position[-1])


def test_plant_changes_set_in_at_their_onset() -> None:
    t, r = wave(100.0, 8.0)
    heavy = with_terms(TermUse("output_inertia_change", {"ratio": 1.5}, onset=4.0))
    trace, plain = replay(heavy, commanded(t, r, ERA)), replay(ERA, commanded(t, r, ERA))
    np.testing.assert_array_equal(trace.effort[:401], plain.effort[:401])
    again = replay(
        replace(ERA, plant=replace(ERA.plant, output_inertia=600.0)),
        commanded(t, r, ERA),
        restarts=[400],
        states=plain.state[[400]],
    )
    np.testing.assert_allclose(trace.position[401:], again.position[401:], atol=1e-7)
