"""``gsfdi simulate``: joints of a model file in motion, as canonical telemetry."""

import math
from collections.abc import Sequence
from pathlib import Path

from gsfdi import ingest as reading
from gsfdi.canonical import write_parquet
from gsfdi.canonical_mcap import write_mcap
from gsfdi.errors import UnusableInputError, nearest
from gsfdi.model import TermUse
from gsfdi.modelfile import load_models, terms
from gsfdi.pipeline.outcome import Outcome, mappings_of, need
from gsfdi.simulate import simulate_record
from gsfdi.types import Problem


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
    added = [fault_of(fault) for fault in faults]
    models = load_models(model)
    problems: Sequence[Problem] = ()
    if replay is None:
        chosen = [models.for_joint(joint) for joint in joints] or list(models)
        records = [
            simulate_record(one, faults=added, seed=seed + 1000 * i, duration=duration) for i, one in enumerate(chosen)
        ]
    else:
        batch = reading.read(reading.gather([str(replay)]), mappings_of(mappings), joints)
        need(batch.records, batch.problems)
        problems = batch.problems
        records = [
            simulate_record(
                models.for_joint(one.joint), replay=one, faults=added, seed=seed + 1000 * i, open_loop=open_loop
            )
            for i, one in enumerate(batch.records)
        ]
    write = write_parquet if out.suffix == ".parquet" else write_mcap
    write(out, records)
    rows = [{"joint": one.joint, "samples": len(one.t), "span_s": float(one.t[-1])} for one in records]
    result = {"schema": "gsfdi/simulation/1", "path": str(out), "seed": seed, "faults": list(faults), "joints": rows}
    lines = [f"{row['joint']}: {row['samples']} samples, {row['span_s']:.1f} s" for row in rows]
    return Outcome(result, [*lines, str(out)], problems)


def fault_of(text: str) -> TermUse:
    """Read ``ID=VALUE[@SECONDS]``.

    Parameters
    ----------
    text : str
        For example ``torque_constant_drift=-0.01@7.5``.

    Examples
    --------
    >>> fault_of("backlash=2e-4@7.5")
    TermUse(term='backlash', values={'half_width_rad': 0.0002}, side=None, onset=7.5)
    """
    name, equals, rest = text.partition("=")
    value, _, onset = rest.partition("@")
    known = terms()
    if name not in known:
        raise UnusableInputError(f"--fault {text}", f"no term is called {name!r}", nearest(name, known))
    try:
        numbers = [float(number) for number in ([value, onset] if onset else [value])]
    except ValueError:
        numbers = [math.nan]
    if not equals or not all(math.isfinite(number) for number in numbers):
        raise UnusableInputError(f"--fault {text}", "is not ID=VALUE or ID=VALUE@SECONDS", f"write {name}=0.1@7.5")
    first = known[name].params[0]
    if not first.low <= numbers[0] <= first.high:
        what = f"{first.name} is not within {first.low:g} to {first.high:g} {first.unit}".rstrip()
        raise UnusableInputError(f"--fault {text}", what, "give a possible value")
    return TermUse(name, {first.name: numbers[0]}, onset=numbers[1] if onset else None)
