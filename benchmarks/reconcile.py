"""Reconcile the EMPS drive from a model of its mass and controller alone; judge on the recording that was not used.

Run with the real recordings in ``$GSFDI_REAL`` or ``../shared/real``. Prints the terms, the force misfit before and
after on both recordings (in the simulated closed loop, and by inverse dynamics), and the processor time.
"""

import os
import time
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

from gsfdi import ingest
from gsfdi.model import JointModel, TermUse
from gsfdi.modelfile import load_models, terms
from gsfdi.motion import ANGLE, DIRECTION, QUANTITIES, SPEED, STATES
from gsfdi.packed import values_of
from gsfdi.reconcile import reconcile
from gsfdi.simulate import drive_of, replay
from gsfdi.types import Array, JointRecord

HOME = Path(__file__).resolve().parents[1]
REAL = Path(os.environ.get("GSFDI_REAL", HOME.parent / "shared" / "real")) / "emps"


def misfit(record: JointRecord, model: JointModel) -> float:
    """Force of simulation less recording, relative, in per cent."""
    force = record[record.effort]
    return float(100 * np.linalg.norm(force - replay(model, drive_of(record, model)).effort) / np.linalg.norm(force))


def balance(record: JointRecord, model: JointModel) -> float:
    """Force that the model asks for to move as recorded, less the recorded one, relative, in per cent.

    Positions, friction and force pass the same filter without lag (M. Gautier, Dynamic identification of robots with
    power model, ICRA 1997). A force is held for a sample, so that what moves the joint at an instant is half old.
    """
    period = float(np.median(np.diff(record.t)))
    b, a = butter(4, 20.0, fs=1.0 / period)
    position = filtfilt(b, a, record["position"])
    speed = np.gradient(position, record.t)
    asked, late = model.plant.output_inertia * np.gradient(speed, record.t), 0.5 * period
    for use in model.physics:
        if use.term == "actuation_delay":
            late += use.values["delay_s"]
        else:
            asked += filtfilt(b, a, friction(use, position, speed))
    force = np.interp(record.t - late, record.t, filtfilt(b, a, record[record.effort]))
    inner = slice(200, -200)
    return float(100 * np.linalg.norm((force - asked)[inner]) / np.linalg.norm(force[inner]))


def friction(use: TermUse, position: Array, speed: Array) -> Array:
    """Force with which a term of friction resists along a motion."""
    term = terms()[use.term]
    m, s, p = np.zeros(QUANTITIES), np.full(STATES, np.nan), values_of(use)
    found = []
    for angle, rate in zip(position, speed, strict=True):
        m[ANGLE], m[SPEED], m[DIRECTION] = angle, rate, np.sign(rate)
        found.append(term.law(m, p, s) * (m[DIRECTION] if term.place == "dry" else 1.0))
    return np.array(found)


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
        inverse = balance(record, answer.updated_model) if answer.updated_model else float("nan")
        print(f"  {name}: force misfit {misfit(record, nominal):.2f} % before, {after:.2f} % after in closed loop,")
        print(f"      {balance(record, nominal):.2f} % before, {inverse:.2f} % after by inverse dynamics")


if __name__ == "__main__":
    main()
