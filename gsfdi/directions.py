"""The library of faults as directions: what a small fault of each kind would do to a joint in this motion.

Each entry gives the amplitude, per unit of its parameter and to first order, of what the fault adds to the healthy
joint: a torque that resists on the motor's or the output's side, a torque in the gearbox spring, or an error of a
sensor. Ids, parameters and units are the contract's; the full, non-linear laws stand on the shelf of terms, and a
test holds the two together. Terms with an unknown phase appear as a sine and a cosine that share a name.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numba
import numpy as np

from gsfdi.model import Plant
from gsfdi.types import Array, Component

Entry = Literal["exact", "motor", "output", "spring", "position", "velocity"]


class Moving(NamedTuple):
    """What the joint did, as the observer has it: angle, speed and acceleration of joint and motor, wind-up, drive.

    All at the output axis; ``drive`` is the motor's torque there, ``load`` what the gearbox passes on.
    """

    t: Array
    angle: Array
    speed: Array
    acceleration: Array
    motor_angle: Array
    motor_speed: Array
    motor_acceleration: Array
    windup: Array
    windup_rate: Array
    drive: Array
    load: Array
    temperature: Array
    plant: Plant
    slow: float

    @property
    def motor_sign(self) -> Array:
        """Sign of the motor's speed, smooth where the speed is within its noise."""
        return np.tanh(self.motor_speed / self.slow)

    @property
    def sign(self) -> Array:
        """Sign of the joint's speed, smooth where the speed is within its noise."""
        return np.tanh(self.speed / self.slow)

    @property
    def brisk(self) -> float:
        """A speed that parts slow from fast in this motion [rad/s]."""
        return float(max(np.sqrt(np.mean(self.motor_speed**2)), 3.0 * self.slow))

    @property
    def reach(self) -> float:
        """Half the span of the joint angle [rad]."""
        return float(max(0.5 * np.ptp(self.angle), 1e-9))


@dataclass(frozen=True, slots=True)
class Direction:
    """One way in which a joint can depart from its baseline.

    Parameters
    ----------
    key : str
        Unique; the fault's id, with side or variant after a colon.
    fault, parameter, unit : str
        Contract id, its first parameter and that one's unit.
    component : str
        Part of the joint.
    enters : Entry
        Where the amplitude acts; ``exact`` directions change the linear model itself.
    shape : callable or None
        Amplitude from the motion; None for exact ones.
    flexible, rigid : bool
        Which joints can show it.
    neutral : float
        Value of the parameter at which nothing is wrong: 1 for ratios, else 0.
    """

    key: str
    fault: str
    component: Component
    parameter: str
    unit: str
    enters: Entry
    shape: Callable[[Moving], Array] | None = None
    flexible: bool = True
    rigid: bool = True
    neutral: float = 0.0


def _waves(fault: str, component: Component, parameter: str, unit: str, enters: Entry, orders: tuple[int, ...],
           scale: Callable[[Moving], Array] | None = None, joint: bool = False) -> list[Direction]:  # fmt: skip
    """Sine and cosine directions of one periodic fault, for each order."""

    def shape(order: int, quarter: bool) -> Callable[[Moving], Array]:
        turn = np.cos if quarter else np.sin

        def amplitude(m: Moving) -> Array:
            phase = order * (m.angle if joint else m.plant.gear_ratio * m.motor_angle)
            return np.asarray(turn(phase) * (1.0 if scale is None else scale(m)))

        return amplitude

    return [
        Direction(f"{fault}:{order}{'c' if quarter else 's'}", fault, component, parameter, unit, enters,
                  shape(order, quarter), rigid=joint or enters != "spring")
        for order in orders for quarter in (False, True)
    ]  # fmt: skip


@numba.njit(cache=True)
def slipping(path: Array, width: float) -> Array:  # pragma: no cover
    """Share of its level that an elastic element bears which slips once stretched by `width`."""
    out = np.zeros(len(path))
    stretched = 0.0
    for k in range(1, len(path)):
        stretched = min(max(stretched + path[k] - path[k - 1], -width), width)
        out[k] = stretched / width
    return out


