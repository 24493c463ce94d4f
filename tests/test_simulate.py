from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gsfdi
from gsfdi.errors import UnusableInputError
from gsfdi.model import Bus, TermUse
from gsfdi.modelfile import dump, load_models
from gsfdi.simulate import drive_of, fault_of, replay, simulate_record
from gsfdi.types import JointRecord

ROOT = Path(gsfdi.__file__).parents[1]
ERA = load_models(ROOT / "configs" / "era_joint.toml").for_joint("SH1")
EMPS = load_models(ROOT / "configs" / "emps_joint.toml").for_joint("EMPS")
HEALTHY = simulate_record(ERA, seed=1, duration=30.0)


def test_the_same_seed_gives_the_same_bytes() -> None:
    model = replace(ERA, bus=Bus(0.01, 1e-3, 0.02, 0.01))
    one, two = simulate_record(model, seed=5, duration=10.0), simulate_record(model, seed=5, duration=10.0)
    assert one.t.tobytes() == two.t.tobytes()
    assert {k: v.tobytes() for k, v in one.channels.items()} == {k: v.tobytes() for k, v in two.channels.items()}
    other = simulate_record(model, seed=6, duration=10.0)
    assert one.t.tobytes() != other.t.tobytes()


def test_telemetry_carries_noise_and_resolution() -> None:
    clean = replay(ERA, drive_of(HEALTHY, ERA))
    assert np.std(HEALTHY["position"] - clean.position) == pytest.approx(4e-6, rel=0.6)
    assert np.std(HEALTHY["motor_velocity"] - clean.motor_velocity) == pytest.approx(2e-3, rel=0.3)
    steps = HEALTHY["position"] / 1e-6
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
    assert set(HEALTHY.channels) == {
        "setpoint",
        "setpoint_rate",
        "position",
        "motor_velocity",
        "motor_current",
        "temperature",
    }


def test_a_replay_of_a_recording_is_that_recording() -> None:
    again = simulate_record(ERA, replay=HEALTHY, seed=9)
    assert again.t0_ns == HEALTHY.t0_ns
    np.testing.assert_array_equal(again["setpoint"], HEALTHY["setpoint"])
    assert np.std(again["position"] - HEALTHY["position"]) < 2 * 4e-6
    assert np.std(again["motor_current"] - HEALTHY["motor_current"]) < 6e-4  # the noise that the controller passes on


def test_a_replay_from_the_middle_starts_in_motion() -> None:
    """Spring, speed and integrator are taken from the first samples, with terms in the model or without."""
    uses = (
        TermUse("coulomb_friction", {"torque_nm": 3.0}, "motor"),
        TermUse("gravity_unbalance", {"torque_nm": 40.0, "angle_rad": 0.2}),
    )
    for model in (ERA, replace(ERA, physics=uses)):
        whole = simulate_record(model, seed=3, duration=40.0)
        part = slice(1500, None)
        late = JointRecord(
            "r", "SH1", 0, whole.t[part] - whole.t[1500], {k: v[part] for k, v in whole.channels.items()}
        )
        trace = replay(model, drive_of(late, model))
        assert np.std(trace.position - late["position"]) < 3e-5
        assert np.std(trace.effort[50:] - late["motor_current"][50:]) < 3e-3


def test_open_loop_drives_the_recorded_current() -> None:
    again = simulate_record(ERA, replay=HEALTHY, seed=9, open_loop=True)
    assert np.std(again["motor_current"] - HEALTHY["motor_current"]) < 4e-4
    assert np.max(np.abs(again["position"] - HEALTHY["position"])) < 5e-3


def test_multiple_shooting_starts_from_recorded_states() -> None:
    drive = drive_of(HEALTHY, ERA)
    shots = replay(ERA, drive, "open_loop", restarts=range(0, 2800, 200))
    apart = shots.position - HEALTHY["position"]
    assert np.max(np.abs(apart)) < 1e-4
    free = replay(ERA, drive, "open_loop").position - HEALTHY["position"]
    assert np.std(apart) < 0.2 * np.std(free)


def test_the_papers_drift_hides_behind_the_loop() -> None:
    faulty = simulate_record(ERA, replay=HEALTHY, seed=1, faults=[fault_of("torque_constant_drift=-0.01@7.5")])
    before = HEALTHY.t < 7.5
    np.testing.assert_allclose(faulty["motor_current"][before], HEALTHY["motor_current"][before], atol=3e-3)
    late = HEALTHY.t > 20
    assert np.std(faulty["motor_current"][late]) > 1.1 * np.std(HEALTHY["motor_current"][late])
    assert np.std((faulty["position"] - HEALTHY["position"])[late]) < 0.01 * np.std(HEALTHY["position"][late])


def test_a_linear_rigid_drive_carries_force() -> None:
    record = simulate_record(EMPS, seed=2, duration=5.0, faults=[fault_of("coulomb_friction=20,side=output", "linear")])
    assert record.axis == "linear"
    assert "drive_torque" in record
    assert "motor_velocity" not in record
    assert np.max(np.abs(record["setpoint"] - record["position"])) < 5e-4


def test_a_model_written_by_hand_and_by_dump_simulate_alike(tmp_path: Path) -> None:
    model = replace(
        ERA, physics=(TermUse("backlash", {"half_width_rad": 1e-3}), TermUse("cogging", {"amplitude_nm": 1.0}))
    )
    dump(model, tmp_path / "m.toml")
    again = load_models(tmp_path / "m.toml").for_joint("SH1")
    one, two = (simulate_record(m, seed=1, duration=5.0)["position"] for m in (model, again))
    np.testing.assert_array_equal(one, two)


def test_what_cannot_be_simulated_is_refused() -> None:
    with pytest.raises(UnusableInputError, match="needs a controller"):
        simulate_record(replace(ERA, controller=None))
    no_setpoint = JointRecord("r", "SH1", 0, HEALTHY.t, {"position": HEALTHY["position"]})
    with pytest.raises(UnusableInputError, match="no setpoint"):
        simulate_record(ERA, replay=no_setpoint)
    with pytest.raises(UnusableInputError, match="no motor_current"):
        simulate_record(ERA, replay=no_setpoint, open_loop=True)
    with pytest.raises(UnusableInputError, match="a rigid joint has none"):
        simulate_record(EMPS, faults=[fault_of("backlash=1e-3", "linear")], duration=2.0)
    assert ERA.controller is not None
    wild = replace(ERA, controller=replace(ERA.controller, proportional=-1e7))
    with pytest.raises(UnusableInputError, match="runs away"):
        simulate_record(wild, duration=10.0)
