"""``gsfdi reconcile``: the physics that a simulation left out."""

from typing import Any

import click

from gsfdi.cli.talk import Talk, talking
from gsfdi.options import JOINT, MAPPING, OUT, model_to, sources_of, working


@click.command()
@sources_of("REC...")
@MAPPING
@JOINT
@model_to("question")
@click.option("--without", multiple=True, metavar="TERM", help="Leave this term out of the library; may be repeated.")
@OUT
@working
@talking
def reconcile(talk: Talk, **asked: Any) -> int:
    """Find where simulation and recording differ, and the physics that was left out.

    Writes reconcile.json, report.html, and JOINT.updated_model.toml for every joint whose mismatch was explained; the
    fit is shown on data that took no part in choosing or fitting.

    \b
    Examples:
      gsfdi reconcile slew-*.parquet --model configs/era_joint.toml --out reconciled
      gsfdi reconcile monday.mcap --model arm.toml --joint EL1 --jobs 2
    """
    from gsfdi.pipeline import reconcile as stage

    with talk.progress() as progress:
        outcome = stage.reconcile(**asked, progress=progress)
    return talk.show(outcome)
