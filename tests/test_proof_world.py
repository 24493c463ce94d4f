"""The proof's worlds: their own code, their own physics, and cases that hide what they say they hide."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

import gsfdi
from gsfdi.modelfile import load_models
from gsfdi.proof.cases import Design, draw, scales_of, truth_of, write_files
from gsfdi.proof.concealment import concealment
from gsfdi.proof.kinds import KINDS
from gsfdi.proof.mechanics import TURN, stop_by_friction
from gsfdi.proof.motions import draw as draw_motion
from gsfdi.proof.world import Effect, Joint, Motion, World, filtered, run

HOME = Path(gsfdi.__file__).parent
OPPONENT = (
    "effects",
    "mechanics",
    "integrator",
    "world",
    "motions",
    "sizes",
    "kinds",
    "joints",
    "cases",
    "concealment",
    "mujoco_world",
)
GROUND = {"gsfdi.channels", "gsfdi.types", "gsfdi.errors"}


@pytest.fixture(scope="module")
def motion() -> Motion:
    return draw_motion(np.random.default_rng(3), 40.0, 100.0, 0.4, 0.06)


def modules_of(path: Path) -> set[str]:
    """Modules of gsfdi that a file imports, wherever in it."""
    tree = ast.parse(path.read_text())
    found = {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    found |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    return {module for module in found if module.startswith("gsfdi")}


@pytest.mark.parametrize("name", OPPONENT)
def test_worlds_share_no_code_with_the_simulator(name: str) -> None:
    modules = modules_of(HOME / "proof" / f"{name}.py")
    assert {module for module in modules if not module.startswith("gsfdi.proof")} <= GROUND


def test_only_the_pipeline_knows_of_the_proof() -> None:
    for path in HOME.rglob("*.py"):
        if "proof" not in path.parts and path.name != "prove.py":
            assert not any(module.startswith("gsfdi.proof") for module in modules_of(path)), path


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    case = draw(Design("single", ("backlash",)), 7)
    write_files(case, tmp_path / "a")
    write_files(draw(Design("single", ("backlash",)), 7), tmp_path / "b")
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_the_step_is_short_enough(motion: Motion) -> None:
    """A tenth of the step changes nothing that a sensor would notice."""
    joint = Joint()
    coarse, fine = (run(World(joint), motion, 0, noisy=False, limit_step=step) for step in (5e-4, 5e-5))
    assert np.abs(coarse - fine)[:, 0].max() < 0.02 * joint.position_noise
    assert np.abs(coarse - fine)[:, 2].max() < 0.02 * joint.effort_noise


def test_the_step_is_short_enough_for_a_friction_that_turns_smoothly() -> None:
    """A stiff rigid joint, of which a speed of 5e-4 rad/s decays within a millisecond."""
    motion = draw_motion(np.random.default_rng(3), 40.0, 125.0, 0.8, 0.7)
    joint = Joint(
        "rigid", "rotary", 0.0, 1.0, 3.0, damping=0.0, torque_constant=1.0, proportional=3000.0, integral=900.0,
        derivative=240.0, sample_rate=125.0, effort="drive_torque", effort_noise=0.05,
    )  # fmt: skip
    world = World(joint, (Effect("coulomb_friction", {"torque_nm": 3.0}),), smooth=True)
    coarse, fine = (run(world, motion, 0, noisy=False, limit_step=step)[:, 2] for step in (5e-4, 2e-5))
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.05 * joint.effort_noise


def test_friction_holds_a_joint_still() -> None:
    """Dry friction above the drive's torque sticks exactly; below it, the joint moves."""
    n = 1000
    t = np.arange(n) / 100.0
    still = Motion(t, np.full(n, 0.0), np.zeros(n), np.full(n, 0.01), np.full(n, 20.0))  # 1.6 N m of feed-forward
    joint = Joint(proportional=0.0, integral=0.0, derivative=0.0)
    stuck = run(World(joint, effects=(Effect("coulomb_friction", {"torque_nm": 2.0}, "motor"),)), still, 0, noisy=False)
    free = run(World(joint, effects=(Effect("coulomb_friction", {"torque_nm": 1.0}, "motor"),)), still, 0, noisy=False)
    assert np.ptp(stuck[:, 4]) == 0.0
    assert np.ptp(free[:, 4]) > 1e-3