DIRECTIONS: tuple[Direction, ...] = (
    Direction("torque_constant_change", "torque_constant_change", "motor", "ratio", "", "exact", neutral=1.0),
    Direction("motor_inertia_change", "motor_inertia_change", "motor", "ratio", "", "exact", rigid=False, neutral=1.0),
    Direction("output_inertia_change", "output_inertia_change", "link", "ratio", "", "exact", neutral=1.0),
    Direction("stiffness_change", "stiffness_change", "gearbox", "ratio", "", "exact", rigid=False, neutral=1.0),
    Direction("coulomb_friction:motor", "coulomb_friction", "friction", "torque_nm", "N m", "motor",
              lambda m: m.motor_sign),
    Direction("coulomb_friction:output", "coulomb_friction", "friction", "torque_nm", "N m", "output",
              lambda m: m.sign, rigid=False),
    Direction("viscous_friction:motor", "viscous_friction", "friction", "coefficient_nms_rad", "N m s/rad", "motor",
              lambda m: m.motor_speed),
    Direction("viscous_friction:output", "viscous_friction", "friction", "coefficient_nms_rad", "N m s/rad", "output",
              lambda m: m.speed, rigid=False),
    Direction("constant_load", "constant_load", "link", "torque_nm", "N m", "output", lambda m: np.ones_like(m.t)),
    Direction("asymmetric_friction", "asymmetric_friction", "friction", "difference_nms_rad", "N m s/rad", "motor",
              lambda m: 0.5 * np.abs(m.motor_speed)),
    Direction("stribeck_friction", "stribeck_friction", "friction", "excess_nm", "N m", "motor",
              lambda m: m.motor_sign * np.exp(-((m.motor_speed / (0.2 * m.brisk)) ** 2))),
    Direction("load_dependent_friction", "load_dependent_friction", "friction", "ratio", "", "motor",
              lambda m: np.abs(m.load) * m.motor_sign),
    Direction("quadratic_friction", "quadratic_friction", "friction", "coefficient_nms2_rad2", "N m s²/rad²", "motor",
              lambda m: m.motor_speed * np.abs(m.motor_speed)),
    Direction("temperature_dependent_friction", "temperature_dependent_friction", "friction", "per_degc", "1/degC",
              "motor", lambda m: m.motor_speed * (m.temperature - 20.0)),
    *(
        Direction(f"position_dependent_friction:{i}", "position_dependent_friction", "friction", "torque_nm", "N m",
                  "motor", lambda m, i=i: m.motor_sign * np.exp(  # type: ignore[misc]
                      -0.5 * ((m.angle - m.angle.min() - i * 0.5 * m.reach) / (0.2 * m.reach)) ** 2))
        for i in range(5)
    ),
    Direction("gravity_unbalance:s", "gravity_unbalance", "link", "torque_nm", "N m", "output",
              lambda m: np.sin(m.angle)),
    Direction("gravity_unbalance:c", "gravity_unbalance", "link", "torque_nm", "N m", "output",
              lambda m: np.cos(m.angle)),
    Direction("cable_harness", "cable_harness", "link", "stiffness_nm_rad", "N m/rad", "output", lambda m: m.angle),
    Direction("end_stop:low", "end_stop", "link", "stiffness_nm_rad", "N m/rad", "output",
              lambda m: np.minimum(m.angle - m.angle.min() - 0.1 * m.reach, 0.0)),
    Direction("end_stop:high", "end_stop", "link", "stiffness_nm_rad", "N m/rad", "output",
              lambda m: np.maximum(m.angle - m.angle.max() + 0.1 * m.reach, 0.0)),
    Direction("stiffening", "stiffening", "gearbox", "cubic_per_rad2", "1/rad²", "spring",
              lambda m: m.plant.stiffness * m.windup * m.windup**2, rigid=False),
    *(
        Direction(f"backlash:{share}", "backlash", "gearbox", "half_width_rad", "rad", "spring",
                  lambda m, share=share: -m.plant.stiffness * np.clip(  # type: ignore[misc]
                      m.windup / (share * _usual(m.windup)), -1.0, 1.0), rigid=False)
        for share in (0.2, 0.7)
    ),
    *(
        Direction(f"gearbox_hysteresis:{share}", "gearbox_hysteresis", "gearbox", "torque_nm", "N m", "spring",
                  lambda m, share=share: slipping(m.windup, share * _usual(m.windup)), rigid=False)  # type: ignore[misc]
        for share in (0.1, 0.4)
    ),
    Direction("gearbox_damping", "gearbox_damping", "gearbox", "coefficient_nms_rad", "N m s/rad", "spring",
              lambda m: m.windup_rate, rigid=False),
    *_waves("transmission_error", "gearbox", "amplitude_rad", "rad", "spring", (1, 2),
            lambda m: np.full_like(m.t, -m.plant.stiffness)),
    *_waves("cogging", "motor", "amplitude_nm", "N m", "motor", (1, 2, 4, 6, 12)),
    *_waves("torque_ripple", "motor", "amplitude_ratio", "", "motor", (1, 2, 6), lambda m: -m.drive),
    Direction("magnetic_saturation", "magnetic_saturation", "motor", "inverse_square_current", "1/A²", "motor",
              lambda m: 0.5 * m.drive * (m.drive / (m.plant.gear_ratio * m.plant.torque_constant)) ** 2),
    Direction("actuation_delay", "actuation_delay", "motor", "delay_s", "s", "motor",
              lambda m: np.gradient(m.drive, m.t)),
    Direction("current_bias", "current_bias", "sensor", "bias_a", "A", "motor",
              lambda m: np.full_like(m.t, m.plant.gear_ratio * m.plant.torque_constant)),
    Direction("position_bias", "position_bias", "sensor", "bias_rad", "rad", "position", lambda m: np.ones_like(m.t)),
    Direction("position_gain", "position_gain", "sensor", "ratio", "", "position", lambda m: m.angle, neutral=1.0),
    *_waves("encoder_eccentricity", "sensor", "amplitude_rad", "rad", "position", (1, 2), joint=True),
    Direction("velocity_gain", "velocity_gain", "sensor", "ratio", "", "velocity",
              lambda m: m.plant.gear_ratio * m.motor_speed, neutral=1.0),
    Direction("velocity_bias", "velocity_bias", "sensor", "bias_rad_s", "rad/s", "velocity",
              lambda m: np.ones_like(m.t)),
)  # fmt: skip


def _usual(values: Array) -> float:
    """Usual size of `values`."""
    return float(max(np.sqrt(np.mean(values**2)), 1e-12))


def library(flexible: bool, speed_measured: bool, temperature: bool) -> tuple[Direction, ...]:
    """Directions that a joint of this build and with these sensors can show."""
    return tuple(
        one
        for one in DIRECTIONS
        if (one.flexible if flexible else one.rigid)
        and (speed_measured or one.enters != "velocity")
        and (temperature or one.fault != "temperature_dependent_friction")
    )


def grouped(directions: Sequence[Direction]) -> list[tuple[str, list[int]]]:
    """Directions that are judged together, as the sine and cosine of one wave are, under the name they share."""
    groups: dict[str, list[int]] = {}
    for j, one in enumerate(directions):
        paired = one.key[-1] in "sc" and (one.key[-2] == ":" or one.key[-2].isdigit())
        groups.setdefault(one.key[:-1].rstrip(":") if paired else one.key, []).append(j)
    return list(groups.items())
