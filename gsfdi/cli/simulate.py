"""``gsfdi simulate``: telemetry from a model."""

from pathlib import Path
from typing import Any

import click

from gsfdi.cli.talk import Talk, talking
from gsfdi.options import FILE, JOINT, MAPPING, SEED, model_to


@click.command()
@model_to("simulate")
@click.option("--replay", type=click.Path(path_type=Path), metavar="REC", help="Recording whose setpoint is replayed.")
@MAPPING
@JOINT
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="ID=VALUE[@SECONDS]",
    help="A term of physics or a fault, from its onset on; may be repeated. 'gsfdi terms' lists the ids.",
)
@click.option("--open-loop", is_flag=True, help="Drive the recorded current instead of closing the loop.")
@click.option(
    "--duration",
    type=click.FloatRange(min=0.0, min_open=True),
    default=180.0,
    show_default=True,
    metavar="SECONDS",
    help="How long to simulate without --replay.",
)
@SEED
@click.option("--out", type=FILE, required=True, metavar="FILE", help="FILE.parquet or FILE.mcap.")
@talking
def simulate(talk: Talk, **asked: Any) -> int:
    """Simulate a joint, or every joint of an arm.

    Without --replay the joints follow a training trajectory; with it, the recorded setpoint from the recording's own
    initial state and at its temperature, the loop closed by the model's controller.

    \b
    Examples:
      gsfdi simulate --model configs/era_joint.toml --out healthy.parquet
      gsfdi simulate --model configs/era_joint.toml --fault torque_constant_drift=-0.01@7.5 --out drift.mcap
      gsfdi simulate --model SH1.updated_model.toml --replay slew.parquet --out replay.parquet
    """
    from gsfdi.pipeline import simulate as stage

    return talk.show(stage.simulate(**asked))
