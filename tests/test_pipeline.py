"""The contract's files and keys, and that streaming, sharing and naming do not change a verdict."""

import csv
import json
import re
import shutil
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gsfdi import ingest as reading
from gsfdi.baseline import part_of
from gsfdi.canonical import write_parquet
from gsfdi.errors import BaselineError, UnusableInputError
from gsfdi.modelfile import load_models
from gsfdi.pipeline import analyze as analyzing
from gsfdi.pipeline import baseline as learning
from gsfdi.pipeline import reconcile as reconciling
from gsfdi.pipeline import watching
from gsfdi.pipeline.analyze import analyze, common, together
from gsfdi.pipeline.baseline import baseline, load
from gsfdi.pipeline.cause import cause, healthy
from gsfdi.pipeline.ingest import ingest
from gsfdi.pipeline.reconcile import reconcile
from gsfdi.pipeline.simulate import simulate
from gsfdi.types import Problem
from gsfdi.workers import Crew

ROOT = Path(__file__).parent.parent
HEALTHY, NIGHT = ROOT / "sample_telemetry" / "healthy", ROOT / "sample_telemetry" / "night"
ARM = ROOT / "configs" / "era_arm.toml"
LEVELS = {"normal", "warning", "distress", "critical", "not_assessed", "invalid_data", "stale"}
ACTIONS = {"none", "inspect", "plan_maintenance", "stop_using", "check_telemetry"}
COMPONENTS = {"motor", "friction", "gearbox", "link", "sensor", "controller", None}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A baseline of three joints of the sample arm."""
    home = tmp_path_factory.mktemp("learnt") / "store"
    baseline([str(HEALTHY)], store=home, model=ARM, joints=["SH1", "SH2", "EL"])
    return home


@pytest.fixture(scope="module")
def night(store: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("night")
    analyze([str(NIGHT)], store=store, out=out)
    return out


@pytest.fixture(scope="module")
def verdicts(night: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((night / "verdicts.json").read_text())
    return found


def test_the_sample_night_is_judged_as_it_was_made(verdicts: dict[str, Any]) -> None:
    found = {joint["joint"]: joint for joint in verdicts["joints"]}
    assert found["SH1"]["verdict"] == "normal"
    assert (found["SH2"]["component"], found["SH2"]["fault"]) == ("motor", "torque_constant_drift")
    assert abs(found["SH2"]["onset_s"] - 7.5) < 1.0
    assert (found["EL"]["component"], found["EL"]["fault"]) == ("gearbox", "stiffness_change")
    assert abs(found["EL"]["onset_s"] - 20.0) < 1.0
    assert {joint["verdict"] for name, joint in found.items() if name in ("WR1", "WR2", "WR3", "EE")} == {
        "not_assessed"
    }


def test_verdicts_json_keeps_the_contract(verdicts: dict[str, Any]) -> None:
    assert verdicts["schema"] == "gsfdi/verdicts/1"
    assert verdicts["batch"].keys() >= {"path", "sha256"}
    assert verdicts["baseline"]["name"] == "default"
    assert re.fullmatch("[0-9a-f]{64}", verdicts["baseline"]["sha256"])
    assert re.fullmatch("[0-9a-f]{64}", verdicts["batch"]["sha256"])
    assert [joint["joint"] for joint in verdicts["joints"]][:3] == ["SH1", "SH2", "EL"]
    for joint in verdicts["joints"]:
        assert joint.keys() >= {
            "joint", "verdict", "action", "component", "fault", "fault_probability", "alternatives", "onset_s",
            "methods", "due", "says",
        }  # fmt: skip
        assert joint["verdict"] in LEVELS
        assert joint["action"] in ACTIONS
        assert joint["component"] in COMPONENTS
        assert joint["fault_probability"] is None or 0 <= joint["fault_probability"] <= 1
        assert isinstance(joint["alternatives"], list)
        assert joint["methods"].keys() == {"signal", "parity", "smi"}
        for method in joint["methods"].values():
            assert method.keys() >= {"alarm", "p_value"}
        assert joint["due"].keys() >= {"when", "interval90", "reason"}
        assert joint["says"]
        assert "\n" not in joint["says"]


def test_verdicts_csv_has_a_row_per_joint_under_the_same_names(night: Path, verdicts: dict[str, Any]) -> None:
    with (night / "verdicts.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["joint"] for row in rows] == [joint["joint"] for joint in verdicts["joints"]]
    assert rows[1]["verdict"] == verdicts["joints"][1]["verdict"]
    assert float(rows[1]["methods_parity_p_value"]) == verdicts["joints"][1]["methods"]["parity"]["p_value"]
    assert rows[0].keys() >= {"due_when", "due_reason", "methods_smi_alarm", "fault_probability"}


def test_the_page_stands_alone(night: Path) -> None:
    page = (night / "report.html").read_text()
    assert len(page) < 2_000_000
    assert "SH2" in page
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", page)


def without_the_clock(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((path / "verdicts.json").read_text())
    del found["made"]
    return found


@pytest.mark.parametrize("jobs", [1, 2])
def test_pieces_and_processes_do_not_change_a_verdict(
    store: Path, night: Path, tmp_path: Path, jobs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(analyzing, "LARGE", 0 if jobs > 1 else 1 << 40)
    if jobs == 1:
        monkeypatch.setattr(watching, "PIECE", 40_000)
    analyze([str(NIGHT)], store=store, out=tmp_path, crew=Crew(jobs))
    again, first = without_the_clock(tmp_path), without_the_clock(night)
    for one, other in zip(again["joints"], first["joints"], strict=True):
        for key in ("joint", "verdict", "fault", "component", "action"):
            assert one[key] == other[key]
        if one["onset_s"] is not None:
            assert abs(one["onset_s"] - other["onset_s"]) < 0.5


def test_what_is_in_the_store_is_analysed_too(store: Path, tmp_path: Path) -> None:
    ingest([str(NIGHT / "EL.parquet")], store=tmp_path / "store")
    outcome = analyze([str(tmp_path / "store" / "telemetry")], store=store, out=tmp_path)
    assert [(joint["joint"], joint["fault"]) for joint in outcome.result["joints"]] == [("EL", "stiffness_change")]


def test_telemetry_that_names_no_robot_finds_its_baseline(store: Path, tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    pq.write_table(pq.read_table(NIGHT / "EL.parquet").replace_schema_metadata(None), tmp_path / "bare.parquet")
    outcome = analyze([str(tmp_path / "bare.parquet")], store=store, out=tmp_path)
    assert outcome.result["joints"][0]["fault"] == "stiffness_change"


def test_a_joint_whose_robot_is_named_in_part_of_a_batch_only_gets_one_verdict(store: Path, tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    (record,) = reading.read([NIGHT / "EL.parquet"]).records
    middle = len(record.t) // 2
    write_parquet(tmp_path / "1.parquet", [part_of(record, 0, middle)])
    bare = pq.read_table(NIGHT / "EL.parquet").slice(middle).replace_schema_metadata(None)
    pq.write_table(bare, tmp_path / "2.parquet")
    outcome = analyze([str(tmp_path)], store=store, out=tmp_path / "out")
    assert [(one["joint"], one["fault"]) for one in outcome.result["joints"]] == [("EL", "stiffness_change")]


def test_old_telemetry_is_stale_where_that_is_asked(store: Path, tmp_path: Path) -> None:
    later = datetime(2030, 1, 1, tzinfo=UTC)
    outcome = analyze([str(NIGHT / "EL.parquet")], store=store, out=tmp_path, now=later, stale_after_s=86400.0)
    assert outcome.levels == ["stale"]
    assert outcome.result["joints"][0]["action"] == "check_telemetry"


def test_a_damaged_baseline_and_that_of_another_version_are_refused(
    store: Path, tmp_path: Path, monkeypatch: Any
) -> None:
    shutil.copytree(store, tmp_path / "store")
    path = next((tmp_path / "store" / "baselines").rglob("*.json"))
    path.write_text(path.read_text().replace("SH1", "SH9", 1))
    with pytest.raises(BaselineError, match="checksum"):
        analyze([str(NIGHT)], store=tmp_path / "store", out=tmp_path)
    monkeypatch.setattr(learning, "__version__", "9.9")
    with pytest.raises(BaselineError, match=r"this is 9\.9"):
        analyze([str(NIGHT)], store=store, out=tmp_path)
    assert not (tmp_path / "verdicts.json").exists()


def test_a_baseline_of_nothing_usable_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnusableInputError):
        baseline([str(ROOT / "README.md")], store=tmp_path / "store")


@pytest.mark.parametrize("ending", ["parquet", "mcap"])
def test_what_is_simulated_reads_back_the_same(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"arm.{ending}"
    for _ in range(2):
        simulate(ARM, out=path, joints=["SH1", "EE"], duration=5.0, seed=3)
        first = path.read_bytes()
    assert path.read_bytes() == first
    other = tmp_path / "other.parquet"
    simulate(ARM, out=other, joints=["SH1", "EE"], duration=5.0, seed=3)
    for one, same in zip(reading.read([path]).records, reading.read([other]).records, strict=True):
        assert (one.joint, one.t0_ns, one.robot) == (same.joint, same.t0_ns, same.robot)
        np.testing.assert_allclose(one.t, same.t, atol=2e-9)
        for name in ("setpoint", "position", "motor_velocity", "motor_current"):
            np.testing.assert_array_equal(one.channels[name], same.channels[name])


def test_an_unknown_ending_and_open_loop_without_a_recording_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnusableInputError, match=r"\.parquet or \.mcap"):
        simulate(ARM, out=tmp_path / "arm.csv")
    with pytest.raises(UnusableInputError, match="--replay"):
        simulate(ARM, out=tmp_path / "arm.mcap", open_loop=True)


def test_a_batch_of_several_files_has_one_path_and_one_hash() -> None:
    assert common({"a/b.mcap": "1"}) == "a/b.mcap"
    assert common({"/n/a/b.mcap": "1", "/n/a/c/d.mcap": "2"}) == "/n/a"
    assert common({"b.mcap": "1", "c.mcap": "2"}) == "."
    assert together({"b": "1"}) == "1"
    assert together({"b": "1", "c": "2"}) == together({"x": "2", "y": "1"})


def later(path: Path, source: Path, days: int) -> Path:
    """The same recording on another day."""
    record = reading.read([source]).records[0]
    write_parquet(path, [replace(record, t0_ns=record.t0_ns + days * 86_400_000_000_000, sha256=f"day {days}")])
    return path


def test_a_fault_that_grows_from_night_to_night_gets_a_due_date(store: Path, tmp_path: Path) -> None:
    shutil.copytree(store, tmp_path / "store")
    for day in range(6):
        simulate(
            ARM, out=tmp_path / "sim.parquet", joints=["SH1"], duration=20.0, seed=50 + day,
            faults=[f"torque_constant_change={0.998 - 0.008 * day}"],
        )  # fmt: skip
        batch = later(tmp_path / f"day{day}.parquet", tmp_path / "sim.parquet", day)
        due = analyze([str(batch)], store=tmp_path / "store", out=tmp_path).result["joints"][0]["due"]
    when, (low, high) = datetime.fromisoformat(due["when"]), map(datetime.fromisoformat, due["interval90"])
    assert low <= when <= high
    # 10 % are gone 12.25 days after the first batch, on the 13th.
    assert low <= datetime(2026, 1, 13) <= high
    ledger = next((tmp_path / "store" / "ledger").rglob("SH1.jsonl"))
    lines = len(ledger.read_text().splitlines())
    analyze([str(tmp_path / "day5.parquet")], store=tmp_path / "store", out=tmp_path)
    assert len(ledger.read_text().splitlines()) == lines


def test_what_no_known_fault_explains_is_handed_to_reconcile(store: Path) -> None:
    kept = load(store, "default")[0].joints["simulated/EL"]
    records = reading.read([NIGHT / "EL.parquet"]).records
    model = load_models(ARM).for_joint("EL")
    assert (cause(records, kept, model) or {})["term"] == "stiffness_change"
    rough = replace(kept, nominal=replace(kept.nominal, terms={
        "coulomb_friction:motor": 2.0, "gravity_unbalance:s": 0.0, "gravity_unbalance:c": 3.0, "stribeck_friction": 1.0,
    }))  # fmt: skip
    uses = {use.term: use.values for use in healthy(records[0], rough, model).physics}
    assert uses["coulomb_friction"] == {"torque_nm": 2.0}
    assert uses["gravity_unbalance"]["torque_nm"] * np.sin(
        0.3 - uses["gravity_unbalance"]["angle_rad"]
    ) == pytest.approx(3.0 * np.cos(0.3))


def test_joints_that_are_nowhere_are_named(store: Path, tmp_path: Path) -> None:
    outcome = analyze([str(NIGHT)], store=store, out=tmp_path, joints=["EL", "SH3"])
    assert [joint["joint"] for joint in outcome.result["joints"]] == ["EL"]
    assert outcome.damaged
    assert "--joint SH3: is in none of the files" in outcome.log(notes=False)[0]


@pytest.fixture(scope="module")
def reconciled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What reconcile writes of one joint with friction that its model lacks."""
    out = tmp_path_factory.mktemp("reconciled")
    reconcile([str(NIGHT / "WR2.parquet")], model=ARM, out=out)
    return out


