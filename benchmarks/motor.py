"""Reconcile a bare motor turned slowly, and hold the cogging that is found against its measured map.

Run with the real recordings in ``$GSFDI_REAL`` or ``../shared/real``. The motor's log is 430 rows a second of position
and current, read one after the other over a serial line: both pass the same filter without lag and are taken at an
even rate. The nominal model is the rotor alone, its inertia and torque constant as its owner measured them (an
acceleration of 15 rad/s² at 0.4 A, which he calls 3 N mm). The map, a holding current every 16 counts of a turn, takes
no part; it is only what the answer is compared with.

Why `reconcile` falls short here, and what does not: it asks how well the current predicts the motion. A loop that holds
its speed makes a motion that is predicted best by a drive which moves nothing, and the current's error is worse than
that, whatever the cogging. Asked the other way round, how well the angle predicts the current (`turns_with`), the same
sweeps show the orders of the map one after another.
"""

import os
import time
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt, lfilter

from gsfdi.model import JointModel, Plant
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.remainder import missing_torque
from gsfdi.types import Array, JointRecord

HOME = Path(__file__).resolve().parents[1]
REAL = Path(os.environ.get("GSFDI_REAL", HOME.parent / "shared" / "real")) / "odrive_cogging"
COUNTS = 8192
NOMINAL = JointModel(
    name="M0",
    structure="rigid",
    plant=Plant(output_inertia=2.5e-4, gear_ratio=1.0, torque_constant=2.5e-4 * 15.0 / 0.4),
)
MEASURED = (
    "torque_constant_change",
    "torque_constant_drift",
    "magnetic_saturation",
    "current_gain",
    "output_inertia_change",
)
"""Terms that deny what the owner measured: the torque of an ampere, and the inertia."""


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


def turns_with(angle: Array, current: Array, bar: float = 20.0, memory: int = 20) -> tuple[list[int], float]:
    """Whole orders that `current` follows over `angle`, as they are found, and the share of its variance they make.

    One order after another joins a regression, the one that gains most log-likelihood once what is left is made white
    by an autoregression over `memory` samples, until none gains `bar`.
    """
    found: list[int] = []
    while True:
        regressors = np.hstack([np.ones((len(angle), 1)), *(_wave(angle, order) for order in found)])
        left = current - regressors @ np.linalg.lstsq(regressors, current, rcond=None)[0]
        lags = np.lib.stride_tricks.sliding_window_view(left[:-1], memory)[:, ::-1]
        taps = np.concatenate([[1.0], -np.linalg.lstsq(lags, left[memory:], rcond=None)[0]])
        basis = np.linalg.qr(lfilter(taps, [1.0], regressors, axis=0)[memory:])[0]
        white = lfilter(taps, [1.0], current)[memory:]
        white -= basis @ (basis.T @ white)
        gains = {}
        for order in set(range(1, 101)) - set(found):
            pair = lfilter(taps, [1.0], _wave(angle, order), axis=0)[memory:]
            pair -= basis @ (basis.T @ pair)
            gains[order] = 0.5 * len(white) * float(np.sum((np.linalg.qr(pair)[0].T @ white) ** 2) / (white @ white))
        best = max(gains, key=gains.__getitem__)
        if gains[best] < bar:
            return found, 1.0 - float(np.var(left) / np.var(current))
        found.append(best)


def _wave(angle: Array, order: int) -> Array:
    return np.column_stack([np.sin(order * angle), np.cos(order * angle)])


def lacking(record: JointRecord) -> Array:
    """Current [A] that makes the torque which the nominal model lacks, moment by moment, without naming any physics."""
    stand = bench([record], NOMINAL)
    torque = missing_torque(stand, [e[0] for e in stand.innovations([NOMINAL])])[0]
    return torque / NOMINAL.plant.torque_constant


def main() -> None:
    angle, held = map_of("coggingmap_0__cogging_measure_final_a_16")
    leading = np.argsort(-orders_of(angle, held, np.arange(1.0, 101.0)))[:6] + 1.0
    print("order   map [A]   missing torque of the sweeps at 0.03 and 0.1 turns/s [A]")
    sweeps = [even(name, 50.0) for name in ("slow2_slower__nocomp_0", "slow2__nocomp_0")]
    columns = [orders_of(angle, held, leading), *(orders_of(s["position"], lacking(s), leading) for s in sweeps)]
    for order, *sizes in zip(leading, *columns, strict=True):
        print(f"{order:5.0f}   " + "   ".join(f"{size:.2f}" for size in sizes))
    for name in ("slow2_slower__nocomp_0", "slow2__nocomp_0", "slow2__nocomp_1"):
        t, counts, current = np.load(REAL / f"{name}.npy")
        moves = t > t[0] + 0.5
        found, share = turns_with(counts[moves] * 2 * np.pi / COUNTS, current[moves])
        print(f"{name}: the current follows orders {found} over the angle, {100 * share:.0f} % of its variance")
    for rate in (25.0, 50.0):
        for name in ("slow2_slower__nocomp_0", "slow2__nocomp_0"):
            for without in ((), MEASURED):
                start = time.process_time()
                answer = reconcile([even(name, rate)], NOMINAL, without=without)
                print(f"{name}, {rate:.0f} Hz, {'as it is' if not without else 'numbers of the motor believed'}:")
                print(f"  {answer.verdict}, {time.process_time() - start:.1f} s; {answer.says}")
                for entry in answer.omitted_physics:
                    numbers = {key: number["value"] for key, number in entry["parameters"].items()}
                    if entry["term"] == "cogging":
                        numbers["amplitude_a"] = numbers["amplitude_nm"] / NOMINAL.plant.torque_constant
                    print(f"    {entry['term']}: {numbers}")


if __name__ == "__main__":
    main()
