from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from joints import MODEL, PLANT, gathered, learnt, record

from gsfdi.baseline import learn_joint, part_of
from gsfdi.diagnosis import Limits, assess, unjudged
from gsfdi.diagnosis.case import case_of
from gsfdi.diagnosis.judging import findings_of
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord, Verdict


def judged(*faults: str, seed: int = 100, duration: float = 40.0) -> Verdict:
    return assess(record(*faults, seed=seed, duration=duration), learnt())


def changed(batch: JointRecord, **channels: np.ndarray) -> JointRecord:
    return JointRecord(batch.robot, batch.joint, batch.t0_ns, batch.t, {**batch.channels, **channels}, batch.axis)


def test_a_healthy_joint_is_normal() -> None:
    verdict = judged()
    assert (verdict.verdict, verdict.action, verdict.fault) == ("normal", "none", None)
    assert set(verdict.methods) == {"signal", "parity", "smi"}


def test_the_papers_drift_is_found_named_and_dated() -> None:
    verdict = judged("torque_constant_drift=-0.01@7.5")
    assert verdict.fault == "torque_constant_drift"
    assert verdict.component == "motor"
    assert verdict.onset_s == pytest.approx(7.5, abs=1.0)
    assert verdict.verdict in ("distress", "critical")
    assert not verdict.methods["signal"]["alarm"], "the paper's point: signal analysis does not see it"
    assert "current_gain" in [one["fault"] for one in verdict.alternatives]


@pytest.mark.parametrize(
    ("given", "component"),
    [
        ("torque_constant_change=0.95", "motor"),
        ("output_inertia_change=1.1", "link"),
        ("stiffness_change=0.8", "gearbox"),
        ("motor_inertia_change=1.2", "motor"),
        ("coulomb_friction=1", "friction"),
        ("viscous_friction=30", "friction"),
        ("cogging=2", "motor"),
        ("transmission_error=2e-5", "gearbox"),
        ("velocity_gain=1.02", "sensor"),
        ("velocity_bias=0.01", "sensor"),
    ],
)
def test_failures_are_named(given: str, component: str) -> None:
    verdict = judged(given)
    assert verdict.fault == given.partition("=")[0]
    assert verdict.component == component
    assert verdict.fault_probability is not None
    assert verdict.fault_probability > 0.5


def test_an_onset_within_the_batch_is_found() -> None:
    assert judged("torque_constant_change=0.8@20").onset_s == pytest.approx(20.0, abs=0.6)


def test_what_the_data_cannot_exclude_is_listed() -> None:
    verdict = judged("position_gain=1.01")
    named = [verdict.fault, *(one["fault"] for one in verdict.alternatives)]
    assert "position_gain" in named
    assert verdict.component == "sensor"


def test_severity_follows_the_size() -> None:
    levels = [judged(f"torque_constant_change={ratio}").verdict for ratio in (0.97, 0.85, 0.6)]
    assert levels == ["warning", "distress", "critical"]


def test_a_declared_payload_is_no_fault() -> None:
    batch = record("output_inertia_change=1.1", seed=101)
    named = assess(batch, learnt(), limits=Limits(payload_free=True)).fault
    assert named != "output_inertia_change"


def test_without_a_baseline_nothing_is_normal() -> None:
    verdict = assess(record(seed=102), None)
    assert verdict.verdict == "not_assessed"
    assert "baseline" in verdict.says
    assert verdict.joint == "SH1"


def test_old_telemetry_is_stale() -> None:
    batch = record(seed=103)
    later = batch.t0_ns + 30 * 86_400 * 10**9
    assert assess(batch, learnt(), now_ns=later).verdict == "stale"
    assert assess(batch, learnt(), now_ns=batch.t0_ns + 10**9).verdict == "normal"


def test_a_missing_channel_is_named() -> None:
    batch = record(seed=104)
    kept = {name: values for name, values in batch.channels.items() if name != "motor_velocity"}
    less = JointRecord(batch.robot, batch.joint, batch.t0_ns, batch.t, kept)
    verdict = assess(less, learnt())
    assert verdict.verdict == "not_assessed"
    assert "motor_velocity" in verdict.says


def test_a_joint_at_rest_is_not_called_normal() -> None:
    batch, rng = record(seed=105), np.random.default_rng(0)
    n = len(batch.t)
    still = changed(
        batch, position=4e-6 * rng.standard_normal(n), motor_velocity=2e-3 * rng.standard_normal(n),
        motor_current=2e-4 * rng.standard_normal(n), setpoint=np.zeros(n), setpoint_rate=np.zeros(n),
    )  # fmt: skip
    verdict = assess(still, learnt())
    assert verdict.verdict == "not_assessed"
    assert "excitation" in verdict.says


