"""What a user can put right, said in full: which thing, what is wrong with it, what would mend it.

Library code raises these; only `gsfdi.cli` prints them and turns them into an exit status.
"""

import difflib
from collections.abc import Iterable


class GsfdiError(Exception):
    """A failure that its reader can mend.

    Parameters
    ----------
    subject : str
        The file, key or name that is at fault.
    what : str
        What is wrong with it, with the value found.
    mend : str
        What would put it right.
    """

    exit_status = 2

    def __init__(self, subject: object, what: str, mend: str = "") -> None:
        self.subject, self.what, self.mend = str(subject), what, mend
        super().__init__(one_line(f"{subject}: {what}" + (f"; {mend}" if mend else "")))

    def __reduce__(self) -> tuple[type["GsfdiError"], tuple[str, str, str]]:
        """Pickle by the three parts, so that a worker process can raise it here."""
        return type(self), (self.subject, self.what, self.mend)


class UnusableInputError(GsfdiError):
    """A file, call or configuration that cannot be used as it is."""


class BaselineError(GsfdiError):
    """There is no baseline, or its checksum fails."""

    exit_status = 4


class LockedError(GsfdiError):
    """Another run holds the lock."""

    exit_status = 5


def one_line(text: str) -> str:
    """`text` on a single line, whatever a file name or an exception put into it."""
    return " ".join(text.split())


def is_interruption(error: BaseException) -> bool:
    """Whether an error is Ctrl-C in disguise: raised within a compiled function it comes out as an error of that.

    Examples
    --------
    >>> error = SystemError("a result with an exception set")
    >>> error.__cause__ = KeyboardInterrupt()
    >>> is_interruption(error), is_interruption(SystemError("a bug"))
    (True, False)
    """
    return isinstance(error, KeyboardInterrupt) or (error.__cause__ is not None and is_interruption(error.__cause__))


def nearest(name: str, known: Iterable[str]) -> str:
    """Advice that follows a name nobody knows.

    Examples
    --------
    >>> nearest("stribek_friction", ["coulomb_friction", "stribeck_friction"])
    "did you mean 'stribeck_friction'? known: coulomb_friction, stribeck_friction"
    """
    names = list(known)
    close = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return f"{hint}known: {', '.join(names)}"
