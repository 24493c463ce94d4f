"""Arguments and options that several commands share."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

LEVELS = ("warning", "distress", "critical")
"""Levels of a verdict that ask for something, least first."""
F = TypeVar("F", bound=Callable[..., Any])


def options(*decorators: Callable[[Any], Any]) -> Callable[[F], F]:
    """Several options as one decorator, shown by ``--help`` in this order."""

    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


FILE = click.Path(dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)
STORE = click.option(
    "--store",
    type=FOLDER,
    envvar="GSFDI_STORE",
    default=Path(".gsfdi"),
    show_default="$GSFDI_STORE, else .gsfdi",
    help="Folder that keeps telemetry, baselines and history.",
)
MAPPING = click.option(
    "--mapping",
    "mappings",
    type=FILE,
    multiple=True,
    metavar="M.toml",
    help="How an odd log is to be read; repeat it for a file that holds several robots.",
)
JOINT = click.option("--joint", "joints", multiple=True, metavar="NAME", help="Only this joint; may be repeated.")
MODEL = click.option("--model", type=FILE, metavar="M.toml", help="Model of the joint or the arm.")
OUT = click.option(
    "--out",
    type=FOLDER,
    default=Path(),
    show_default="the working folder",
    help="Folder for what is written.",
)
SEED = click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of every random draw."
)
FAIL_ON = click.option(
    "--fail-on", type=click.Choice(LEVELS), help="Exit with status 1 if a verdict is at or above this level."
)


def sources_of(metavar: str) -> Callable[[F], F]:
    """Telemetry that a command reads: files, folders, globs."""
    return click.argument("sources", nargs=-1, required=True, metavar=metavar)


def model_to(verb: str) -> Callable[[F], F]:
    """Model that a command cannot do without."""
    return click.option("--model", type=FILE, required=True, metavar="M.toml", help=f"Model to {verb}.")


def jobs_for(help: str) -> Callable[[F], F]:
    """How many processes at most."""
    return click.option(
        "--jobs", type=click.IntRange(min=1), metavar="N", show_default="the processors there are", help=help
    )


def working(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options on who does the work, which `command` takes as one ``crew``."""

    @wraps(command)
    def manned(jobs: int | None, scheduler: str | None, **asked: Any) -> int:
        from gsfdi.workers import Crew

        return command(crew=Crew(jobs, scheduler), **asked)

    return options(
        jobs_for("At most this many processors, a joint to each."),
        click.option("--scheduler", metavar="ADDRESS", help="Hand the joints to this running Dask cluster instead."),
    )(manned)
