import json
import os
from pathlib import Path

import numpy as np
import pytest
from joints import MODEL, PLANT, learnt, record

from gsfdi import ingest
from gsfdi.baseline import Baseline, learn, learn_joint, part_of
from gsfdi.diagnosis import assess
from gsfdi.errors import BaselineError
from gsfdi.healthy import noise_of
from gsfdi.types import JointRecord

REAL = Path(os.environ.get("GSFDI_REAL", Path(__file__).parents[2] / "shared" / "real"))


def plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return float(value) if isinstance(value, np.floating) else str(value)


def test_a_baseline_survives_the_store() -> None:
    whole = Baseline({"SH1": learnt()})
    back = Baseline.from_dict(json.loads(json.dumps(whole.to_dict(), default=plain)))
    batch = record("torque_constant_change=0.95", seed=200)
    first, second = assess(batch, whole.joints["SH1"]), assess(batch, back.joints["SH1"])
    assert (first.verdict, first.fault, first.onset_s) == (second.verdict, second.fault, second.onset_s)
    assert first.fault_probability == pytest.approx(second.fault_probability)


def test_a_dictionary_of_another_schema_is_refused() -> None:
    with pytest.raises(BaselineError, match="schema"):
        Baseline.from_dict({"schema": "gsfdi/other/1"})


def test_a_true_model_file_is_left_as_it_is() -> None:
    assert learnt().nominal.plant == PLANT
    assert not [key for key, value in learnt().nominal.terms.items() if value]


def test_friction_of_the_fault_free_joint_becomes_part_of_normality() -> None:
    rough = [record("coulomb_friction=3", "viscous_friction=40", seed=seed) for seed in range(4)]
    known = learn_joint(rough, MODEL)
    found = {key: value for key, value in known.nominal.terms.items() if value}
    assert found == pytest.approx({"coulomb_friction:motor": 3.0, "viscous_friction:motor": 40.0}, rel=0.01)
    assert assess(record("coulomb_friction=3", "viscous_friction=40", seed=210), known).verdict == "normal"
    worn = assess(record("coulomb_friction=4", "viscous_friction=40", seed=211), known)
    assert worn.component == "friction"


def test_one_recording_is_cut_into_pieces() -> None:
    assert learn_joint([record(seed=220, duration=60.0)], MODEL).batches >= 4


def test_what_cannot_be_learnt_is_named() -> None:
    t = 0.01 * np.arange(400)
    found = learn([JointRecord("r", "bare", 0, t, {"setpoint": t}), record(seed=221)], lambda joint: MODEL)
    assert list(found.joints) == ["SH1"]
    assert "bare" in found.problems[0].path


def test_a_part_counts_its_own_time() -> None:
    whole = record(seed=222)
    part = part_of(whole, 100, 200)
    assert part.t[0] == 0.0
    assert part.t0_ns == whole.t0_ns + round(float(whole.t[100]) * 1e9)
    assert np.array_equal(part.channels["position"], whole.channels["position"][100:200])


def test_noise_is_told_from_motion_and_from_resolution() -> None:
    rng, t = np.random.default_rng(0), 0.01 * np.arange(5000)
    assert noise_of(np.sin(t) + 1e-3 * rng.standard_normal(5000)) == pytest.approx(1e-3, rel=0.1)
    rest = np.round(np.where(t < 10, np.sin(t), np.sin(10.0)), 3)
    assert 1e-4 < noise_of(rest) < 2e-3


@pytest.mark.skipif(not (REAL / "emps").exists(), reason="the real recordings are not here")
def test_a_real_drive_without_a_model_file_is_learnt() -> None:
    records = ingest.read([REAL / "emps" / "emps.parquet"]).records
    known = learn_joint(records)
    assert known.nominal.plant.output_inertia == pytest.approx(95.0, rel=0.03)
    assert known.nominal.terms["coulomb_friction:motor"] == pytest.approx(20.4, rel=0.15)
    assert assess(records[0], known).verdict == "normal"
