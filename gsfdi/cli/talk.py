"""What every command says, and how: lines or JSON on standard output, what was left out on standard error."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from gsfdi.console import Progress, start_log, talkative
from gsfdi.options import LEVELS, options

if TYPE_CHECKING:
    from gsfdi.pipeline.outcome import Outcome

DONE, FAILED_ON, UNUSABLE, DAMAGED, INTERRUPTED = 0, 1, 2, 3, 130


@dataclass(frozen=True, slots=True)
class Talk:
    """How one call of a command is to speak.

    Parameters
    ----------
    as_json : bool
        Whether standard output carries one JSON document in the place of lines.
    quiet : bool
        Whether lines are not wanted; damaged input is still named.
    """

    as_json: bool
    quiet: bool

    def progress(self) -> Progress:
        """Begin a bar that shows how far the work has come."""
        return Progress(self.quiet)

    def show(self, outcome: "Outcome", fail_on: str | None = None) -> int:
        """Print what a stage found, name what was left out, and say how the command ends.

        Parameters
        ----------
        outcome : Outcome
            What the stage found.
        fail_on : str, optional
            Level of a verdict from which the exit status is 1.

        Returns
        -------
        int
            Exit status; a verdict that reached `fail_on` outranks damaged input.
        """
        for line in outcome.log(notes=talkative()):
            click.echo(line, err=True)
        if self.as_json:
            click.echo(json.dumps(outcome.result, indent=1))
        elif not self.quiet:
            click.echo("\n".join(outcome.lines))
        if fail_on and any(level in LEVELS[LEVELS.index(fail_on) :] for level in outcome.levels):
            return FAILED_ON
        return DAMAGED if outcome.damaged else DONE


def talking(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options on how to speak, which `command` takes as one ``talk``; the log begins before it runs."""

    @wraps(command)
    def started(as_json: bool, verbose: int, quiet: bool, **asked: Any) -> int:
        start_log(verbose, quiet)
        return command(talk=Talk(as_json, quiet), **asked)

    return options(
        click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON document."),
        click.option("-v", "--verbose", count=True, help="Say more; -vv adds tracebacks."),
        click.option("-q", "--quiet", is_flag=True, help="Say nothing but what is wrong."),
    )(started)
