"""What every term of the shelf must keep, whoever writes it."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

import gsfdi
from gsfdi.model import JointModel, TermUse
from gsfdi.modelfile import load_models, terms
from gsfdi.motion import DIRECTION, QUANTITIES, SPEED, STATES, STIFFNESS, VALUE, PhysicsTerm, linear_name
from gsfdi.reconcile.offer import Offer, offers
from gsfdi.scales import Scales
from gsfdi.simulate import Drive, Start, drive_from, replay, replay_many
from gsfdi.training import training
from gsfdi.types import Array

ROOT = Path(gsfdi.__file__).parents[1]
ERA = load_models(ROOT / "configs" / "era_joint.toml").for_joint("era")
NAMES = sorted(terms())
DISSIPATIVE = [name for name in NAMES if terms()[name].dissipative]

# Where a term's start values do not show on the training motion, values that do.
PLAIN: dict[str, dict[str, float]] = {
    "end_stop": {"angle_rad": -0.2},
    "current_limit": {"limit_a": 0.08},
    "magnetic_saturation": {"current_a": 0.3},
    "torque_constant_drift": {"rate_per_s": -0.01, "onset_s": 5.0},
    "temperature_dependent_friction": {"coefficient_nms_rad": 100.0, "per_degc": -0.03},
    "asymmetric_friction": {"difference_nm": 1.0, "difference_nms_rad": 20.0},
    "quadratic_friction": {"coefficient_nms2_rad2": 500.0},
    "stiffening": {"cubic_per_rad2": 1e6},
    "position_dependent_friction": {"torque_nm": 4.0, "centre_rad": 0.1, "width_rad": 0.1},
    "transmission_error": {"order": 0.05},
    "cogging": {"order": 0.5},
    "torque_ripple": {"order": 0.5, "amplitude_ratio": 0.2},
    "encoder_eccentricity": {"order": 20.0},
}

# What is usual on a motion of the era's joint, and on one of a small rigid joint that runs warm.
USUAL = {
    "flexible": Scales(
        torque=100.0,
        effort=0.6,
        speed=0.05,
        reach=0.3,
        centre=0.1,
        windup=8e-4,
        inertia=400.0,
        critical=5700.0,
        period=0.01,
        seconds=30.0,
        turns=260.6,
        noise=4e-6,
        warms=False,
        returns=True,
    ),
    "rigid": Scales(
        torque=2.0,
        effort=2.0,
        speed=1.5,
        reach=1.2,
        centre=-0.4,
        windup=1.0,
        inertia=0.1,
        critical=math.inf,
        period=0.001,
        seconds=12.0,
        turns=1.0,
        noise=1e-5,
        warms=True,
        returns=True,
    ),
}


def plain(term: PhysicsTerm) -> dict[str, float]:
    """Values at which the term shows."""
    return {param.name: param.start for param in term.params} | PLAIN.get(term.name, {})


def with_term(name: str, values: dict[str, float]) -> JointModel:
    return replace(ERA, physics=(TermUse(name, values),))


def drive(seconds: float = 30.0) -> Drive:
    return drive_from(training("rotary", 100.0, seconds, 3), ERA, Start(0.0, 0.0, 0.0, 0.0, 0.0))


DRIVE = drive()


@pytest.mark.parametrize("name", NAMES)
def test_it_says_what_it_is(name: str) -> None:
    term = terms()[name]
    assert (ROOT / "gsfdi" / "terms" / f"{name}.py").is_file()
    assert term.component in ("motor", "friction", "gearbox", "link", "sensor")
    assert all((term.meaning, term.maintenance, term.source, term.signature))
    assert 1 <= len(term.params) <= 4
    for param in term.params:
        assert param.low <= param.start <= param.high
        assert param.typical > 0
        assert param.unit
        assert param.meaning
        assert term.param(linear_name(param.name)) is param
    assert not term.wave or term.wave in [param.name for param in term.params]
    if term.place in ("torque", "dry"):
        assert term.component != "friction" or term.sides


def test_the_shelf_is_the_contracts() -> None:
    contract = ROOT / ".." / "shared" / "contract" / "README.md"
    if not contract.is_file():
        pytest.skip("the contract is not beside the repository")
    for row in re.findall(r"^\| `(\w+)` \| (.+) \|$", contract.read_text(), re.MULTILINE):
        for entry in re.findall(r"`(\w+)`: ([^·]+)", row[1]):
            names = [re.match(r"\w+", part.strip())[0] for part in entry[1].split(",")]  # type: ignore[index]
            term = terms()[entry[0]]
            assert term.component == row[0]
            assert [name for name in names if name != "side"] == [param.name for param in term.numbers]
            assert ("side" in names) <= (term.sides == ("motor", "output"))


def tried(term: PhysicsTerm) -> list[tuple[Scales, Offer]]:
    """Every offer of the term on the usual motions of the joints that can have it."""
    motions = [USUAL[structure] for structure in term.structures]
    return [(scales, offer) for scales in motions for offer in offers(term, scales, {term.name: (1.0, 7.0)})]


@pytest.mark.parametrize("name", NAMES)
def test_it_is_tried_within_its_bounds(name: str) -> None:
    term = terms()[name]
    for _, offer in tried(term):
        for values in offer.columns:
            assert set(values) == {param.name for param in term.numbers}
            for param in term.numbers:
                assert param.low <= values[param.name] <= param.high


@pytest.mark.parametrize("name", NAMES)
def test_a_column_is_its_own_mix(name: str) -> None:
    for _, offer in tried(terms()[name]):
        for share, values in zip(np.eye(len(offer.columns)), offer.columns, strict=True):
            assert offer.mix(share) == pytest.approx(values, rel=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_a_fit_may_begin_where_it_is_tried(name: str) -> None:
    term = terms()[name]
    for scales, offer in tried(term):
        for values in offer.columns:
            for param in term.numbers:
                value = values[param.name]
                low, high = param.plausible(scales, value) if param.plausible else (param.low, param.high)
                assert max(low, param.low) <= value <= min(high, param.high)
                assert max(low, param.low) < min(high, param.high)
                assert param.step is None or 0 < param.step(scales) < math.inf


def motions(rng: np.random.Generator, count: int) -> Array:
    m = rng.normal(size=(count, QUANTITIES))
    m[:, STIFFNESS] = 1e5
    m[:, DIRECTION] = np.where(m[:, SPEED] >= 0, 1.0, -1.0)
    return m


def drawn(term: PhysicsTerm, rng: np.random.Generator) -> Array:
    """Values within bounds, about the typical size."""
    return np.array(
        [
            np.clip(param.start * rng.uniform(0.2, 5.0) + 1e-9, param.low, param.high)
            if param.low >= 0
            else rng.uniform(max(param.low, -5 * param.typical), min(param.high, 5 * param.typical))
            for param in term.params
        ]
    )


@pytest.mark.parametrize("name", NAMES)
def test_its_law_is_finite(name: str) -> None:
    term, rng = terms()[name], np.random.default_rng(1)
    for m in motions(rng, 200):
        assert math.isfinite(term.law(m, drawn(term, rng), np.full(STATES, np.nan)))


@pytest.mark.parametrize("name", [name for name in NAMES if terms()[name].place == "dry"])
def test_a_friction_that_minds_its_direction_says_so(name: str) -> None:
    term, rng = terms()[name], np.random.default_rng(3)
    p, forth = drawn(term, rng), motions(rng, 20)
    back = forth.copy()
    back[:, DIRECTION] *= -1
    levels = [[term.law(m, p, np.full(STATES, np.nan)) for m in way] for way in (forth, back)]
    assert term.sided == (levels[0] != levels[1])


@pytest.mark.parametrize("name", NAMES)
def test_linear_parameters_enter_linearly(name: str) -> None:
    term, rng = terms()[name], np.random.default_rng(2)
    for i, param in enumerate(term.params):
        if not param.linear:
            continue
        for m in motions(rng, 20):
            p = drawn(term, rng)
            values = []
            for x in (0.0, 0.5, 1.0):
                p[i] = param.typical * x if param.low >= 0 else param.typical * (x - 0.5)
                if name == "torque_constant_drift":
                    p[i] *= 0.01
                values.append(term.law(m.copy(), p, np.full(STATES, np.nan)))
            assert values[1] == pytest.approx(0.5 * (values[0] + values[2]), abs=1e-9 * (1 + abs(values[2])))


@pytest.mark.parametrize("name", NAMES)
def test_neutral_does_nothing(name: str) -> None:
    term = terms()[name]
    neutral = {param.name: param.neutral for param in term.params if param.neutral is not None}
    if not neutral:
        pytest.skip("no value of a parameter alone switches it off")
    quiet = replay(with_term(name, plain(term) | neutral), drive(6.0))
    without = replay(ERA, drive(6.0))
    np.testing.assert_allclose(quiet.effort, without.effort, atol=2e-6)
    np.testing.assert_allclose(quiet.position, without.position, atol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_it_shows(name: str) -> None:
    trace, without = replay(with_term(name, plain(terms()[name])), DRIVE), replay(ERA, DRIVE)
    assert np.isfinite(trace.effort).all()
    change = max(np.ptp(trace.effort - without.effort) / 2e-4, np.ptp(trace.position - without.position) / 4e-6)
    offset = np.max(np.abs(trace.effort - without.effort)) / 2e-4
    assert max(change, offset, np.max(np.abs(trace.motor_velocity - without.motor_velocity)) / 2e-3) > 3.0


@pytest.mark.parametrize("name", NAMES)
def test_it_sets_in(name: str) -> None:
    use = TermUse(name, plain(terms()[name]) | ({"onset_s": 10.0} if "drift" in name else {}), onset=10.0)
    late, without = replay(replace(ERA, physics=(use,)), DRIVE), replay(ERA, DRIVE)
    before = DRIVE.t < 10.0
    np.testing.assert_allclose(late.effort[before], without.effort[before], atol=5e-6)
    signals = ("motor_velocity",) if terms()[name].place == "late_velocity_sensor" else ("effort", "position")
    assert sum(np.max(np.abs(getattr(late, x) - getattr(without, x))) for x in signals) > 1e-6


@pytest.mark.parametrize("name", DISSIPATIVE)
@settings(max_examples=12, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**31), side=st.sampled_from(["motor", "output"]))
def test_it_never_adds_energy(name: str, seed: int, side: str) -> None:
    term, rng = terms()[name], np.random.default_rng(seed)
    values = dict(zip([param.name for param in term.params], map(float, drawn(term, rng)), strict=True))
    use = TermUse(name, values, side if term.sides == ("motor", "output") else None)  # type: ignore[arg-type]
    model = replace(ERA, physics=(use,))
    # A wound-up joint whose motor runs while its link is still at rest, left to itself.
    speed = rng.normal(0.0, 0.02)
    start = np.array([rng.normal(0.0, 0.1), speed, rng.normal(0.0, 1e-3), -speed, 0.0])
    idle = training("rotary", 100.0, 5.0, 0)
    still = idle._replace(effort=np.zeros(idle.t.size))
    state = replay(model, drive_from(still, ERA, Start(0, 0, 0, 0, 0)), "open_loop", x0=start).state
    plant = ERA.plant
    energy = 0.5 * plant.gear_ratio**2 * plant.motor_inertia * state[:, 1] ** 2
    energy += 0.5 * plant.output_inertia * (state[:, 1] + state[:, 3]) ** 2 + 0.5 * plant.stiffness * state[:, 2] ** 2
    assert np.max(energy) <= energy[0] * (1 + 2e-3)


@pytest.mark.parametrize("name", NAMES)
def test_its_parameters_come_back(name: str) -> None:
    """From data it made, with the sensors' own noise, starting 20 % off."""
    term = terms()[name]
    truth = plain(term)
    free = [param for param in term.params if truth[param.name] != 0.0 or param.linear]
    if name == "quantisation":
        free = []  # a staircase has no slope to follow: see test_quantisation_comes_back
    if not free:
        pytest.skip("nothing to search along a slope")
    made = replay(with_term(name, truth), DRIVE)
    rng = np.random.default_rng(7)
    scale = np.array([4e-6, 2e-3, 2e-4])

    def columns(trace: object) -> Array:
        rows = [getattr(trace, key) for key in ("position", "motor_velocity", "effort")]
        return np.concatenate([row / s for row, s in zip(rows, scale, strict=True)])

    data = columns(made) + rng.standard_normal(3 * DRIVE.t.size)
    unit = np.array([abs(truth[param.name]) or param.typical for param in free])

    def model_of(x: Array) -> JointModel:
        return with_term(name, truth | {param.name: v for param, v in zip(free, x * unit, strict=True)})

    def slope(x: Array) -> Array:
        steps = 1e-4 * np.eye(x.size)
        traces = replay_many([model_of(x)] + [model_of(x + step) for step in steps], DRIVE)
        base = columns(traces[0])
        return np.column_stack([(columns(trace) - base) / 1e-4 for trace in traces[1:]])

    goal = np.array([truth[param.name] for param in free]) / unit
    begin = goal * np.array([1.02 if param.name in ("order", "ratio") else 1.1 for param in free]) + 0.02
    fit = least_squares(lambda x: columns(replay(model_of(x), DRIVE)) - data, begin, jac=slope, max_nfev=30)
    spread = np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
    assert np.all(np.abs(fit.x - goal) <= np.maximum(4.5 * spread, 2e-3))
    assert abs(fit.x[0] - goal[0]) < max(0.03, 3.0 * spread[0])


def test_quantisation_comes_back() -> None:
    made = replay(with_term("quantisation", {"step_rad": 1e-4}), DRIVE).position
    sizes = np.abs(np.diff(np.unique(np.round(made, 12))))
    assert np.min(sizes) == pytest.approx(1e-4)


def test_maps_of_two_sensors_act_in_turn() -> None:
    m, s = np.zeros(QUANTITIES), np.zeros(STATES)
    m[VALUE] = 2.0
    assert terms()["position_gain"].law(m, np.array([1.5]), s) == 3.0
    assert terms()["position_bias"].law(m, np.array([0.5]), s) == 2.5
