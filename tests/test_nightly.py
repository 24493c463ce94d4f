"""The night job: idempotent, locked, safe to kill at any moment, one dated folder, a history."""

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import filelock
import pytest

from gsfdi.cli import run
from gsfdi.config import Night
from gsfdi.errors import BaselineError, LockedError, UnusableInputError
from gsfdi.pipeline import nightly as module
from gsfdi.pipeline.nightly import HISTORY, nightly

ROOT = Path(__file__).parent.parent
MODEL = str(ROOT / "configs" / "era_joint.toml")
NOW = datetime(2026, 11, 21, 2, 30, tzinfo=UTC)


def simulate(path: Path, seed: int, *more: str) -> None:
    call = ["simulate", "--model", MODEL, "--duration", "20", "--seed", str(seed), "--out", str(path), "--quiet", *more]
    assert run(call) == 0


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with a baseline, and two nights' recordings."""
    home = tmp_path_factory.mktemp("made")
    for seed in (1, 2):
        simulate(home / f"healthy-{seed}.parquet", seed)
    learn = [str(home / "healthy-1.parquet"), str(home / "healthy-2.parquet"), "--store", str(home / "store")]
    assert run(["baseline", *learn, "--model", MODEL, "--quiet", "--jobs", "1"]) == 0
    simulate(home / "first.parquet", 3)
    simulate(home / "second.parquet", 4, "--fault", "torque_constant_change=0.7@5")
    return home


@pytest.fixture
def night(made: Path, tmp_path: Path) -> Night:
    shutil.copytree(made / "store", tmp_path / "store")
    (tmp_path / "inbox").mkdir()
    return Night(inbox=tmp_path / "inbox", out=tmp_path / "nights", store=tmp_path / "store", jobs=1, reconcile=False)


def arrive(night: Night, path: Path, name: str = "") -> None:
    shutil.copy(path, night.inbox / (name or path.name))


def folders(night: Night) -> list[str]:
    return sorted(path.name for path in night.out.iterdir() if path.is_dir())


def history(night: Night) -> list[dict[str, object]]:
    return [json.loads(line) for line in (night.out / HISTORY).read_text().splitlines()]


def test_a_night_makes_one_dated_folder_and_a_line_of_history(night: Night, made: Path) -> None:
    arrive(night, made / "first.parquet")
    outcome = nightly(night, now=NOW)
    assert folders(night) == ["2026-11-21"]
    names = {path.name for path in (night.out / "2026-11-21").iterdir()}
    assert names >= {"verdicts.json", "verdicts.csv", "report.html", "night.json"}
    assert outcome.levels == ["normal"]
    assert [(line["night"], line["joint"], line["verdict"]) for line in history(night)] == [
        ("2026-11-21", "era-joint", "normal")
    ]


def test_the_same_bytes_are_done_once_whatever_their_name(night: Night, made: Path) -> None:
    arrive(night, made / "first.parquet")
    nightly(night, now=NOW)
    arrive(night, made / "first.parquet", "again.parquet")
    outcome = nightly(night, now=NOW)
    assert "nothing new" in outcome.lines[0]
    assert folders(night) == ["2026-11-21"]
    assert len(history(night)) == 1


def test_a_second_arrival_on_one_day_gets_a_folder_of_its_own(night: Night, made: Path) -> None:
    arrive(night, made / "first.parquet")
    nightly(night, now=NOW)
    arrive(night, made / "second.parquet")
    outcome = nightly(night, now=NOW)
    assert folders(night) == ["2026-11-21", "2026-11-21-2"]
    assert outcome.levels != ["normal"]
    assert [line["night"] for line in history(night)] == ["2026-11-21", "2026-11-21-2"]


def test_a_removed_folder_is_made_again_and_stands_in_the_history_once(night: Night, made: Path) -> None:
    arrive(night, made / "first.parquet")
    nightly(night, now=NOW)
    shutil.rmtree(night.out / "2026-11-21")
    nightly(night, now=NOW.replace(hour=3))
    assert folders(night) == ["2026-11-21"]
    assert [line["at"] for line in history(night)] == ["2026-11-21T03:30:00+00:00"]


def test_joints_that_alarm_are_held_against_their_fault_free_selves(night: Night, made: Path) -> None:
    arrive(night, made / "second.parquet")
    outcome = nightly(replace(night, reconcile=True, model=Path(MODEL)), now=NOW)
    found = json.loads((night.out / "2026-11-21" / "reconciled" / "reconcile.json").read_text())
    assert [joint["joint"] for joint in found["joints"]] == ["era-joint"]
    assert found["joints"][0]["mismatch"]["detected"]
    assert all(".making" not in line for line in outcome.lines)


