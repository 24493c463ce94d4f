"""What is usual on a motion: the sizes in which effects are tried and judged."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gsfdi.model import JointModel
from gsfdi.reconcile.sensing import sensor_variances
from gsfdi.types import JointRecord


@dataclass(frozen=True, slots=True)
class Scales:
    """What is usual on this motion: the sizes in which effects are tried.

    Torque [N m] and effort are those of the drive (95th percentile), speed of the joint, reach half its range about
    `centre`, windup the spring's under that torque, `turns` motor radians per joint radian.
    """

    torque: float
    effort: float
    speed: float
    reach: float
    centre: float
    windup: float
    inertia: float
    period: float
    seconds: float
    turns: float
    noise: float
    warms: bool

    def of(self, unit: str, motor_axis: bool = False) -> float:
        """Size of a plain effect for a number in `unit`."""
        speed = self.speed * (self.turns if motor_axis else 1.0)
        return {
            "N m": self.torque,
            "N m s/rad": self.torque / self.speed,
            "N m s²/rad²": self.torque / self.speed**2,
            "N m/rad": self.torque / self.reach,
            "rad": self.windup,
            "rad/s": speed,
            "A": self.effort,
            "s": self.period,
            "1": 0.1,
            "1/rad²": self.windup**-2,
            "kg m²": self.inertia,
            "1/s": 1.0 / self.seconds,
        }[unit]


def scales_of(records: Sequence[JointRecord], model: JointModel, period: float) -> Scales:
    """Measure how the joint moves, to know in which sizes effects matter."""
    plant = model.plant
    drive: float = 1.0 if records[0].effort == "drive_torque" else plant.gear_ratio * plant.torque_constant
    effort = float(np.nanquantile(np.concatenate([np.abs(r[r.effort]) for r in records]), 0.95))
    position = np.concatenate([r["position"] for r in records])
    low, high = float(np.nanmin(position)), float(np.nanmax(position))
    width = max(1, round(0.1 / period))
    speeds = [np.abs(r["position"][width:] - r["position"][:-width]) / (r.t[width:] - r.t[:-width]) for r in records]
    speed = float(np.nanquantile(np.concatenate(speeds), 0.95))
    torque = max(drive * effort, 1e-12)
    warm = [np.ptp(r["temperature"]) if "temperature" in r else 0.0 for r in records]
    return Scales(
        torque=torque,
        effort=max(effort, 1e-12),
        speed=max(speed, 1e-12),
        reach=max(0.5 * (high - low), 1e-12),
        centre=0.5 * (high + low),
        windup=torque / plant.stiffness if np.isfinite(plant.stiffness) else 1.0,
        inertia=plant.output_inertia,
        period=period,
        seconds=max(float(r.t[-1]) for r in records),
        turns=plant.gear_ratio if np.isfinite(plant.stiffness) else 1.0,
        noise=float(np.sqrt(sensor_variances(records, model)[0])),
        warms=max(warm) > 1.0,
    )
