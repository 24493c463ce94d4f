"""A first guess: what the channels say by themselves, and a regression where there is no model file."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsfdi.directions import Moving
from gsfdi.errors import BaselineError
from gsfdi.healthy.terms import BY_KEY, SIMPLE, terms_shown
from gsfdi.model import JointModel, Plant
from gsfdi.nominal import Nominal
from gsfdi.stretches import Stretch, sampling_step, stretches
from gsfdi.types import Array, JointRecord


def first_guess(records: Sequence[JointRecord], model: JointModel | None) -> Nominal:
    """Which channels there are, how fast they are sampled, and a plant to begin with."""
    first = records[0]
    effort = first.effort
    if effort not in first or "position" not in first:
        raise BaselineError(first.joint, "a baseline needs position and motor current or drive torque", "map them")
    step = sampling_step(records)
    velocity = next((n for n in ("motor_velocity", "joint_velocity") if all(_moves(r, n) for r in records)), "")
    plant = model.plant if model is not None else Plant(output_inertia=1.0)
    if effort == "drive_torque":
        plant = replace(plant, torque_constant=1.0 / plant.gear_ratio)
    if model is None and velocity == "motor_velocity":
        plant = replace(plant, gear_ratio=_ratio(records), torque_constant=1.0 / _ratio(records))
    return Nominal(plant, effort, velocity, step)


def _moves(record: JointRecord, name: str) -> bool:
    """Whether the channel is there and is more than a constant."""
    if name not in record:
        return False
    values = record[name]
    values = values[np.isfinite(values)]
    return len(values) > 50 and float(np.ptp(values)) > 0


def _ratio(records: Sequence[JointRecord]) -> float:
    """Gear ratio from motor speed against the slope of the joint angle."""
    top = bottom = 0.0
    for record in records:
        for part in stretches(record, ("position", "motor_velocity"), sampling_step(records)):
            slope = np.gradient(part.values["position"], part.step)
            top += float(np.sum(slope * part.values["motor_velocity"]))
            bottom += float(np.sum(slope * slope))
    return top / bottom if bottom > 0 and top > 0 else 1.0


def regressed(nominal: Nominal, parts: Sequence[Stretch]) -> Nominal:
    """Inertia, friction and weight of a joint without a model file: smoothed effort regressed on smoothed motion."""
    keys = [key for key in terms_shown(nominal, parts) if key in SIMPLE]
    long = [part for part in parts if len(part.trusted) >= 60]
    if not long:
        return nominal
    balances = [_balance(nominal, part, keys) for part in long]
    X, y = (np.concatenate(some) for some in zip(*balances, strict=True))
    X = X / (scale := np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-12))
    found = np.linalg.solve(X.T @ X + 1e-4 * len(X) * np.eye(X.shape[1]), X.T @ y) / scale
    least = 0.02 * float(np.std(y)) / max(float(scale[0]), 1e-12)
    terms = dict(zip(keys, (float(value) for value in found[1:]), strict=True))
    terms["coulomb_friction:motor"] = max(terms.get("coulomb_friction:motor", 0.0), 0.0)
    plant = replace(nominal.plant, output_inertia=max(float(found[0]), least))
    return replace(nominal, plant=plant, terms=terms)


def _balance(nominal: Nominal, part: Stretch, keys: Sequence[str]) -> tuple[Array, Array]:
    """Acceleration and the terms' shapes ``(n, 1 + k)``, and the drive's torque ``(n,)`` that they are to add up to."""
    from scipy import signal  # half a second to load, which joints with a model file need not wait for

    b, a = signal.butter(2, min(0.5, max(10.0 * nominal.step, 0.05)))
    smooth = {name: signal.filtfilt(b, a, part.values[name]) for name in ("position", nominal.effort)}
    speed = np.gradient(smooth["position"], part.step)
    zero = np.zeros_like(speed)
    seen = Moving(part.t, smooth["position"], speed, zero, smooth["position"], speed, zero, zero, zero, zero, zero,
                  zero, nominal.plant, nominal.slow)  # fmt: skip
    columns = [np.gradient(speed, part.step), *(BY_KEY[key].shape(seen) for key in keys)]  # type: ignore[misc]
    push = smooth[nominal.effort] * nominal.plant.gear_ratio * nominal.plant.torque_constant
    return np.column_stack(columns)[5:-5], push[5:-5]
