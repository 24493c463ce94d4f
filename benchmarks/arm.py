"""Reconcile joint 1 of an industrial arm whose drive gain nobody knows; judge on a recording of another day.

Run with the real recordings in ``$GSFDI_REAL`` or ``../shared/real``. The nominal model is an inertia and a torque
constant, both guessed and both doubted by half: a rigid joint tells only their ratio, so that friction is compared in
amperes. Learnt on the recording in which joint 1 moves alone, judged on other days, when all six joints move: what it
then carries is another inertia, so that its friction is judged beside the inertia which suits that day best, too.
"""

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from gsfdi import ingest
from gsfdi.mapping import load_mapping
from gsfdi.model import JointModel, Plant
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.remainder import missing_torque
from gsfdi.types import JointRecord

HOME = Path(__file__).resolve().parents[1]
REAL = Path(os.environ.get("GSFDI_REAL", HOME.parent / "shared" / "real")) / "ur10e"
LEARNT = "jointwise_motion__ur-20_01_22-joint_1.csv"
OTHERS = (
    "identification_data__ur-19_10_01-13_51_41.csv",
    "identification_data__ur-20_02_10-20sec_7harm.csv",
    "identification_data__ur-20_02_19_15harm50secLoad.csv",
)
GUESS = JointModel(
    name="J1",
    structure="rigid",
    plant=Plant(output_inertia=5.0, gear_ratio=1.0, torque_constant=10.0),
    trust={"output_inertia": 0.5, "torque_constant": 0.5},
)


def recorded(name: str) -> JointRecord:
    """Joint 1 of a file, as the product reads it; the longest part where corrupt rows cut it."""
    mapping = load_mapping(HOME / "configs" / "ur10e.toml")
    return max(ingest.read([REAL / name], [mapping], ["J1"]).records, key=lambda record: len(record.t))


def missing(record: JointRecord, model: JointModel) -> float:
    """Torque that `model` lacks on this recording as a share of the drive's, root mean square, in per cent."""
    stand = bench([record], model)
    torque = missing_torque(stand, [e[0] for e in stand.innovations([model])])
    drive = model.plant.torque_constant * record["motor_current"]
    return float(100 * np.sqrt(np.mean(np.concatenate(torque) ** 2) / np.nanmean(drive**2)))


def posed(record: JointRecord, model: JointModel) -> JointModel:
    """Give `model` the inertia with which least is missing on this recording: that of the arm's posture then."""

    def scaled(log_factor: float) -> JointModel:
        inertia = float(np.exp(log_factor)) * model.plant.output_inertia
        return replace(model, plant=replace(model.plant, output_inertia=inertia))

    best = minimize_scalar(lambda x: missing(record, scaled(x)), bounds=(-1.5, 1.5), method="bounded")
    return scaled(float(best.x))


def main() -> None:
    learnt = recorded(LEARNT)
    for gain in (5.0, 10.0, 20.0):
        guess = replace(GUESS, plant=replace(GUESS.plant, torque_constant=gain))
        start = time.process_time()
        answer = reconcile([learnt], guess)
        print(f"{gain:.0f} N m/A guessed: {answer.verdict}, {time.process_time() - start:.1f} s of processor time")
        model = answer.updated_model
        if model is None:
            print(f"  {answer.says}")
            continue
        ratio = model.plant.output_inertia / model.plant.torque_constant
        print(f"  inertia over torque constant: {ratio:.3f} A s²/rad")
        for use in model.physics:
            unit = {name: model.plant.torque_constant if "_nm" in name else 1.0 for name in use.values}
            print(f"  {use.term}, torques in A:", {k: round(v / unit[k], 4) for k, v in use.values.items()})
        for name in (LEARNT, *OTHERS):
            record = recorded(name)
            alone = missing(record, posed(record, model))
            print(f"  {name}: {missing(record, guess):.0f} % missing before, {missing(record, model):.0f} % after,")
            print(f"      {alone:.0f} % with that day's inertia")


if __name__ == "__main__":
    main()