@pytest.mark.parametrize("share", [0.6, 1.0])
def test_garbage_is_invalid(share: float) -> None:
    batch = record(seed=106)
    bad = np.random.default_rng(0).random(len(batch.t)) < share
    mask = dict.fromkeys(batch.channels, ~bad)
    masked = JointRecord(batch.robot, batch.joint, batch.t0_ns, batch.t, batch.channels, valid=mask)
    verdict = assess(masked, learnt())
    assert (verdict.verdict, verdict.action) == ("invalid_data", "check_telemetry")


FLIPS: list[Callable[[float], float]] = [
    lambda v: -v,
    lambda v: v * 2.0**512,
    lambda v: v * 2,
    lambda v: v + 1.0,
    lambda v: 0.0,
]


@pytest.mark.parametrize("channel", ["position", "motor_velocity", "motor_current"])
@pytest.mark.parametrize("flip", range(len(FLIPS)))
def test_one_flipped_sample_never_alarms(channel: str, flip: int) -> None:
    batch = record(seed=107)
    for at in (37, len(batch.t) // 3, len(batch.t) - 5):
        values = np.array(batch.channels[channel])
        values[at] = FLIPS[flip](values[at] or 1e-3)
        assert assess(changed(batch, **{channel: values}), learnt()).verdict == "normal"


def test_pieces_of_a_long_batch_are_judged_as_one() -> None:
    whole = record("torque_constant_change=0.95", seed=108)
    cuts = np.linspace(0, len(whole.t), 4).astype(int)
    pieces = [part_of(whole, low, high) for low, high in pairwise(cuts)]
    assert assess(iter(pieces), learnt()).fault == "torque_constant_change"


def test_an_unexplained_departure_may_be_explained_by_reconciling() -> None:
    batch = record(seed=109)
    noise = 3e-4 * np.random.default_rng(1).standard_normal(len(batch.t))
    rough = changed(batch, position=batch.channels["position"] + noise)
    assert assess(rough, learnt()).fault is None
    found = {
        "term": "presliding_friction",
        "component": "friction",
        "probability": 0.9,
        "says": "it creeps before it slips",
    }
    verdict = assess(rough, learnt(), explain=lambda: found)
    assert (verdict.fault, verdict.component) == ("presliding_friction", "friction")
    assert "creeps" in verdict.says


def test_evidence_is_what_the_page_draws() -> None:
    findings = {one.detector: one.evidence for one in judged("torque_constant_change=0.9").findings}
    assert {"t", "position", "effort", "setpoint", "threshold", "features", "scores"} <= set(findings["signals"])
    assert {"t", "residual", "threshold", "t3", "residual3", "threshold3"} <= set(findings["parity"])
    assert {"t", "residual", "threshold", "names", "z", "share", "share_error"} <= set(findings["innovations"])
    assert {"t", "angles", "threshold"} <= set(findings["smi"])
    assert {"names", "probabilities", "cosines", "severity"} <= set(findings["diagnosis"])
    assert len(np.asarray(findings["signals"]["t"])) <= 3000


def test_unjudged_asks_for_the_telemetry_to_be_checked() -> None:
    assert unjudged("J1", "stale", "old").action == "check_telemetry"
    assert unjudged("J1", "stale", "old").says == "J1: old"
    assert unjudged("J1", "not_assessed", "no baseline").action == "none"


@pytest.mark.parametrize("seed", [8400, 8500])
def test_a_batch_cut_out_of_a_motion_is_no_fault(seed: int) -> None:
    """A rigid stand-in for a flexible joint is wrong in its mode; half a swing at either end must not alarm."""
    batches = [_without_model(seed + i) for i in range(8)]
    known = learn_joint(batches[:5])
    for batch in batches[5:]:
        for low, high in ((0, 2300), (0, 3300), (3700, 6000), (2700, 6000)):
            assert assess(part_of(batch, low, high), known).verdict in ("normal", "not_assessed")


def _without_model(seed: int) -> JointRecord:
    """A minute of the joint as its messages tell it: joint angle, joint speed, torque."""
    whole = simulate_record(MODEL, seed=seed, duration=60.0)
    channels = {
        "position": whole.channels["position"],
        "joint_velocity": whole.channels["motor_velocity"] / PLANT.gear_ratio,
        "drive_torque": whole.channels["motor_current"] * PLANT.gear_ratio * PLANT.torque_constant,
    }
    return replace(whole, channels=channels, valid={})


def test_a_fault_smaller_than_its_error_is_not_named() -> None:
    known, limits = learnt(), Limits()
    numbers = gathered(record("torque_constant_change=0.97", seed=100))
    findings = findings_of(numbers, known, limits.per_batch, {}, "SH1")
    case = case_of("SH1", findings, numbers["innovations"], known, limits)
    assert case.is_explained
    vague = case.candidates[0]._replace(error=abs(case.candidates[0].size))
    assert not case._replace(candidates=[vague, *case.candidates[1:]]).is_explained
