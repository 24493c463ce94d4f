"""Reconcile the EMPS drive from a model of its mass and controller alone; judge on the recording that was not used.

Run with the real recordings in ``$GSFDI_REAL`` or ``../shared/real``. Prints the terms, the force misfit of the closed
loop before and after on both recordings, and the processor time.
"""

import os
import time
from pathlib import Path

import numpy as np

from gsfdi import ingest
from gsfdi.model import JointModel
from gsfdi.modelfile import load_models
from gsfdi.reconcile import reconcile
from gsfdi.simulate import drive_of, replay
from gsfdi.types import JointRecord

HOME = Path(__file__).resolve().parents[1]
REAL = Path(os.environ.get("GSFDI_REAL", HOME.parent / "shared" / "real")) / "emps"


def misfit(record: JointRecord, model: JointModel) -> float:
    """Force of simulation less recording, relative, in per cent."""
    force = record[record.effort]
    return float(100 * np.linalg.norm(force - replay(model, drive_of(record, model)).effort) / np.linalg.norm(force))


def main() -> None:
    nominal = load_models(HOME / "configs" / "emps_joint.toml").for_joint("EMPS")
    (learnt,), (other,) = (ingest.read([REAL / name]).records for name in ("emps.parquet", "emps_pulses.parquet"))
    start = time.process_time()
    answer = reconcile([learnt], nominal)
    print(f"{answer.verdict}, {time.process_time() - start:.1f} s of processor time")
    for entry in answer.omitted_physics:
        numbers = {name: (number["value"], number["ci95"]) for name, number in entry["parameters"].items()}
        print(f"  {entry['term']}: p = {entry['probability']:.3f}, {numbers}")
    for group in answer.indistinguishable:
        print("  not told apart:", ", ".join(group))
    for name, record in (("emps", learnt), ("pulses", other)):
        after = misfit(record, answer.updated_model) if answer.updated_model else float("nan")
        print(f"  {name}: force misfit {misfit(record, nominal):.2f} % before, {after:.2f} % after")


if __name__ == "__main__":
    main()
