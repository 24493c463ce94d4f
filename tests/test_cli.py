"""Everything that a shell sees: exit statuses, one line for what is wrong, JSON on standard output, teaching help."""

import importlib
import inspect
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import click
import pytest

from gsfdi.cli import cli, run
from gsfdi.pipeline import reconcile as pipeline

COMMANDS = ("ingest", "baseline", "analyze", "simulate", "reconcile", "prove", "nightly", "terms")
Said = tuple[int, str, str]


@pytest.fixture
def gsfdi(capfd: pytest.CaptureFixture[str]) -> Callable[..., Said]:
    """Run a command in this process: status, standard output, standard error."""

    def call(*arguments: object) -> Said:
        status = run([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        return status, out, err

    return call


def one_line(err: str) -> bool:
    return err.endswith("\n") and err.count("\n") == 1 and "Traceback" not in err


def test_help_is_quick_and_loads_nothing_heavy() -> None:
    code = (
        "import sys, time; import gsfdi.cli; gsfdi.cli.run(['--help']);"
        "heavy = {'numpy', 'scipy', 'pandas', 'numba', 'pyarrow', 'control', 'jinja2', 'mcap'} & set(sys.modules);"
        "print(sorted(heavy), time.process_time(), file=sys.stderr)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stderr.startswith("[] ")
    for command in COMMANDS:
        assert command in ended.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_help_teaches_with_examples(command: str, gsfdi: Callable[..., Said]) -> None:
    status, out, err = gsfdi(command, "--help")
    assert (status, err) == (0, "")
    assert "Examples:" in out
    assert f"gsfdi {command}" in out


def test_no_command_at_all_is_answered_with_the_help_page(gsfdi: Callable[..., Said]) -> None:
    assert gsfdi() == (2, "", gsfdi("--help")[1])


@pytest.mark.parametrize("name", ["ingest", "baseline", "analyze", "simulate", "reconcile", "prove"])
def test_every_option_has_a_place_in_the_stage(name: str) -> None:
    stage = getattr(importlib.import_module(f"gsfdi.pipeline.{name}"), name)
    here = {"as_json", "verbose", "quiet", "jobs", "scheduler", "fail_on", "dry_run", "check"}
    named = {str(parameter.name) for parameter in cli.commands[name].params}
    assert named - here <= set(inspect.signature(stage).parameters)


def test_every_option_says_what_it_does() -> None:
    for name, command in cli.commands.items():
        for parameter in command.params:
            if isinstance(parameter, click.Option):
                assert parameter.help, f"{name} {parameter.name}"


@pytest.mark.parametrize(
    "arguments",
    [
        ["analyse"],
        ["ingest"],
        ["ingest", "--stor", "x", "y"],
        ["ingest", "no/such/file.mcap"],
        ["simulate", "--model", "no/such/model.toml", "--out", "x.parquet"],
        ["simulate", "--model", "m.toml"],
        ["prove", "--cases", "none"],
        ["prove", "--check", "no/such/folder"],
        ["nightly", "--config", "no/such/config.toml"],
        ["reconcile", "no/such/file.mcap", "--model", "no/such/model.toml"],
        ["terms", "stribek_friction"],
        ["analyze", "x.mcap", "--fail-on", "bad"],
    ],
)
def test_an_unusable_call_is_one_line_and_status_2(
    arguments: list[str], gsfdi: Callable[..., Said], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = gsfdi(*arguments)
    assert (status, out) == (2, "")
    assert one_line(err), err


def test_what_is_no_telemetry_is_named_and_not_a_traceback(gsfdi: Callable[..., Said], tmp_path: Path) -> None:
    odd = tmp_path / "odd\nname.mcap"
    odd.write_bytes(b"\x89MCAP0\r\n" + bytes(64))
    status, out, err = gsfdi("ingest", odd, "--store", tmp_path / "store")
    assert (status, out) == (2, "")
    assert one_line(err), err
    assert "name.mcap" in err


def test_no_baseline_is_status_4(gsfdi: Callable[..., Said], sample: Path, tmp_path: Path) -> None:
    status, out, err = gsfdi("analyze", sample, "--store", tmp_path / "store", "--out", tmp_path)
    assert (status, out) == (4, "")
    assert one_line(err)
    assert "gsfdi baseline" in err


def test_a_bug_is_one_line_too(gsfdi: Callable[..., Said], monkeypatch: pytest.MonkeyPatch) -> None:
    from gsfdi.pipeline import terms

    def broken(names: object) -> object:
        raise KeyError("a\nb")

    monkeypatch.setattr(terms, "terms", broken)
    status, out, err = gsfdi("terms")
    assert (status, out) == (2, "")
    assert one_line(err)
    assert "bug in gsfdi" in err
    assert "Traceback" in gsfdi("terms", "-vv")[2]


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twenty seconds of one joint."""
    path = tmp_path_factory.mktemp("sample") / "joint.parquet"
    model = Path(__file__).parent.parent / "configs" / "era_joint.toml"
    assert run(["simulate", "--model", str(model), "--duration", "20", "--out", str(path), "--quiet"]) == 0
    return path


def test_results_go_to_standard_output_and_json_is_one_document(
    gsfdi: Callable[..., Said], sample: Path, tmp_path: Path
) -> None:
    status, out, err = gsfdi("ingest", sample, "--store", tmp_path / "store", "--json")
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert found["new"] == 1
    assert found["joints"][0]["samples"] == 2000
    assert json.loads(gsfdi("ingest", sample, "--store", tmp_path / "store", "--json")[1])["new"] == 0
    assert gsfdi("ingest", sample, "--store", tmp_path / "store", "--quiet") == (0, "", "")


def test_the_store_is_found_by_environment(
    gsfdi: Callable[..., Said], sample: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GSFDI_STORE", str(tmp_path / "elsewhere"))
    assert gsfdi("ingest", sample, "--quiet")[0] == 0
    assert list((tmp_path / "elsewhere").rglob("*.parquet"))


def test_damaged_input_is_status_3_and_the_good_part_is_kept(
    gsfdi: Callable[..., Said], sample: Path, tmp_path: Path
) -> None:
    (tmp_path / "cut.parquet").write_bytes(sample.read_bytes()[:-100])
    status, out, err = gsfdi("ingest", sample, tmp_path / "cut.parquet", "--store", tmp_path / "store")
    assert status == 3
    assert out.startswith(f"{sample}: era-joint: 2000 samples")
    assert out.count("\n") == 1
    assert one_line(err)
    assert "cut.parquet" in err


def test_dry_run_stores_nothing(gsfdi: Callable[..., Said], sample: Path, tmp_path: Path) -> None:
    status, out, _ = gsfdi("ingest", sample, "--store", tmp_path / "store", "--dry-run")
    assert status == 0
    assert "position_rad" in out
    assert not (tmp_path / "store").exists()


def test_terms_are_listed_explained_and_sketched(gsfdi: Callable[..., Said]) -> None:
    listed = gsfdi("terms")[1]
    assert "stribeck_friction" in listed
    told = gsfdi("terms", "stribeck_friction")[1]
    assert "•" in told
    assert "velocity_rad_s" in told
    assert {one["term"] for one in json.loads(gsfdi("terms", "--json")[1])["terms"]} >= {"backlash", "cogging"}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts_are_printed(shell: str, gsfdi: Callable[..., Said]) -> None:
    status, out, _ = gsfdi("completion", shell)
    assert status == 0
    assert "_GSFDI_COMPLETE" in out


def test_no_progress_bar_where_there_is_no_terminal(gsfdi: Callable[..., Said], sample: Path, tmp_path: Path) -> None:
    assert gsfdi("ingest", sample, "--store", tmp_path / "store")[2] == ""


@pytest.mark.parametrize("signal", [2, 15])
def test_an_interrupt_is_one_line(signal: int) -> None:
    code = (
        "import signal, sys, time, gsfdi.cli as c, gsfdi.pipeline.terms as t\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background jobs ignore it
        "t.terms = lambda names: (print('on', flush=True), time.sleep(60))\n"
        "sys.argv[1:] = ['terms']; c.main()"
    )
    command = [sys.executable, "-c", code]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stdout is not None
    assert running.stdout.readline() == "on\n"
    time.sleep(0.1)
    running.send_signal(signal)
    _, err = running.communicate(timeout=20)
    assert running.returncode == 130
    assert one_line(err.removeprefix("\n"))  # click begins a new line after ^C


def test_an_interruption_within_a_compiled_function_stops_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def compiled(*_: object, **__: object) -> None:
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr(pipeline, "reconcile_joint", compiled)
    record = SimpleNamespace(source="day.parquet", joint="J1")
    with pytest.raises(KeyboardInterrupt):
        pipeline.answer(pipeline.Question((record,), None))  # type: ignore[arg-type]
