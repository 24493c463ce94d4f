"""The command line: arguments in, results on standard output, the log on standard error, and an exit status.

Nothing is computed here, and nothing heavy is imported before a command runs, so that ``gsfdi --help`` is quick.
"""

import json
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gsfdi import __version__
from gsfdi.console import Progress, fail, start_log, talkative
from gsfdi.errors import GsfdiError, UnusableInputError
from gsfdi.options import FAIL_ON, JOINT, LEVELS, MAPPING, MODEL, OUT, SEED, SOURCES, STORE, TALK, WORK

if TYPE_CHECKING:
    from gsfdi.pipeline.outcome import Outcome

DONE, FAILED_ON, UNUSABLE, DAMAGED, INTERRUPTED = 0, 1, 2, 3, 130
BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Teaching(click.Group):
    """The group of commands, in the order of a first night rather than of the alphabet."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order in which they were written below."""
        return list(self.commands)


@click.group(
    cls=Teaching,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit status: 0 done; 1 a verdict reached --fail-on; 2 unusable call or input; 3 done, but some input was "
    "damaged or left out; 4 no baseline; 5 another run holds the lock.",
)
@click.version_option(__version__, prog_name="gsfdi")
def cli() -> None:
    """Decide which joint of a space robot needs maintenance, what part of it, and when.

    \b
    A first night:
      gsfdi ingest monday.mcap                       read telemetry into the store
      gsfdi baseline healthy/ --model arm.toml       learn what the joints do while fault-free
      gsfdi analyze tonight.mcap --out report        verdicts.json, verdicts.csv, report.html
    \b
    Where simulation and recording differ:
      gsfdi reconcile slew.parquet --model arm.toml  name the physics left out, show the fit improve
      gsfdi prove                                    see it done on data whose answer is sealed
    """


@cli.command()
@SOURCES
@STORE
@MAPPING
@JOINT
@click.option("--dry-run", is_flag=True, help="Say what the files hold and how they would be read; store nothing.")
@TALK
def ingest(
    sources: Sequence[str],
    store: Path,
    mappings: Sequence[Path],
    joints: Sequence[str],
    dry_run: bool,
    as_json: bool,
    verbose: int,
    quiet: bool,
) -> int:
    """Read MCAP, Parquet or CSV telemetry into the store.

    SRC is a file, a folder or a glob. The same bytes twice are one batch. What is damaged is masked, counted and
    named, never repaired.

    \b
    Examples:
      gsfdi ingest /data/inbox --store /data/store
      gsfdi ingest 'night-*.mcap' --mapping arm-1.toml --mapping arm-2.toml
      gsfdi ingest odd.csv --dry-run
    """
    start_log(verbose, quiet)
    from gsfdi.pipeline import ingest as stage

    if dry_run:
        return show(stage.describe(sources, mappings), as_json, quiet)
    with Progress(quiet) as progress:
        outcome = stage.ingest(sources, store=store, mappings=mappings, joints=joints, progress=progress)
    return show(outcome, as_json, quiet)


@cli.command()
@SOURCES
@STORE
@MAPPING
@JOINT
@MODEL
@click.option("--name", default="default", show_default=True, help="Name of the baseline.")
@WORK
@TALK
def baseline(
    sources: Sequence[str],
    store: Path,
    mappings: Sequence[Path],
    joints: Sequence[str],
    model: Path | None,
    name: str,
    jobs: int | None,
    scheduler: str | None,
    as_json: bool,
    verbose: int,
    quiet: bool,
) -> int:
    """Learn what every joint does while it is free of faults.

    Give several batches, of motions like those of the nights to come. With a model the parity and innovation
    detectors work too, and the verdicts can name a part.

    \b
    Examples:
      gsfdi baseline healthy/*.mcap --model configs/era_arm.toml
      gsfdi baseline week-31/ --name after-repair
    """
    start_log(verbose, quiet)
    from gsfdi.pipeline import baseline as stage
    from gsfdi.workers import Crew

    with Progress(quiet) as progress:
        outcome = stage.baseline(
            sources,
            store=store,
            mappings=mappings,
            joints=joints,
            model=model,
            name=name,
            crew=Crew(jobs, scheduler),
            progress=progress,
        )
    return show(outcome, as_json, quiet)


@cli.command()
@click.argument("sources", nargs=-1, required=True, metavar="BATCH...")
@STORE
@MAPPING
@JOINT
@click.option("--baseline", "name", default="default", show_default=True, help="Name of the baseline to judge against.")
@MODEL
@OUT
@FAIL_ON
@WORK
@TALK
def analyze(
    sources: Sequence[str],
    store: Path,
    mappings: Sequence[Path],
    joints: Sequence[str],
    name: str,
    model: Path | None,
    out: Path,
    fail_on: str | None,
    jobs: int | None,
    scheduler: str | None,
    as_json: bool,
    verbose: int,
    quiet: bool,
) -> int:
    """Judge every joint of a batch against its baseline.

    Writes verdicts.json, verdicts.csv and report.html. A joint that could not be assessed is never called normal.

    \b
    Examples:
      gsfdi analyze tonight.mcap --out report
      gsfdi analyze /data/2026-11-21 --baseline after-repair --fail-on distress
      gsfdi analyze tonight.parquet --joint SH1 --json | jq '.joints[0].says'
    """
    start_log(verbose, quiet)
    from gsfdi.pipeline import analyze as stage
    from gsfdi.workers import Crew

    with Progress(quiet) as progress:
        outcome = stage.analyze(
            sources,
            store=store,
            mappings=mappings,
            joints=joints,
            name=name,
            model=model,
            out=out,
            crew=Crew(jobs, scheduler),
            progress=progress,
        )
    return show(outcome, as_json, quiet, fail_on)