def test_files_still_arriving_hidden_or_partial_are_left(night: Night, made: Path) -> None:
    for name in (".first.parquet", "first.parquet.part"):
        arrive(night, made / "first.parquet", name)
    assert nightly(night, now=NOW).result["folder"] is None
    arrive(night, made / "first.parquet")
    assert nightly(replace(night, settle_s=3600.0), now=NOW).result["folder"] is None
    assert nightly(night, now=NOW).result["folder"] is not None


def test_another_run_holds_the_lock(night: Night) -> None:
    night.out.mkdir()
    with filelock.FileLock(night.out / ".lock"), pytest.raises(LockedError) as raised:
        nightly(night, now=NOW)
    assert raised.value.exit_status == 5


def test_without_a_baseline_files_stay_new(night: Night, made: Path) -> None:
    shutil.rmtree(night.store / "baselines")
    arrive(night, made / "first.parquet")
    with pytest.raises(BaselineError):
        nightly(night, now=NOW)
    assert folders(night) == [".2026-11-21.making"]
    shutil.copytree(made / "store" / "baselines", night.store / "baselines")
    assert nightly(night, now=NOW).levels == ["normal"]
    assert folders(night) == ["2026-11-21"]


def test_damaged_files_are_named_and_the_good_ones_analysed(night: Night, made: Path) -> None:
    arrive(night, made / "first.parquet")
    (night.inbox / "bad.parquet").write_bytes((made / "second.parquet").read_bytes()[:5000])
    outcome = nightly(night, now=NOW)
    assert outcome.damaged
    assert outcome.levels == ["normal"]
    assert "bad.parquet" in outcome.log(notes=False)[0]
    assert nightly(night, now=NOW).result["folder"] is None


def test_a_night_of_nothing_usable_is_said_once(night: Night) -> None:
    (night.inbox / "bad.mcap").write_bytes(b"not telemetry")
    with pytest.raises(UnusableInputError, match=r"bad\.mcap"):
        nightly(night, now=NOW)
    assert nightly(night, now=NOW).result["folder"] is None


@pytest.mark.parametrize("stage", ["ingest", "analyze", "_remember", "sync_folder", "write_text"])
def test_killed_at_any_stage_the_next_run_ends_the_night(night: Night, made: Path, stage: str) -> None:
    """Kill for good, as the power would, before and after each stage, and start again."""
    arrive(night, made / "first.parquet")
    for when in ("before", "after"):
        code = (
            "import os, sys, json, signal; from pathlib import Path; from datetime import datetime\n"
            "from gsfdi.config import Night; from gsfdi.pipeline import nightly as m\n"
            f"stage, when, old = {stage!r}, {when!r}, m.{stage}\n"
            "def die(*a, **k):\n"
            "    if when == 'after': old(*a, **k)\n"
            "    os.kill(os.getpid(), signal.SIGKILL)\n"
            f"m.{stage} = die\n"
            f"m.nightly(Night(Path({str(night.inbox)!r}), Path({str(night.out)!r}), Path({str(night.store)!r}),"
            f" jobs=1, reconcile=False), now=datetime.fromisoformat({NOW.isoformat()!r}))"
        )
        ended = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
        assert ended.returncode == -signal.SIGKILL or folders(night) == ["2026-11-21"], ended.stderr
    nightly(night, now=NOW)
    assert folders(night) == ["2026-11-21"]
    assert [line["verdict"] for line in history(night)] == ["normal"]
    assert not [path for path in night.out.rglob("*") if path.suffix == ".part" and os.path.getsize(path)]


def test_the_command_reads_its_settings(night: Night, made: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arrive(night, made / "second.parquet")
    config = night.out.parent / "night.toml"
    config.write_text('schema = "gsfdi/nightly/1"\ninbox = "inbox"\nout = "nights"\njobs = 1\nreconcile = false\n')
    assert run(["nightly", "--config", str(config), "--fail-on", "warning", "--json"]) == 1
    assert json.loads(capfd.readouterr().out)["folder"] == str(night.out / f"{datetime.now(UTC):%Y-%m-%d}")
    assert run(["nightly", "--config", str(config)]) == 0
    assert module.NIGHT in {path.name for path in night.out.glob("*/*")}
