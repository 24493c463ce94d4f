"""Reconcile a bare motor turned slowly, and hold the cogging that is found against its measured map.

Run with the real recordings in ``$GSFDI_REAL`` or ``../shared/real``. The motor's log is 430 rows a second of position
and current, read one after the other over a serial line: both pass the same filter without lag and are taken at an
even rate. The nominal model is the rotor alone, its inertia and torque constant as its owner measured them (an
acceleration of 15 rad/s² at 0.4 A, which he calls 3 N mm). The map, a holding current every 16 counts of a turn, takes
no part; it is only what the answer is compared with.

`reconcile` is given each sweep as it was logged, and at two even rates. Its answer is given back to it in the end.
"""

import os
import time
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

from gsfdi.model import JointModel, Plant
from gsfdi.reconcile import Reconciliation, reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.remainder import missing_torque
from gsfdi.types import Array, JointRecord

HOME = Path(__file__).resolve().parents[1]
REAL = Path(os.environ.get("GSFDI_REAL", HOME.parent / "shared" / "real")) / "odrive_cogging"
COUNTS = 8192
MAP = "coggingmap_0__cogging_measure_final_a_16"
NOMINAL = JointModel(
    name="M0",
    structure="rigid",
    plant=Plant(output_inertia=2.5e-4, gear_ratio=1.0, torque_constant=2.5e-4 * 15.0 / 0.4),
)
SWEEPS = ("slow2_slower__comp_0", "slow2_slower__nocomp_0", "slow2__nocomp_0", "slow2__nocomp_1")
"""At 0.03 turns/s, of which the first with the drive's own compensation, and at 0.1 turns/s."""


def logged(name: str) -> JointRecord:
    """One sweep as it was logged, less its start."""
    t, counts, current = np.load(REAL / f"{name}.npy")
    moves = t > t[0] + 0.5
    channels = {"position": counts[moves] * 2 * np.pi / COUNTS, "motor_current": current[moves]}
    return JointRecord("odrive", "M0", 0, t[moves] - t[moves][0], channels, source=name)


def even(name: str, rate: float) -> JointRecord:
    """One sweep at an even `rate` [Hz], both channels low-passed alike at a fifth of it, less its start."""
    t, counts, current = np.load(REAL / f"{name}.npy")
    fine = np.arange(t[0] + 0.5, t[-1], 0.002)
    b, a = butter(3, 0.2 * rate, fs=500.0)
    step = round(500.0 / rate)
    position, amperes = (
        filtfilt(b, a, np.interp(fine, t, values))[::step] for values in (counts * 2 * np.pi / COUNTS, current)
    )
    channels = {"position": position, "motor_current": amperes}
    return JointRecord("odrive", "M0", 0, fine[::step] - fine[0], channels, source=name)


def orders_of(angle: Array, values: Array, orders: Array) -> Array:
    """Amplitude of the waves of `orders` in `values` over `angle` [rad], all fitted at once."""
    turn = np.outer(angle, orders)
    waves = np.hstack([np.sin(turn), np.cos(turn), np.ones((len(angle), 1))])
    found = np.linalg.lstsq(waves, values, rcond=None)[0]
    return np.asarray(np.hypot(found[: len(orders)], found[len(orders) : -1]))


def map_of(name: str) -> tuple[Array, Array]:
    """Angle [rad] and holding current [A] of a measured map."""
    held = np.load(REAL / f"{name}.npy")
    at = np.flatnonzero(held)
    return at * 2 * np.pi / COUNTS, held[at]


def lacking(record: JointRecord) -> Array:
    """Current [A] that makes the torque which the nominal model lacks, moment by moment, without naming any physics."""
    stand = bench([record], NOMINAL)
    torque = missing_torque(stand, [e[0] for e in stand.innovations([NOMINAL])])[0]
    return torque / NOMINAL.plant.torque_constant


def named(answer: Reconciliation) -> dict[float, float]:
    """Waves that were named: amplitude [A] by order, the largest first."""
    waves = (entry["parameters"] for entry in answer.omitted_physics if entry["term"] == "cogging")
    sizes = {w["order"]["value"]: w["amplitude_nm"]["value"] / NOMINAL.plant.torque_constant for w in waves}
    return dict(sorted(sizes.items(), key=lambda pair: -pair[1]))


def leading(name: str, count: int) -> dict[float, float]:
    """Leading waves of a measured map: amplitude [A] by order, the largest first."""
    orders = np.arange(1.0, 101.0)
    sizes = orders_of(*map_of(name), orders)
    return {float(orders[k]): float(sizes[k]) for k in np.argsort(-sizes)[:count]}


def main() -> None:
    told = leading(MAP, 8)
    print("map: " + ", ".join(f"{order:.0f} {size:.2f} A" for order, size in told.items()))
    for name in SWEEPS:
        for record in (logged(name), even(name, 50.0), even(name, 25.0)):
            start = time.process_time()
            answer = reconcile([record], NOMINAL)
            seconds, rate = time.process_time() - start, 1.0 / float(np.median(np.diff(record.t)))
            before, after = (answer.fit[key].get("motor_current_a", np.nan) for key in ("before", "after"))
            print(f"{name}, {rate:.0f} Hz: {answer.verdict}, {seconds:.1f} s; held-out {before:.2f} -> {after:.2f} A")
            print("  waves: " + ", ".join(f"{order:.0f} {size:.2f} A" for order, size in named(answer).items()))
            print(f"  together: {answer.indistinguishable}")
            if answer.updated_model is not None:
                again = reconcile([record], answer.updated_model)
                print(f"  given back: {again.verdict}, {[entry['term'] for entry in again.omitted_physics]}")


if __name__ == "__main__":
    main()
