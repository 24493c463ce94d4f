"""Every key of a model file, with its unit and what it may be."""

from dataclasses import fields
from typing import Any, NamedTuple

from gsfdi.channels import Axis
from gsfdi.model import Effort, Plant
from gsfdi.motion import PhysicsTerm, linear_name
from gsfdi.registry import shelf

SCHEMA = "gsfdi/model/1"


class KeyOf(NamedTuple):
    """A key of a model file: the field it sets, its rotary and linear spelling, and what it may be."""

    field: str
    rotary: str
    linear: str
    meaning: str
    low: float = 0.0
    high: float = 1e15
    above: bool = False
    """Whether `low` itself is refused."""


def _key(name: str, rotary: str, meaning: str, linear: str = "", **limits: Any) -> KeyOf:
    return KeyOf(name, rotary, linear or linear_name(rotary), meaning, **limits)


KEYS: dict[str, tuple[KeyOf, ...]] = {
    "plant": (
        _key(
            "output_inertia",
            "output_inertia_kg_m2",
            "inertia (mass) of the output side; of everything that moves in a rigid joint",
            "moving_mass_kg",
            above=True,
        ),
        _key("motor_inertia", "motor_inertia_kg_m2", "inertia of the motor, on its own axis", "motor_inertia_kg_m2"),
        _key("gear_ratio", "gear_ratio", "motor turns per output turn; rad/m in a linear drive", above=True),
        _key("stiffness", "gearbox_stiffness_nm_rad", "gearbox spring, at the output", above=True),
        _key("damping", "viscous_damping_nms_rad", "viscous damping on the output axis"),
        _key("torque_constant", "torque_constant_nm_a", "motor torque per ampere", above=True),
    ),
    "sensors": (
        _key("position_resolution", "position_resolution_rad", "smallest step of the position sensor"),
        _key("position_noise", "position_noise_rad", "standard deviation of the measured position"),
        _key("motor_velocity_resolution", "motor_velocity_resolution_rad_s", "smallest step of the speed sensor"),
        _key("motor_velocity_noise", "motor_velocity_noise_rad_s", "standard deviation of the measured speed"),
        _key("effort_resolution", "motor_current_resolution_a", "smallest step of the measured current"),
        _key("effort_noise", "motor_current_noise_a", "standard deviation of the measured current"),
        _key(
            "effort_resolution", "drive_torque_resolution_nm", "smallest step of the effort", "drive_force_resolution_n"
        ),
        _key("effort_noise", "drive_torque_noise_nm", "standard deviation of the effort", "drive_force_noise_n"),
    ),
    "bus": (
        _key("latency", "latency_s", "delay from sampling to stamping, the same for every frame", high=10.0),
        _key("jitter", "jitter_s", "standard deviation of that delay", high=10.0),
        _key("lost", "lost_ratio", "share of frames that never arrive", high=0.9),
        _key("repeated", "repeated_ratio", "share of frames that arrive twice", high=0.9),
    ),
    "trust": tuple(
        _key(name, name, f"relative standard deviation of {name.replace('_', ' ')}", name, above=True, high=100.0)
        for name in (item.name for item in fields(Plant))
    ),
}


def _gains(unit: str, linear_unit: str) -> tuple[KeyOf, ...]:
    """Keys of a controller whose effort is in `unit`."""
    lengths = "m_s" if linear_unit == "a" else "ms"
    return (
        _key("proportional", f"proportional_{unit}_rad", "gain on position", f"proportional_{linear_unit}_m"),
        _key("integral", f"integral_{unit}_rad_s", "gain on its integral", f"integral_{linear_unit}_{lengths}"),
        _key("derivative", f"derivative_{unit}s_rad", "gain on speed", f"derivative_{linear_unit}s_m"),
        _key("sample_rate", "sample_rate_hz", "ticks per second", above=True, high=1e6),
        _key(
            "rate_feedforward",
            "rate_feedforward",
            "share of the setpoint's rate in the speed error",
            low=-1e3,
            high=1e3,
        ),
        _key("derivative_delay", "derivative_delay_s", "age of the speed that the derivative acts on", high=1.0),
        _key(
            "integral_rule", "integral_rule", "newest error counted: 0 or 1 by rectangles, 0.5 by trapezoids", high=1.0
        ),
        _key("limit", f"limit_{unit}", "greatest effort, with anti-windup", f"limit_{linear_unit}", above=True),
    )


GAINS: dict[Effort, tuple[KeyOf, ...]] = {"motor_current": _gains("a", "a"), "drive_torque": _gains("nm", "n")}


def spelling(key: KeyOf, axis: Axis) -> str:
    """Spell `key` for the axis."""
    return key.rotary if axis == "rotary" else key.linear


def terms() -> dict[str, PhysicsTerm]:
    """Every term of the shelf by its id."""
    return shelf("gsfdi.terms", PhysicsTerm)