@cli.command()
@click.option(
    "--model",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar="M.toml",
    help="Model to simulate.",
)
@click.option("--replay", type=click.Path(path_type=Path), metavar="REC", help="Recording whose setpoint is replayed.")
@MAPPING
@JOINT
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="ID=VALUE[@SECONDS]",
    help="A term of physics or a fault, from its onset on; may be repeated. 'gsfdi terms' lists the ids.",
)
@click.option("--open-loop", is_flag=True, help="Drive the recorded current instead of closing the loop.")
@click.option(
    "--duration",
    type=click.FloatRange(min=0.0, min_open=True),
    default=180.0,
    show_default=True,
    metavar="SECONDS",
    help="How long to simulate without --replay.",
)
@SEED
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar="FILE",
    help="FILE.parquet or FILE.mcap.",
)
@TALK
def simulate(
    model: Path,
    replay: Path | None,
    mappings: Sequence[Path],
    joints: Sequence[str],
    faults: Sequence[str],
    open_loop: bool,
    duration: float,
    seed: int,
    out: Path,
    as_json: bool,
    verbose: int,
    quiet: bool,
) -> int:
    """Simulate a joint, or every joint of an arm.

    Without --replay the joints follow a training trajectory; with it, the recorded setpoint from the recording's own
    initial state and at its temperature, the loop closed by the model's controller.

    \b
    Examples:
      gsfdi simulate --model configs/era_joint.toml --out healthy.parquet
      gsfdi simulate --model configs/era_joint.toml --fault torque_constant_drift=-0.01@7.5 --out drift.mcap
      gsfdi simulate --model SH1.updated_model.toml --replay slew.parquet --out replay.parquet
    """
    start_log(verbose, quiet)
    from gsfdi.pipeline import simulate as stage

    outcome = stage.simulate(
        model,
        replay=replay,
        mappings=mappings,
        joints=joints,
        faults=faults,
        open_loop=open_loop,
        duration=duration,
        seed=seed,
        out=out,
    )
    return show(outcome, as_json, quiet)


@cli.command()
@click.argument("sources", nargs=-1, required=True, metavar="REC...")
@MAPPING
@JOINT
@click.option(
    "--model",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar="M.toml",
    help="Model to question.",
)
@click.option("--without", multiple=True, metavar="TERM", help="Leave this term out of the library; may be repeated.")
@OUT
@WORK
@TALK
def reconcile(
    sources: Sequence[str],
    mappings: Sequence[Path],
    joints: Sequence[str],
    model: Path,
    without: Sequence[str],
    out: Path,
    jobs: int | None,
    scheduler: str | None,
    as_json: bool,
    verbose: int,
    quiet: bool,
) -> int:
    """Find where simulation and recording differ, and the physics that was left out.

    Writes reconcile.json, report.html, and JOINT.updated_model.toml for every joint whose mismatch was explained; the
    fit is shown on data that took no part in choosing or fitting.

    \b
    Examples:
      gsfdi reconcile slew-*.parquet --model configs/era_joint.toml --out reconciled
      gsfdi reconcile monday.mcap --model arm.toml --joint EL1 --jobs 2
    """
    start_log(verbose, quiet)
    from gsfdi.pipeline import reconcile as stage
    from gsfdi.workers import Crew

    with Progress(quiet) as progress:
        outcome = stage.reconcile(
            sources,
            mappings=mappings,
            joints=joints,
            model=model,
            without=without,
            out=out,
            crew=Crew(jobs, scheduler),
            progress=progress,
        )
    return show(outcome, as_json, quiet)


@cli.command()
@click.option(
    "--cases", type=click.IntRange(min=1), default=20, show_default=True, metavar="N", help="Concealed cases."
)
@SEED
@OUT
@click.option(
    "--check",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="DIR",
    help="Check the seal of an earlier proof and score its stored answers again.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    show_default="the processors there are",
    help="At most this many processes.",
)
@TALK
def prove(
    cases: int,
    seed: int,
    out: Path,
    check: Path | None,
    jobs: int | None,
    as_json: bool,
    verbose: int,
    quiet: bool,
) -> int:
    """Prove reconcile on concealed data whose answers are sealed before it starts.

    Writes proof.json and proof.html. A seed of your own makes cases that nobody has seen before.

    \b
    Examples:
      gsfdi prove --cases 20 --seed 8143 --out proof
      gsfdi prove --check proof
    """
    start_log(verbose, quiet)
    from gsfdi.pipeline import prove as stage
    from gsfdi.workers import Crew

    if check is not None:
        return show(stage.check(check), as_json, quiet)
    with Progress(quiet) as progress:
        outcome = stage.prove(cases, seed=seed, out=out, crew=Crew(jobs, None), progress=progress)
    return show(outcome, as_json, quiet)


