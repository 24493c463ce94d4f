"""The group of all commands, and the page that teaches a first night."""

import click

from gsfdi import __version__
from gsfdi.cli.analyze import analyze
from gsfdi.cli.baseline import baseline
from gsfdi.cli.completion import completion
from gsfdi.cli.ingest import ingest
from gsfdi.cli.nightly import nightly
from gsfdi.cli.prove import prove
from gsfdi.cli.reconcile import reconcile
from gsfdi.cli.simulate import simulate
from gsfdi.cli.talk import UNUSABLE
from gsfdi.cli.terms import terms


class Teaching(click.Group):
    """The group of commands, in the order of a first night rather than of the alphabet."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order in which they were added below."""
        return list(self.commands)


@click.group(
    cls=Teaching,
    invoke_without_command=True,
    subcommand_metavar="COMMAND [ARGS]...",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit status: 0 done; 1 a verdict reached --fail-on; 2 unusable call or input; 3 done, but some input was "
    "damaged or left out; 4 no baseline; 5 another run holds the lock.",
)
@click.version_option(__version__, prog_name="gsfdi")
@click.pass_context
def cli(context: click.Context) -> None:
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
    if context.invoked_subcommand is None:
        click.echo(context.get_help(), err=True)
        context.exit(UNUSABLE)


for command in (ingest, baseline, analyze, simulate, reconcile, prove, nightly, terms, completion):
    cli.add_command(command)
