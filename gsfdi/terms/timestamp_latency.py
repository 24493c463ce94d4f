"""Timestamp latency: what is logged as now was measured a while ago."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def age(m: Vector, p: Vector, s: Vector) -> float:
    """Give the delay itself; the controller sees fresh values."""
    return p[0]


TERM = PhysicsTerm(
    name="timestamp_latency",
    component="sensor",
    meaning="position and speed are stamped late in the log",
    maintenance="check the clock and the stamping of the telemetry",
    place="latency",
    law=age,
    params=(
        Param(
            "delay_s",
            "s",
            "age of position and speed when stamped",
            start=0.005,
            low=0.0,
            high=1.0,
            typical=0.005,
            neutral=0.0,
            trials=lambda s: (),  # it shows in the controller's law, which had fresh values
        ),
    ),
    source="std_msgs/Header of ROS: the stamp is to be the time of sampling; y(t) = x(t - d)",
    signature=("timing", "redundancy"),
)
