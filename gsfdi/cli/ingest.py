"""``gsfdi ingest``: telemetry into the store."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from gsfdi.cli.talk import Talk, talking
from gsfdi.options import JOINT, MAPPING, STORE, sources_of


@click.command()
@sources_of("SRC...")
@STORE
@MAPPING
@JOINT
@click.option("--dry-run", is_flag=True, help="Say what the files hold and how they would be read; store nothing.")
@talking
def ingest(talk: Talk, sources: Sequence[str], mappings: Sequence[Path], dry_run: bool, **asked: Any) -> int:
    """Read MCAP, Parquet or CSV telemetry into the store.

    SRC is a file, a folder or a glob. The same bytes twice are one batch. What is damaged is masked, counted and
    named, never repaired.

    \b
    Examples:
      gsfdi ingest /data/inbox --store /data/store
      gsfdi ingest 'night-*.mcap' --mapping arm-1.toml --mapping arm-2.toml
      gsfdi ingest odd.csv --dry-run
    """
    from gsfdi.pipeline import ingest as stage

    if dry_run:
        return talk.show(stage.describe(sources, mappings))
    with talk.progress() as progress:
        outcome = stage.ingest(sources, mappings=mappings, progress=progress, **asked)
    return talk.show(outcome)
