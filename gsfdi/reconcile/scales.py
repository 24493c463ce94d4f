"""Measures what is usual on a motion."""

from collections.abc import Sequence

import numpy as np

from gsfdi.model import JointModel, Plant
from gsfdi.reconcile.sensing import sensor_variances
from gsfdi.scales import Scales
from gsfdi.types import Array, JointRecord

ONE_WAY, STILL = 0.005, 5.0
"""Share of its way that a joint must go back before what differs between the two directions shows, and times the noise
of the position that it may seem to go in a tenth of a second where it rests."""


def scales_of(records: Sequence[JointRecord], model: JointModel, period: float) -> Scales:
    """Measure how the joint moves, to know in which sizes effects matter."""
    plant = model.plant
    drive: float = 1.0 if records[0].effort == "drive_torque" else plant.gear_ratio * plant.torque_constant
    effort = float(np.nanquantile(np.concatenate([np.abs(r[r.effort]) for r in records]), 0.95))
    position = np.concatenate([r["position"] for r in records])
    low, high = float(np.nanmin(position)), float(np.nanmax(position))
    width = max(1, round(0.1 / period))
    steps = [r["position"][width:] - r["position"][:-width] for r in records]
    speeds = [np.abs(s) / (r.t[width:] - r.t[:-width]) for s, r in zip(steps, records, strict=True)]
    speed = float(np.nanquantile(np.concatenate(speeds), 0.95))
    torque, noise = max(drive * effort, 1e-12), float(np.sqrt(sensor_variances(records, model)[0]))
    warm = [np.ptp(r["temperature"]) if "temperature" in r else 0.0 for r in records]
    return Scales(
        torque=torque,
        effort=max(effort, 1e-12),
        speed=max(speed, 1e-12),
        reach=max(0.5 * (high - low), 1e-12),
        centre=0.5 * (high + low),
        windup=torque / plant.stiffness if np.isfinite(plant.stiffness) else 1.0,
        inertia=plant.output_inertia,
        critical=critical(plant),
        period=period,
        seconds=max(float(r.t[-1]) for r in records),
        turns=plant.gear_ratio if np.isfinite(plant.stiffness) else 1.0,
        noise=noise,
        warms=max(warm) > 1.0,
        returns=way_back(steps, STILL * noise) > ONE_WAY,
    )


def way_back(steps: Sequence[Array], least: float) -> float:
    """Share of the way that a joint goes in the direction in which it goes less, by `steps` of more than `least`."""
    way = np.concatenate(steps)
    forth, back = float(np.sum(way[way > least])), -float(np.sum(way[way < -least]))
    return min(forth, back) / max(forth + back, 1e-300)


def critical(plant: Plant) -> float:
    """Critical damping of the gearbox's own mode [N m s/rad]."""
    motor = plant.gear_ratio**2 * plant.motor_inertia
    if not np.isfinite(plant.stiffness):
        return np.inf
    return float(2 * np.sqrt(plant.stiffness * motor * plant.output_inertia / (motor + plant.output_inertia)))
