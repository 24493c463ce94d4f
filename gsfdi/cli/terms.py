"""``gsfdi terms``: the physics and the faults that gsfdi knows."""

from collections.abc import Sequence

import click

from gsfdi.cli.talk import Talk, talking


@click.command()
@click.argument("names", nargs=-1, metavar="[TERM]...")
@talking
def terms(talk: Talk, names: Sequence[str]) -> int:
    """List the physics and the faults that gsfdi knows, or explain some of them.

    \b
    Examples:
      gsfdi terms
      gsfdi terms stribeck_friction backlash
    """
    from gsfdi.pipeline import terms as stage

    return talk.show(stage.terms(names))
