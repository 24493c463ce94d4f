"""The main job on recordings of real machines, where they are at hand: a verdict and a quality line each."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gsfdi.cli import run
from gsfdi.pipeline.analyze import analyze
from gsfdi.pipeline.baseline import baseline
from gsfdi.pipeline.ingest import ingest
from gsfdi.reconcile import reconcile

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))
import arm  # noqa: E402
import motor  # noqa: E402

REAL = Path(os.environ.get("GSFDI_REAL", ROOT / ".." / "shared" / "real"))
CONFIGS = ROOT / "configs"
pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason="the real recordings are not here")


def test_a_leader_and_its_followers(tmp_path: Path) -> None:
    arms = REAL / "jointstate_mcap"
    mappings = [CONFIGS / "leader_follower.toml", CONFIGS / "leader_follower_right.toml"]
    kept = ingest([str(arms)], store=tmp_path, mappings=mappings)
    assert len(kept.result["joints"]) == 2 * 14
    dead = [
        row["masked"].get("joint_velocity", {}) for row in kept.result["joints"] if row["joint"] == "gripper_finger"
    ]
    assert all("dead" in counts for counts in dead)
    joints = ["shoulder_lift", "elbow_flex", "gripper_finger"]
    baseline([str(arms / "leader_follower_75s.mcap")], store=tmp_path, mappings=mappings, joints=joints)
    later = str(arms / "leader_follower_38s.mcap")
    found = analyze([later], store=tmp_path, out=tmp_path, mappings=mappings, joints=joints).result["joints"]
    assert {(joint["robot"], joint["joint"]) for joint in found} == {
        (arm, joint) for arm in ("arm_left", "arm_right") for joint in joints
    }
    assert {joint["verdict"] for joint in found} <= {"normal", "not_assessed", "warning"}


def test_a_linear_drive(tmp_path: Path) -> None:
    model = CONFIGS / "emps_joint.toml"
    baseline([str(REAL / "emps" / "emps.parquet")], store=tmp_path, model=model)
    outcome = analyze([str(REAL / "emps" / "emps_pulses.parquet")], store=tmp_path, out=tmp_path, model=model)
    assert [joint["joint"] for joint in outcome.result["joints"]] == ["EMPS"]
    assert outcome.result["joints"][0]["says"]


def test_corrupt_rows_of_an_industrial_arm_are_named(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    corrupt = REAL / "ur10e" / "identification_data__ur-19_09_27-11_32_02.csv"
    call = ["--mapping", str(CONFIGS / "ur10e.toml"), "--store", str(tmp_path), "--joint", "J1", "--joint", "J2"]
    good = str(REAL / "ur10e" / "identification_data__ur-20_02_10-20sec_7harm.csv")
    assert run(["baseline", good, *call, "--jobs", "1", "--quiet"]) == 0
    capfd.readouterr()
    assert run(["analyze", str(corrupt), *call, "--out", str(tmp_path), "--json"]) == 3
    out, err = capfd.readouterr()
    assert corrupt.name in err
    assert "corrupt" in err
    found = json.loads(out)
    assert [joint["joint"] for joint in found["joints"]] == ["J1", "J2"]
    assert found["problems"]


def test_files_without_joints_are_told_so(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    talker = REAL / "rosbag2-mcap" / "rosbag2_py_test_resources_mcap_talker_talker.mcap"
    assert run(["ingest", str(talker), "--store", str(tmp_path)]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert "holds no joint telemetry" in err
    assert run(["ingest", str(talker), "--dry-run"]) == 0
    assert "/topic" in capfd.readouterr().out


def test_friction_of_an_arm_whose_drive_gain_is_unknown_holds_on_another_day() -> None:
    learnt, other = arm.recorded(arm.LEARNT), arm.recorded(arm.OTHERS[1])
    guess = replace(arm.GUESS, plant=replace(arm.GUESS.plant, torque_constant=20.0))
    model = reconcile([learnt], guess).updated_model
    assert model is not None
    sizes = {use.term: next(iter(use.values.values())) / model.plant.torque_constant for use in model.physics}
    assert sizes["viscous_friction"] == pytest.approx(2.3, rel=0.2)  # amperes per rad/s, by least squares on this file
    assert set(sizes) == {"viscous_friction", "coulomb_friction", "velocity_lag"}
    assert arm.missing(other, model) < 0.3 * arm.missing(other, guess)


def test_the_missing_torque_of_a_motor_has_the_orders_of_its_measured_cogging() -> None:
    angle, held = motor.map_of(motor.MAP)
    orders = np.arange(1.0, 41.0)
    known = motor.orders_of(angle, held, orders)
    sweep = motor.even("slow2_slower__nocomp_0", 50.0)
    found = motor.orders_of(sweep["position"], motor.lacking(sweep), orders)
    assert set(np.argsort(-found)[:5]) == set(np.argsort(-known)[:5])
    assert found[6] == pytest.approx(known[6], rel=0.1)


@pytest.mark.parametrize("rate", [None, 50.0, 25.0])
@pytest.mark.parametrize("name", motor.SWEEPS)
def test_cogging_is_named_in_the_leading_orders_of_its_measured_map(name: str, rate: float | None) -> None:
    answer = reconcile([motor.logged(name) if rate is None else motor.even(name, rate)], motor.NOMINAL)
    waves, known = motor.named(answer), motor.leading(motor.MAP, 5)
    slow = name.startswith("slow2_slower")
    count = 5 if slow else 4  # at 0.1 turns/s the rotor coasts through the finer ones
    assert set(list(waves)[:count]) <= set(known)
    assert len(waves) >= count
    assert waves[7.0] == pytest.approx(known[7.0], rel=0.1)
    assert answer.fit["after"]["motor_current_a"] < 0.4 * answer.fit["before"]["motor_current_a"]
