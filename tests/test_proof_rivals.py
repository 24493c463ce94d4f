"""The rivals: that they are fair, and that MuJoCo's world and the real recordings are asked as the own world is."""

import os
from pathlib import Path

import numpy as np
import pytest

from gsfdi.modelfile import load_models
from gsfdi.proof import mujoco_world
from gsfdi.proof.cases import Design, draw, write_files
from gsfdi.proof.motions import draw as draw_motion
from gsfdi.proof.real import COVERS, friction, trials
from gsfdi.proof.rivals import best, rivals, sparse
from gsfdi.proof.world import Effect, Joint, World, run

REAL = Path(os.environ.get("GSFDI_REAL", Path(__file__).parents[2] / "shared" / "real")) / "emps"


def test_rivals_find_what_is_plain() -> None:
    """On clean columns both regressions are right: what they get wrong on cases is the cases' doing."""
    rng = np.random.default_rng(0)
    library = {name: rng.standard_normal((500, 1)) for name in ("a", "b", "c")}
    remainder = 3.0 * library["b"][:, 0] + 1e-3 * rng.standard_normal(500)
    assert sparse(remainder, library) == ["b"]
    assert best(remainder, library) == "b"


@pytest.mark.thorough
def test_every_rival_answers_a_case(tmp_path: Path) -> None:
    write_files(draw(Design("single", ("coulomb_friction",)), 3), tmp_path)
    known = load_models(tmp_path / "nominal.toml").for_joint("J1").controller is not None
    said = rivals(tmp_path)
    assert set(said) == {"sparse regression", "best RMSE"} | ({"tracking error"} if known else set())
    assert all(said.values())


@pytest.mark.skipif(not mujoco_world.available(), reason="MuJoCo is not installed")
@pytest.mark.parametrize(
    "effects",
    [
        (),
        (Effect("viscous_friction", {"coefficient_nms_rad": 60.0}, "motor"),),
        (Effect("cogging", {"amplitude_nm": 5.0, "order": 4.0, "phase_rad": 0.3}),),
        (Effect("structural_mode", {"inertia_kg_m2": 60.0, "frequency_hz": 2.0, "damping_ratio": 0.02}),),
    ],
    ids=["nothing", "viscous", "cogging", "mode"],
)
def test_two_worlds_agree(effects: tuple[Effect, ...]) -> None:
    """The own integrator and MuJoCo's Runge-Kutta: far below what the sensors could tell apart."""
    motion = draw_motion(np.random.default_rng(3), 8.0, 100.0, 0.3, 0.06)
    joint = Joint(damping=0.0)
    own = run(World(joint, effects=effects), motion, 1, noisy=False)
    other = mujoco_world.run_mujoco(World(joint, effects=effects), motion, 1, noisy=False)
    assert np.abs(own - other)[:, 0].max() < 0.1 * joint.position_noise
    assert np.abs(own - other)[:, 2].max() < 0.1 * joint.effort_noise


@pytest.mark.skipif(not mujoco_world.available(), reason="MuJoCo is not installed")
@pytest.mark.parametrize("name", ["backlash", "presliding_friction"])
def test_mujoco_plays_its_own_laws(name: str) -> None:
    case = draw(Design("mujoco", (name,)), 2)
    assert np.isfinite(case.recorded(noisy=False)[0]).all()


@pytest.mark.skipif(not REAL.is_dir(), reason="the real recordings are not here")
def test_each_trial_withholds_one_term_of_the_real_drive(tmp_path: Path) -> None:
    mass, physics = friction(REAL / "emps.parquet")
    assert 90.0 < mass < 100.0
    assert {entry["term"] for entry in physics} == set(COVERS)
    for withheld, files in trials(REAL):
        (tmp_path / "nominal.toml").write_bytes(files["nominal.toml"])
        held = {use.term for use in load_models(tmp_path / "nominal.toml").for_joint("emps").physics}
        assert held == set(COVERS) - {withheld}
