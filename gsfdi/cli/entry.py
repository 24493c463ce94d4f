"""One call of gsfdi: run a command; whatever goes wrong becomes one line on standard error and an exit status."""

import os
import signal
import sys
from collections.abc import Sequence

import click

from gsfdi.cli.group import cli
from gsfdi.cli.talk import DONE, INTERRUPTED, UNUSABLE
from gsfdi.console import fail
from gsfdi.errors import GsfdiError, UnusableInputError, is_interruption

BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
STOPPED = "gsfdi: interrupted; nothing is left half-written, the same call starts again"


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
        return fail(STOPPED, INTERRUPTED)
    except BrokenPipeError:
        # The reader of a pipe, `head` say, has had enough; Python would complain once more on closing stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except OSError as error:
        return fail(str(UnusableInputError(error.filename or "gsfdi", str(error.strerror or error))), UNUSABLE)
    except Exception as error:
        if is_interruption(error):
            return fail(STOPPED, INTERRUPTED)
        bug = f"gsfdi: {type(error).__name__}: {error}; this is a bug in gsfdi, -vv shows where"
        return fail(bug, UNUSABLE)
    return int(status or DONE)


def main() -> None:
    """Run the command of this process and exit with its status; being ended is like Ctrl-C."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(run())