@cli.command()
@click.option(
    "--config",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar="C.toml",
    help="The night's settings.",
)
@FAIL_ON
@TALK
def nightly(config: Path, fail_on: str | None, as_json: bool, verbose: int, quiet: bool) -> int:
    """Do the night's work: take new files from the inbox, ingest, analyse, report.

    What cron calls. It may be killed and started again at any time: a file is analysed once, and a dated folder is
    whole or not there. A second run beside a first one ends at once with status 5.

    \b
    Examples:
      gsfdi nightly --config /etc/gsfdi/arm-1.toml
      30 2 * * * gsfdi nightly --quiet --config /etc/gsfdi/arm-1.toml      in a crontab
    """
    start_log(verbose, quiet)
    from gsfdi.config import load_night
    from gsfdi.pipeline import nightly as stage

    settings = load_night(config)
    with Progress(quiet) as progress:
        outcome = stage.nightly(settings, progress=progress)
    return show(outcome, as_json, quiet, fail_on or settings.fail_on)


@cli.command()
@click.argument("names", nargs=-1, metavar="[TERM]...")
@TALK
def terms(names: Sequence[str], as_json: bool, verbose: int, quiet: bool) -> int:
    """List the physics and the faults that gsfdi knows, or explain some of them.

    \b
    Examples:
      gsfdi terms
      gsfdi terms stribeck_friction backlash
    """
    start_log(verbose, quiet)
    from gsfdi.pipeline import terms as stage

    return show(stage.terms(names), as_json, quiet)


@cli.command()
@click.argument("shell", type=click.Choice(("bash", "zsh", "fish")))
def completion(shell: str) -> int:
    """Print the script that completes gsfdi's commands and options in a shell.

    \b
    Examples:
      eval "$(gsfdi completion bash)"                                     now, or in ~/.bashrc
      gsfdi completion fish > ~/.config/fish/completions/gsfdi.fish
    """
    from click.shell_completion import get_completion_class

    kind = get_completion_class(shell)
    assert kind is not None
    click.echo(kind(cli, {}, "gsfdi", "_GSFDI_COMPLETE").source())
    return DONE


def show(outcome: "Outcome", as_json: bool, quiet: bool, fail_on: str | None = None) -> int:
    """Print what a stage found, name what was left out, and say how the command ends.

    Parameters
    ----------
    outcome : Outcome
        What the stage found.
    as_json : bool
        Whether standard output carries one JSON document in the place of lines.
    quiet : bool
        Whether lines are not wanted; damaged input is still named.
    fail_on : str, optional
        Level of a verdict from which the exit status is 1.

    Returns
    -------
    int
        Exit status; a verdict that reached `fail_on` outranks damaged input.
    """
    for line in outcome.log(notes=talkative()):
        click.echo(line, err=True)
    if as_json:
        click.echo(json.dumps(outcome.result, indent=1))
    elif not quiet:
        click.echo("\n".join(outcome.lines))
    if fail_on and any(level in LEVELS[LEVELS.index(fail_on) :] for level in outcome.levels):
        return FAILED_ON
    return DAMAGED if outcome.damaged else DONE


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows ``gsfdi``; the process's own by default.

    Returns
    -------
    int
        Exit status; whatever went wrong is one line on standard error.
    """
    for variable in BLAS_THREADS:
        # More threads make matrices of a joint's size ten times slower; this must precede the import of numpy.
        os.environ.setdefault(variable, "1")
    try:
        status = cli.main(args=None if arguments is None else list(arguments), prog_name="gsfdi", standalone_mode=False)
    except GsfdiError as error:
        return fail(str(error), error.exit_status)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "gsfdi"
        return fail(str(UnusableInputError(command, error.format_message(), f"see '{command} --help'")), UNUSABLE)
    except click.ClickException as error:
        return fail(error.format_message(), UNUSABLE)
    except (click.Abort, KeyboardInterrupt):
        return fail("gsfdi: interrupted; nothing is left half-written, the same call starts again", INTERRUPTED)
    except BrokenPipeError:
        # The reader of a pipe, `head` say, has had enough; Python would complain once more on closing stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except OSError as error:
        return fail(str(UnusableInputError(error.filename or "gsfdi", str(error.strerror or error))), UNUSABLE)
    except Exception as error:
        bug = f"gsfdi: {type(error).__name__}: {error}; this is a bug in gsfdi, -vv shows where"
        return fail(bug, UNUSABLE)
    return int(status or DONE)


def main() -> None:
    """Run the command of this process and exit with its status; being ended is like Ctrl-C."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(run())
