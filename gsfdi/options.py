"""Arguments and options that several commands share."""

from collections.abc import Callable
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


SOURCES = click.argument("sources", nargs=-1, required=True, metavar="SRC...")
STORE = click.option(
    "--store",
    type=click.Path(file_okay=False, path_type=Path),
    envvar="GSFDI_STORE",
    default=Path(".gsfdi"),
    show_default="$GSFDI_STORE, else .gsfdi",
    help="Folder that keeps telemetry, baselines and history.",
)
MAPPING = click.option(
    "--mapping",
    "mappings",
    type=click.Path(dir_okay=False, path_type=Path),
    multiple=True,
    metavar="M.toml",
    help="How an odd log is to be read; repeat it for a file that holds several robots.",
)
JOINT = click.option("--joint", "joints", multiple=True, metavar="NAME", help="Only this joint; may be repeated.")
MODEL = click.option(
    "--model", type=click.Path(dir_okay=False, path_type=Path), metavar="M.toml", help="Model of the joint or the arm."
)
OUT = click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path(),
    show_default="the working folder",
    help="Folder for what is written.",
)
SEED = click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of every random draw."
)
WORK = options(
    click.option(
        "--jobs",
        type=click.IntRange(min=1),
        default=None,
        metavar="N",
        show_default="the processors there are",
        help="At most this many processes, a joint to each.",
    ),
    click.option("--scheduler", metavar="ADDRESS", help="Hand the joints to this running Dask cluster instead."),
)
TALK = options(
    click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON document."),
    click.option("-v", "--verbose", count=True, help="Say more; -vv adds tracebacks."),
    click.option("-q", "--quiet", is_flag=True, help="Say nothing but what is wrong."),
)
FAIL_ON = click.option(
    "--fail-on", type=click.Choice(LEVELS), help="Exit with status 1 if a verdict is at or above this level."
)
