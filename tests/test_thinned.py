"""Logs slower than their controller: names stay right, and nothing is named where nothing is wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from joints import MODEL

from gsfdi.model import JointModel, TermUse
from gsfdi.modelfile import load_models
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.thinned import calmed, unseen_jumps
from gsfdi.reconcile.unheld import unheld
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord


def looped(rate: float = 500.0) -> JointModel:
    """Give the joint of the paper in a loop of so many ticks a second."""
    model = load_models(Path(__file__).parents[1] / "configs" / "era_joint.toml").for_joint("era-joint")
    assert model.controller is not None
    return replace(model, controller=replace(model.controller, sample_rate=rate))


def thinned(record: JointRecord, stride: int) -> JointRecord:
    channels = {name: record[name][::stride] for name in record.channels}
    return replace(record, t=record.t[::stride], channels=channels, valid={})


@pytest.mark.parametrize("fault", [None, TermUse("coulomb_friction", {"torque_nm": 6.0}, side="motor")])
def test_a_log_of_every_fifth_effort_tells_what_is_missing_and_no_more(fault: TermUse | None) -> None:
    model = looped()
    record = thinned(simulate_record(model, duration=40.0, faults=[fault] if fault else [], seed=9), 5)
    found = reconcile([record], model)
    assert [entry["term"] for entry in found.omitted_physics] == ([fault.term] if fault else [])
    if fault:
        assert found.omitted_physics[0]["parameters"]["torque_nm"]["value"] == pytest.approx(6.0, rel=0.05)


def wavy(noise: float) -> tuple[np.ndarray, JointRecord]:
    t = np.arange(600) / 100
    effort = 0.1 * np.sin(2 * t) + np.where(t > 3.0, 0.5, 0.0)
    seen = effort + noise * np.random.default_rng(2).standard_normal(t.size)
    return effort, JointRecord("r", "j", 0, t, {"position": t, "motor_current": seen})


def test_a_smooth_effort_loses_its_noise_and_a_jump_stays() -> None:
    effort, record = wavy(noise=1e-3)
    calm = calmed(record)["motor_current"]
    left = np.abs(calm - effort)
    assert np.std(left[20:280]) < 0.5e-3
    assert calm[300] - calm[299] == pytest.approx(record["motor_current"][300] - record["motor_current"][299], abs=4e-3)
    assert left.max() < 5e-3


def test_only_beside_a_jump_is_the_mean_effort_in_doubt() -> None:
    doubt = unseen_jumps(wavy(noise=1e-3)[1]["motor_current"])
    np.testing.assert_array_equal(np.abs(np.flatnonzero(doubt) - 300) < 8, True)
    assert doubt.max() == pytest.approx(0.5 / 12**0.5, rel=0.05)


@pytest.mark.parametrize(("rate", "ticks"), [(100.0, 1), (200.0, 2), (1000.0, 10)])
def test_how_many_efforts_a_log_lacks_is_told_without_the_law(rate: float, ticks: int) -> None:
    model = looped(rate)
    rubbing = TermUse("coulomb_friction", {"torque_nm": 10.0}, side="motor")
    record = thinned(simulate_record(model, duration=40.0, faults=[rubbing], seed=3), ticks)
    nobody = replace(model, controller=None)
    running = unheld(bench([record], nobody), nobody)
    if ticks == 1:
        assert running is None
    else:
        assert running is not None
        t, share = record.t, (ticks - 1) / (2 * ticks)
        sooner = np.interp(t + share / 100, t, calmed(record)["motor_current"])
        later = np.interp(t, t, record["motor_current"])
        left = [float(np.std(running[0]["motor_current"] - effort)) for effort in (sooner, later)]
        assert left[0] < 0.3 * left[1]


@pytest.mark.parametrize("rate", [100.0, 500.0])
@pytest.mark.parametrize(
    "missing",
    [
        TermUse("velocity_lag", {"lag_s": 0.00268}),
        TermUse("quadratic_friction", {"coefficient_nms2_rad2": 1150.0}, side="motor"),
    ],
)
def test_what_is_missing_is_not_taken_for_efforts_that_run_on(missing: TermUse, rate: float) -> None:
    """Held ones of a joint whose speed lags had been taken to run on, and a delay of 3.3 ms was told besides."""
    ticks, rubbing = round(rate / 100), TermUse("coulomb_friction", {"torque_nm": 2.0}, side="motor")
    nobody = replace(looped(rate), physics=(rubbing,), controller=None)
    record = thinned(simulate_record(replace(looped(rate), physics=(rubbing, missing)), duration=60.0, seed=26), ticks)
    assert (unheld(bench([record], nobody), nobody) is None) is (ticks == 1)


def test_without_a_law_a_sound_joint_of_a_faster_loop_lacks_nothing() -> None:
    model = looped()
    record = thinned(simulate_record(model, duration=40.0, seed=9), 5)
    channels = {name: record[name] for name in record.channels if not name.startswith("setpoint")}
    found = reconcile([replace(record, channels=channels)], replace(model, controller=None))
    assert found.verdict == "no_mismatch"


def test_a_lost_effort_is_as_far_off_the_line_between_its_neighbours_as_others_are() -> None:
    whole = simulate_record(MODEL, seed=1, duration=20.0)
    effort = 0.1 + 0.01 * np.random.default_rng(1).standard_normal(len(whole.t))
    effort[[999, 1001]] = 0.1
    kept = np.arange(len(whole.t)) != 1000
    channels = {**whole.channels, "motor_current": effort}
    record = replace(whole, t=whole.t[kept], channels={n: v[kept] for n, v in channels.items()}, valid={})
    stand = bench([record], MODEL)
    after = int(np.searchsorted(stand.records[0].t, whole.t[1001] - 1e-6))
    scale = stand.scales.torque / stand.scales.effort
    assert stand.shaken[0][after] == pytest.approx(np.sqrt(1.5) * 0.01 * scale, rel=0.1)
    assert np.count_nonzero(stand.shaken[0]) == 3
