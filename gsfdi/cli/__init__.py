"""The command line: arguments in, results on standard output, the log on standard error, and an exit status.

A file per command names its options and hands them to the stage of the same name in `gsfdi.pipeline`. Nothing is
computed here, and nothing heavy is imported before a command runs, so that ``gsfdi --help`` is quick.
"""

from gsfdi.cli.entry import main, run
from gsfdi.cli.group import cli

__all__ = ["cli", "main", "run"]
