"""``gsfdi nightly``: all of a night's work in one call."""

from pathlib import Path

import click

from gsfdi.cli.talk import Talk, talking
from gsfdi.options import FAIL_ON, FILE


@click.command()
@click.option("--config", type=FILE, required=True, metavar="C.toml", help="The night's settings.")
@FAIL_ON
@talking
def nightly(talk: Talk, config: Path, fail_on: str | None) -> int:
    """Do the night's work: take new files from the inbox, ingest, analyse, report.

    What cron calls. It may be killed and started again at any time: a file is analysed once, and a dated folder is
    whole or not there. A second run beside a first one ends at once with status 5.

    \b
    Examples:
      gsfdi nightly --config /etc/gsfdi/arm-1.toml
      30 2 * * * gsfdi nightly --quiet --config /etc/gsfdi/arm-1.toml      in a crontab
    """
    from gsfdi.config import load_night
    from gsfdi.pipeline import nightly as stage

    settings = load_night(config)
    with talk.progress() as progress:
        outcome = stage.nightly(settings, progress=progress)
    return talk.show(outcome, fail_on or settings.fail_on)
