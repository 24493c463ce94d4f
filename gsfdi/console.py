"""Standard error: the log, the progress bar on a terminal, and the one line that says what went wrong."""

import logging
import sys
import traceback
from types import TracebackType

from gsfdi.errors import one_line

LOG = logging.getLogger("gsfdi")


def start_log(verbose: int, quiet: bool) -> None:
    """Send gsfdi's log to standard error.

    Parameters
    ----------
    verbose : int
        How often ``-v`` was given.
    quiet : bool
        Whether only errors are wanted.
    """
    level = logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    LOG.handlers.clear()
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(levelname)s %(message)s" if verbose else "%(message)s"))
    LOG.addHandler(handler)
    LOG.setLevel(level)
    LOG.propagate = False
    divert_warnings(LOG.handlers[0] if verbose > 1 else logging.NullHandler())


def talkative() -> bool:
    """Whether ``-v`` was given."""
    return LOG.isEnabledFor(logging.INFO)


def divert_warnings(handler: logging.Handler) -> None:
    """Send Python's warnings to `handler`: they help whoever mends gsfdi, not whoever runs it at night.

    Parameters
    ----------
    handler : logging.Handler
        Where they go.
    """
    logging.captureWarnings(True)
    warned = logging.getLogger("py.warnings")
    warned.handlers, warned.propagate = [handler], False


def fail(line: str, status: int) -> int:
    """Say on one line of standard error what went wrong; with ``-vv`` also where.

    Parameters
    ----------
    line : str
        What went wrong, and what would mend it.
    status : int
        Exit status that goes with it.

    Returns
    -------
    int
        `status`.
    """
    if LOG.isEnabledFor(logging.DEBUG):
        sys.stderr.write(traceback.format_exc())
    sys.stderr.write(one_line(line) + "\n")
    return status


class Progress:
    """A bar on standard error while work goes on; nothing where that is not a terminal.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing at all.
    """

    def __init__(self, quiet: bool = False) -> None:
        self._shown = not quiet and sys.stderr.isatty()
        self._drawn = False

    def __call__(self, done: int, total: int, what: str) -> None:
        """Draw the bar.

        Parameters
        ----------
        done, total : int
            Pieces of work.
        what : str
            What is going on.
        """
        if self._shown and total:
            filled = round(24 * done / total)
            sys.stderr.write(f"\r\x1b[K{what} [{'#' * filled}{'.' * (24 - filled)}] {done}/{total}")
            sys.stderr.flush()
            self._drawn = True

    def __enter__(self) -> "Progress":
        """Start with nothing drawn."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wipe the bar, so that what follows starts on a clean line."""
        if self._drawn:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()
