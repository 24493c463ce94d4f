"""``gsfdi baseline``: what every joint does while it is free of faults."""

from typing import Any

import click

from gsfdi.cli.talk import Talk, talking
from gsfdi.options import JOINT, MAPPING, MODEL, STORE, sources_of, working


@click.command()
@sources_of("SRC...")
@STORE
@MAPPING
@JOINT
@MODEL
@click.option("--name", default="default", show_default=True, help="Name of the baseline.")
@working
@talking
def baseline(talk: Talk, **asked: Any) -> int:
    """Learn what every joint does while it is free of faults.

    Give several batches, of motions like those of the nights to come. With a model the parity and innovation
    detectors work too, and the verdicts can name a part.

    \b
    Examples:
      gsfdi baseline healthy/*.mcap --model configs/era_arm.toml
      gsfdi baseline week-31/ --name after-repair
    """
    from gsfdi.pipeline import baseline as stage

    with talk.progress() as progress:
        outcome = stage.baseline(**asked, progress=progress)
    return talk.show(outcome)
