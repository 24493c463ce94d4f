"""``gsfdi analyze``: a verdict on every joint of a batch."""

from typing import Any

import click

from gsfdi.cli.talk import Talk, talking
from gsfdi.options import FAIL_ON, JOINT, MAPPING, MODEL, OUT, STORE, sources_of, working


@click.command()
@sources_of("BATCH...")
@STORE
@MAPPING
@JOINT
@click.option("--baseline", "name", default="default", show_default=True, help="Name of the baseline to judge against.")
@MODEL
@OUT
@FAIL_ON
@working
@talking
def analyze(talk: Talk, fail_on: str | None, **asked: Any) -> int:
    """Judge every joint of a batch against its baseline.

    Writes verdicts.json, verdicts.csv and report.html. A joint that could not be assessed is never called normal.

    \b
    Examples:
      gsfdi analyze tonight.mcap --out report
      gsfdi analyze /data/2026-11-21 --baseline after-repair --fail-on distress
      gsfdi analyze tonight.parquet --joint SH1 --json | jq '.joints[0].says'
    """
    from gsfdi.pipeline import analyze as stage

    with talk.progress() as progress:
        outcome = stage.analyze(**asked, progress=progress)
    return talk.show(outcome, fail_on)
