"""``gsfdi simulate``: joints of a model file in motion, as canonical telemetry."""

from collections.abc import Sequence
from pathlib import Path

from gsfdi import ingest as reading
from gsfdi.canonical import write_parquet
from gsfdi.canonical_mcap import write_mcap
from gsfdi.errors import UnusableInputError
from gsfdi.modelfile import load_models
from gsfdi.pipeline.outcome import Outcome, absent, mappings_of, need
from gsfdi.simulate import fault_of, simulate_record
from gsfdi.types import JointRecord, Problem


def simulate(
    model: Path,
    *,
    out: Path,
    replay: Path | None = None,
    mappings: Sequence[Path] = (),
    joints: Sequence[str] = (),
    faults: Sequence[str] = (),
    open_loop: bool = False,
    duration: float = 180.0,
    seed: int = 0,
) -> Outcome:
    """Simulate the joints of a model file, and write canonical telemetry.

    Parameters
    ----------
    model : Path
        Model file.
    out : Path
        File to write; its ending says the format.
    replay : Path, optional
        Recording that gives setpoint, initial state and temperature.
    mappings : sequence of Path
        Mapping files for `replay`.
    joints : sequence of str
        Joints wanted; all if empty.
    faults : sequence of str
        ``ID=VALUE[@SECONDS]`` each.
    open_loop : bool
        Drive the recorded current instead of closing the loop.
    duration : float
        Seconds to simulate where there is no `replay`.
    seed : int
        Seed of the noise; each joint draws from a stream of its own.
    """
    if out.suffix not in (".parquet", ".mcap"):
        raise UnusableInputError(out, "ends in no format that can be written", "end it in .parquet or .mcap")
    if open_loop and replay is None:
        raise UnusableInputError("--open-loop", "there is no recorded current to drive", "add --replay REC")
    models = load_models(model)
    problems: Sequence[Problem] = ()
    recorded: Sequence[JointRecord | None]
    if replay is None:
        chosen = [models.for_joint(joint) for joint in joints] or list(models)
        recorded = [None] * len(chosen)
    else:
        batch = reading.read(reading.gather([str(replay)]), mappings_of(mappings), joints)
        need(batch.records, batch.problems)
        problems = [*batch.problems, *absent(joints, (record.joint for record in batch.records))]
        recorded = batch.records
        chosen = [models.for_joint(record.joint) for record in batch.records]
    records = [
        simulate_record(
            one,
            replay=record,
            faults=[fault_of(fault, one.axis) for fault in faults],
            seed=seed + 1000 * number,
            open_loop=open_loop,
            duration=duration,
        )
        for number, (one, record) in enumerate(zip(chosen, recorded, strict=True))
    ]
    write = write_parquet if out.suffix == ".parquet" else write_mcap
    write(out, records)
    rows = [{"joint": one.joint, "samples": len(one.t), "span_s": float(one.t[-1])} for one in records]
    result = {"schema": "gsfdi/simulation/1", "path": str(out), "seed": seed, "faults": list(faults), "joints": rows}
    lines = [f"{row['joint']}: {row['samples']} samples, {row['span_s']:.1f} s" for row in rows]
    return Outcome(result, [*lines, str(out)], problems)
