"""``gsfdi prove``: reconcile put to the proof on concealed data."""

from pathlib import Path
from typing import Any

import click

from gsfdi.cli.talk import Talk, talking
from gsfdi.options import OUT, SEED, jobs_for


@click.command()
@click.option(
    "--cases", type=click.IntRange(min=1), default=20, show_default=True, metavar="N", help="Concealed cases."
)
@SEED
@OUT
@click.option(
    "--check",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="DIR",
    help="Check the seal of an earlier proof and score its stored answers again.",
)
@jobs_for("At most this many processes.")
@talking
def prove(talk: Talk, check: Path | None, jobs: int | None, **asked: Any) -> int:
    """Prove reconcile on concealed data whose answers are sealed before it starts.

    Writes proof.json and proof.html. A seed of your own makes cases that nobody has seen before.

    \b
    Examples:
      gsfdi prove --cases 20 --seed 8143 --out proof
      gsfdi prove --check proof
    """
    from gsfdi.pipeline import prove as stage
    from gsfdi.workers import Crew

    if check is not None:
        return talk.show(stage.check(check))
    with talk.progress() as progress:
        outcome = stage.prove(**asked, crew=Crew(jobs), progress=progress)
    return talk.show(outcome)