def test_reconcile_json_keeps_the_contract(reconciled: Path) -> None:
    found = json.loads((reconciled / "reconcile.json").read_text())
    assert found["schema"] == "gsfdi/reconcile/1"
    assert [recording.keys() for recording in found["recordings"]] == [{"path", "sha256"}]
    (joint,) = found["joints"]
    assert joint["verdict"] == "explained"
    assert joint["mismatch"].keys() >= {"detected", "p_value", "effect"}
    assert joint["location"].keys() >= {"component", "signals", "where", "when", "bands_hz"}
    for place in joint["location"]["where"]:
        assert place.keys() >= {"covariate", "low", "high", "share_of_misfit"}
    (term,) = joint["omitted_physics"]
    assert term.keys() >= {"term", "component", "side", "probability", "parameters", "says"}
    assert (term["term"], term["component"]) == ("coulomb_friction", "friction")
    low, high = term["parameters"]["torque_nm"]["ci95"]
    assert low <= 1.5 <= high
    assert joint["fit"].keys() >= {"held_out_seconds", "before", "after", "noise_floor"}
    assert joint["fit"]["after"]["motor_current_a"] < 0.5 * joint["fit"]["before"]["motor_current_a"]
    assert isinstance(joint["indistinguishable"], list)


def test_what_fails_for_one_joint_is_left_out_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("Matrix is singular")

    monkeypatch.setattr(reconciling, "reconcile_joint", failing)
    records = tuple(reading.read([NIGHT / "WR2.parquet"]).records)
    problem = reconciling.answer(reconciling.Question(records, load_models(ARM).for_joint("WR2")))
    assert isinstance(problem, Problem)
    assert (problem.kind, problem.path) == ("left_out", f"{records[0].source}: joint WR2")
    assert "Matrix is singular" in problem.what


def test_the_updated_model_feeds_simulate(reconciled: Path, tmp_path: Path) -> None:
    found = json.loads((reconciled / "reconcile.json").read_text())["joints"][0]
    updated = reconciled / found["updated_model"]
    assert [use.term for use in load_models(updated).for_joint("WR2").physics] == ["coulomb_friction"]
    recording = reading.read([NIGHT / "WR2.parquet"]).records[0]
    errors = []
    for model in (ARM, updated):
        simulate(model, replay=NIGHT / "WR2.parquet", out=tmp_path / "again.parquet")
        again = reading.read([tmp_path / "again.parquet"]).records[0]
        errors.append(float(np.sqrt(np.nanmean((again["motor_current"] - recording["motor_current"]) ** 2))))
    assert errors[1] < 0.3 * errors[0]
    assert (reconciled / "report.html").stat().st_size < 2_000_000


def test_a_term_to_do_without_must_be_one(tmp_path: Path) -> None:
    with pytest.raises(UnusableInputError, match="did you mean 'coulomb_friction'"):
        reconcile([str(NIGHT / "WR2.parquet")], model=ARM, out=tmp_path, without=["coulom_friction"])
