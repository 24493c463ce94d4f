"""What simpler methods say of the same cases: the opponents that reconcile is to be better than.

All three read the same files and hold the same library: for every term the torque it would ask for, as columns over
time. None of them calibrates, none may say "nothing", as their users have it.

- sparse regression: sequentially thresholded least squares (Brunton, Proctor and Kutz, PNAS 113, 2016) of the torque
  balance on all columns at once; terms by the size of their share.
- best RMSE: every term alone in the torque balance, the smallest remainder wins.
- tracking: the same, but judged by position alone, as a fit of simulated to recorded position would.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.signal import lfilter, savgol_filter

from gsfdi import ingest
from gsfdi.model import JointModel
from gsfdi.modelfile import load_models
from gsfdi.types import Array, JointRecord

THRESHOLD = 0.05  # of the largest share, the usual order of choice for sparse regression on scaled columns
Library = Mapping[str, Array]


def rivals(folder: Path) -> dict[str, list[str]]:
    """Let every rival name the physics that is left out of ``nominal.toml``, given the recordings in the folder.

    Returns names by rival, most important first.
    """
    model = load_models(folder / "nominal.toml").for_joint("J1")
    records = ingest.read(ingest.gather([str(path) for path in sorted(folder.glob("*.parquet"))])).records
    parts = [torque_balance(record, model) for record in records]
    remainder = np.concatenate([part[0] for part in parts])
    library = {name: np.vstack([part[1][name] for part in parts]) for name in parts[0][1]}
    said = {"sparse regression": sparse(remainder, library), "best RMSE": [best(remainder, library)]}
    if model.controller is not None:
        moved = [tracking(record, model, part) for record, part in zip(records, parts, strict=True)]
        error = np.concatenate([part[0] for part in moved])
        columns = {name: np.vstack([part[1][name] for part in moved]) for name in library}
        said["tracking error"] = [best(error, columns)]
    return said


def torque_balance(record: JointRecord, model: JointModel) -> tuple[Array, Library]:
    """Torque that the nominal model does not explain, and what each term would put there, sample by sample."""
    t, plant = record.t, model.plant
    step = float(np.median(np.diff(t)))
    angle = np.nan_to_num(record["position"])
    grid = np.arange(0.0, t[-1], step)
    angle, effort = np.interp(grid, t, angle), np.interp(grid, t, np.nan_to_num(record[record.effort]))
    width = 31 if step > 2e-3 else 61
    speed = savgol_filter(angle, width, 3, deriv=1, delta=step)
    change = savgol_filter(angle, width, 3, deriv=2, delta=step)
    effort = savgol_filter(effort, width, 3)
    gain = plant.torque_constant * plant.gear_ratio if record.effort == "motor_current" else 1.0
    inertia = plant.output_inertia + plant.motor_inertia * plant.gear_ratio**2
    torque = gain * effort
    known = inertia * change + plant.damping * speed
    for use in model.physics:
        if use.term == "coulomb_friction":
            known = known + use.values["torque_nm"] * np.tanh(speed / (0.02 * np.abs(speed).max()))
        elif use.term == "viscous_friction":
            known = known + use.values["coefficient_nms_rad"] * speed
    warm = np.interp(grid, t, np.nan_to_num(record["temperature"])) if "temperature" in record else np.zeros(grid.size)
    return torque - known, columns_of(grid, angle, speed, change, torque, warm, plant.gear_ratio)


def columns_of(t: Array, y: Array, v: Array, a: Array, torque: Array, warm: Array, gear: float) -> Library:
    """Torque of each term per unit of its size; several columns where a term needs them."""
    fast = np.abs(v).max()
    sign = np.tanh(v / (0.02 * fast))
    columns = {
        "torque_constant_change": torque,
        "torque_constant_drift": torque * t,
        "magnetic_saturation": torque**3,
        "actuation_delay": np.gradient(torque, t),
        "output_inertia_change": a,
        "coulomb_friction": sign,
        "viscous_friction": v,
        "quadratic_friction": v * np.abs(v),
        "stribeck_friction": sign * np.exp(-((v / (0.12 * fast)) ** 2)),
        "asymmetric_friction": np.where(v > 0, v, 0.0),
        "load_dependent_friction": np.abs(torque) * sign,
        "temperature_dependent_friction": (warm - warm.mean()) * v,
        "constant_load": np.ones(t.size),
        "cable_harness": y - y.mean(),
        "gearbox_damping": np.gradient(a, t),
        "stiffening": np.gradient(np.gradient(torque**3, t), t),
        "backlash": np.gradient(np.gradient(np.tanh(torque / (0.05 * np.abs(torque).max())), t), t),
    }
    library = {name: column[:, None] for name, column in columns.items()}
    library["gravity_unbalance"] = np.column_stack([np.sin(y), np.cos(y)])
    library["encoder_eccentricity"] = np.column_stack([np.sin(3 * y), np.cos(3 * y)]) * a[:, None]
    places = y.mean() + np.linspace(-0.8, 0.8, 5) * 0.5 * np.ptp(y)
    library["position_dependent_friction"] = np.column_stack(
        [sign * np.exp(-0.5 * ((y - place) / (0.08 * np.ptp(y) + 1e-12)) ** 2) for place in places]
    )
    turns = [wave(order * gear * y) for order in range(1, 9) for wave in (np.sin, np.cos)]
    library["cogging"] = np.column_stack(turns)
    library["torque_ripple"] = library["cogging"] * torque[:, None]
    return library


def sparse(remainder: Array, library: Library) -> list[str]:
    """Name the terms that sequentially thresholded least squares keeps, by the share of the remainder they carry."""
    names = [name for name, columns in library.items() for _ in range(columns.shape[1])]
    table = np.hstack(list(library.values()))
    size = np.linalg.norm(table, axis=0)
    kept = size > 1e-12 * size.max()
    weight = np.zeros(size.size)
    for _ in range(10):
        if not kept.any():
            break
        weight = np.zeros(size.size)
        scaled = table[:, kept] / size[kept]
        gram = scaled.T @ scaled + 1e-6 * np.eye(scaled.shape[1])
        weight[kept] = np.linalg.solve(gram, scaled.T @ remainder)
        keep = kept & (np.abs(weight) > THRESHOLD * np.abs(weight).max())
        if (keep == kept).all():
            break
        kept = keep
    shares: dict[str, float] = {}
    for name, value, used in zip(names, weight, kept, strict=True):
        if used:
            shares[name] = shares.get(name, 0.0) + float(value**2)
    return sorted(shares, key=lambda name: -shares[name])


def best(remainder: Array, library: Library) -> str:
    """Name the one term that leaves the least."""

    def left(columns: Array) -> float:
        sizes = np.linalg.norm(columns, axis=0)
        scaled = columns[:, sizes > 0] / sizes[sizes > 0]
        if scaled.shape[1] == 0:
            return float("inf")
        weight = np.linalg.lstsq(scaled, remainder, rcond=1e-9)[0]
        return float(np.sum((remainder - scaled @ weight) ** 2))

    return min(library, key=lambda name: left(library[name]))


def tracking(record: JointRecord, model: JointModel, part: tuple[Array, Library]) -> tuple[Array, Library]:
    """The balance as seen from position: everything through the closed loop's answer to a torque on the joint.

    The loop is taken as inertia, controller and no spring, which is what bounds it at the frequencies of a motion.
    """
    law, plant = model.controller, model.plant
    assert law is not None
    gain = plant.torque_constant * plant.gear_ratio if law.effort == "motor_current" else 1.0
    inertia = plant.output_inertia + plant.motor_inertia * plant.gear_ratio**2
    step = float(np.median(np.diff(record.t)))
    compliance = _discrete(
        inertia, gain * law.derivative + plant.damping, gain * law.proportional, gain * law.integral, step
    )
    setpoint = np.interp(np.arange(part[0].size) * step, record.t, np.nan_to_num(record["setpoint"]))
    position = np.interp(np.arange(part[0].size) * step, record.t, np.nan_to_num(record["position"]))
    error = setpoint - position
    expected = lfilter(*compliance, inertia * np.gradient(np.gradient(setpoint, step), step))
    seen = {name: np.column_stack([lfilter(*compliance, c) for c in columns.T]) for name, columns in part[1].items()}
    return error - expected, seen


def _discrete(j: float, d: float, k: float, i: float, h: float) -> tuple[Sequence[float], Sequence[float]]:
    """Bilinear transform of s / (j s³ + d s² + k s + i), position per torque of a joint under its controller."""
    c = 2.0 / h
    top = np.array([c, c, -c, -c])
    cube, square, line, one = (
        np.array([1, -3, 3, -1]),
        np.array([1, -1, -1, 1]),
        np.array([1, 1, -1, -1]),
        np.array([1, 3, 3, 1]),
    )
    below = j * c**3 * cube + d * c**2 * square + k * c * line + i * one
    return list(top / below[0]), list(below / below[0])
