"""The model of a joint: what a model file holds, in SI units and free of the file's spelling.

Torques, inertias and stiffness are at the output axis unless the name says motor. A linear drive uses the same fields
with N, m and kg in the place of N m, rad and kg m².
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, Self

from gsfdi.channels import Axis

Structure = Literal["flexible", "rigid"]
Side = Literal["motor", "output"]
Effort = Literal["motor_current", "drive_torque"]


@dataclass(frozen=True, slots=True)
class Plant:
    """The linear joint.

    Parameters
    ----------
    output_inertia : float
        Inertia of the output side; of everything that moves when the joint is rigid [kg m²].
    motor_inertia : float
        Inertia of the motor, on the motor's own axis [kg m²]; 0 for a rigid joint.
    gear_ratio : float
        Motor turns for one turn of the output.
    stiffness : float
        Gearbox spring, at the output [N m/rad]; infinite for a rigid joint.
    damping : float
        Viscous damping on the output axis [N m s/rad].
    torque_constant : float
        Motor torque per ampere [N m/A]; 1 / gear_ratio where the drive's effort is given as torque at the output.
    """

    output_inertia: float
    motor_inertia: float = 0.0
    gear_ratio: float = 1.0
    stiffness: float = float("inf")
    damping: float = 0.0
    torque_constant: float = 1.0


@dataclass(frozen=True, slots=True)
class Controller:
    """``u = kp (r - y) + ki ∫(r - y) dt + kd (b ṙ - ω/N)``, sampled and held; u in amperes, or in N m (N).

    `derivative_delay` is the age of the speed ω [s]: a controller that takes differences of positions has an older one.
    `integral_rule` is the share of the newest error that the integral has counted: 0 by forward rectangles, 0.5 by
    trapezoids, 1 by backward rectangles.
    """

    proportional: float
    integral: float
    derivative: float
    sample_rate: float
    rate_feedforward: float = 1.0
    limit: float = float("inf")
    derivative_delay: float = 0.0
    integral_rule: float = 0.5
    effort: Effort = "motor_current"

    @property
    def at_once(self) -> float:
        """Gain on the newest error, where an integral by trapezoids stands for this one."""
        return self.proportional + (self.integral_rule - 0.5) * self.integral / self.sample_rate


@dataclass(frozen=True, slots=True)
class Sensors:
    """Resolution and standard deviation of the noise of each measured channel; 0 where unknown or absent."""

    position_resolution: float = 0.0
    position_noise: float = 0.0
    motor_velocity_resolution: float = 0.0
    motor_velocity_noise: float = 0.0
    effort_resolution: float = 0.0
    effort_noise: float = 0.0


@dataclass(frozen=True, slots=True)
class Bus:
    """How telemetry travels: latency and its jitter [s], and the shares of frames that are lost or arrive twice."""

    latency: float = 0.0
    jitter: float = 0.0
    lost: float = 0.0
    repeated: float = 0.0


@dataclass(frozen=True, slots=True)
class TermUse:
    """A term of physics as a model uses it: its id, its parameters by their contract names, side and onset [s]."""

    term: str
    values: Mapping[str, float] = field(default_factory=dict)
    side: Side | None = None
    onset: float | None = None


@dataclass(frozen=True, slots=True)
class JointModel:
    """Everything that a model file says of one joint.

    `trust` gives the relative standard deviation of plant fields that are not known for certain; `effort` says whether
    the drive's effort is a current or a torque.
    """

    name: str
    structure: Structure
    plant: Plant
    axis: Axis = "rotary"
    controller: Controller | None = None
    sensors: Sensors = Sensors()
    physics: tuple[TermUse, ...] = ()
    bus: Bus = Bus()
    trust: Mapping[str, float] = field(default_factory=dict)
    effort: Effort = "motor_current"

    def with_use(self, place: int, use: TermUse) -> Self:
        """Give the model with `use` in the place of the term that stands at `place`."""
        return replace(self, physics=(*self.physics[:place], use, *self.physics[place + 1 :]))
