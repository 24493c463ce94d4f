"""One table of the quantities that a joint's telemetry carries.

Inside gsfdi a channel has one name whatever the axis; the column of a canonical file says the unit, so a rotary
joint writes ``position_rad`` where a linear drive writes ``position_m``. Both are SI; temperature alone is in [degC].
"""

from typing import Literal, NamedTuple

Axis = Literal["rotary", "linear"]


class Channel(NamedTuple):
    """A channel: its name inside gsfdi, its columns and units by axis, and what it means."""

    name: str
    rotary: str
    rotary_unit: str
    linear: str
    linear_unit: str
    meaning: str

    def column(self, axis: Axis) -> str:
        """Name the canonical column for a joint of this axis."""
        return self.rotary if axis == "rotary" else self.linear

    def unit(self, axis: Axis) -> str:
        """Name the unit of that column."""
        return self.rotary_unit if axis == "rotary" else self.linear_unit


CHANNELS: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Channel("setpoint", "setpoint_rad", "rad", "setpoint_m", "m", "commanded joint position"),
        Channel("setpoint_rate", "setpoint_rate_rad_s", "rad/s", "setpoint_rate_m_s", "m/s", "commanded joint rate"),
        Channel("position", "position_rad", "rad", "position_m", "m", "measured joint position, output side"),
        Channel(
            "motor_velocity",
            "motor_velocity_rad_s",
            "rad/s",
            "motor_velocity_m_s",
            "m/s",
            "measured motor speed, motor side",
        ),
        Channel(
            "joint_velocity",
            "joint_velocity_rad_s",
            "rad/s",
            "joint_velocity_m_s",
            "m/s",
            "measured joint speed, output side",
        ),
        Channel("motor_current", "motor_current_a", "A", "motor_current_a", "A", "motor current"),
        Channel("drive_torque", "drive_torque_nm", "N m", "drive_force_n", "N", "drive effort, as torque or force"),
        Channel(
            "motor_current_feedforward",
            "motor_current_feedforward_a",
            "A",
            "motor_current_feedforward_a",
            "A",
            "current added to the controller's output",
        ),
        Channel(
            "drive_torque_feedforward",
            "drive_torque_feedforward_nm",
            "N m",
            "drive_force_feedforward_n",
            "N",
            "torque or force added to the controller's output",
        ),
        Channel("temperature", "temperature_c", "degC", "temperature_c", "degC", "joint temperature"),
    )
}

CHANNEL_OF_COLUMN: dict[str, tuple[str, Axis | None]] = {}
"""Canonical column -> (channel, axis); the axis is None where both axes share the column."""
for _channel in CHANNELS.values():
    if _channel.rotary == _channel.linear:
        CHANNEL_OF_COLUMN[_channel.rotary] = (_channel.name, None)
    else:
        CHANNEL_OF_COLUMN[_channel.rotary] = (_channel.name, "rotary")
        CHANNEL_OF_COLUMN[_channel.linear] = (_channel.name, "linear")