@pytest.mark.parametrize("before", [0.3, 0.0, -0.9])
@pytest.mark.parametrize("push", [-5.0, -0.5, 5.0])
def test_friction_turns_when_the_motion_does_and_not_a_step_earlier(before: float, push: float) -> None:
    def after(steps: int) -> float:
        speed, h = before, 1.0 / steps
        for _ in range(steps):
            speed = stop_by_friction(speed, speed + h * push, h * 2.0, h * 2.0, False)
        return speed

    assert after(1) == pytest.approx(after(64), abs=1e-12)


def test_smooth_friction_creeps_where_a_sudden_one_holds() -> None:
    """Under 1.56 N m of drive it gives way at the speed at which it has built up to that."""
    n = 1000
    t = np.arange(n) / 100.0
    still = Motion(t, np.full(n, 0.0), np.zeros(n), np.full(n, 0.01), np.full(n, 20.0))
    joint = Joint(proportional=0.0, integral=0.0, derivative=0.0)
    friction = Effect("coulomb_friction", {"torque_nm": 2.0}, "motor")
    traces = run(World(joint, effects=(friction,), smooth=True), still, 0, noisy=False)
    drive = 0.01 * joint.gear_ratio * joint.torque_constant
    assert np.gradient(traces[-300:, 4], t[-300:]).mean() == pytest.approx(TURN * np.arctanh(drive / 2.0), rel=1e-3)


def test_backlash_shows_its_width() -> None:
    """Pushed from the outside either way, the wind-up differs by both half widths and the spring's own twist."""
    n = 4000
    t = np.arange(n) / 100.0
    still = Motion(t, np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, 20.0))
    gap = Effect("backlash", {"half_width_rad": 1e-3})
    damper = Effect("gearbox_damping", {"coefficient_nms_rad": 3000.0})
    ends = []
    for torque in (20.0, -20.0):
        load = Effect("constant_load", {"torque_nm": torque})
        traces = run(World(Joint(), effects=(gap, damper, load)), still, 0, noisy=False)
        ends.append(traces[-1, 3])
    assert ends[1] - ends[0] == pytest.approx(2 * (1e-3 + 20.0 / 130000.0), rel=0.02)


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_acts_and_stays_finite(name: str) -> None:
    case = draw(Design("single", (name,), "plain"), 11)
    with_it, without = case.runs(noisy=False), case.runs(case.world.without(), noisy=False)
    assert all(np.isfinite(traces).all() for traces in with_it)
    if KINDS[name].family == "controller":
        assert case.world.joint != case.nominal
    else:
        change = max(np.abs(a - b)[:, :3].max() for a, b in zip(with_it, without, strict=True))
        assert change > 0.0 or name == "quantisation"
    json.dumps(truth_of(case), allow_nan=False)


@pytest.mark.parametrize("seed", range(4))
def test_nominal_models_are_model_files(seed: int, tmp_path: Path) -> None:
    case = draw(Design("null"), seed)
    write_files(case, tmp_path)
    model = load_models(tmp_path / "nominal.toml").for_joint("J1")
    joint = case.world.joint
    assert model.structure == joint.structure
    assert 0.015 < abs(model.plant.output_inertia / joint.output_inertia - 1.0) < 0.06


def test_effects_hide_behind_the_controller() -> None:
    """Cogging moves the tracking error by little and the current by many times its noise."""
    case = draw(Design("single", ("cogging",), "plain"), 0)
    seen, oracle = concealment(case)
    assert abs(seen.tracking) < 0.05
    assert seen.effort > 5.0
    assert seen.visible > 100.0
    assert all(value > 0.0 for value in oracle.values())


def test_a_null_hides_nothing() -> None:
    assert concealment(draw(Design("null"), 5))[0].visible == 0.0


def test_scales_are_the_joints_own(motion: Motion) -> None:
    scales = scales_of(World(Joint()), (motion,))
    assert scales.speed < 0.07
    assert scales.torque > 0.0


@pytest.mark.parametrize("lag", [1e-6, 0.01, 0.5])
def test_a_lag_of_the_speed_is_that_of_the_filter_however_short(lag: float) -> None:
    t = np.sort(np.r_[0.0, 3.0, np.random.default_rng(1).uniform(0.0, 3.0, 300)])
    traces, noise = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    traces[:, 1] = np.sin(3.0 * t)
    exact = np.imag(np.exp(3j * t) / (1 + 3j * lag))
    exact -= exact[0] * np.exp(-t / lag)
    slow = filtered(t, traces, noise, Effect("velocity_lag", {"lag_s": lag}))
    np.testing.assert_allclose(slow[:, 1], exact, atol=1e-5)
