"""Timestamp latency: what is logged as now was measured a while ago."""

from gsfdi.motion import Param, PhysicsTerm
from gsfdi.types import Array


def age(m: Array, p: Array, s: Array) -> float:
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
        ),
    ),
    source="ROS REP 145 and IEEE 1588: the stamp is to be the time of sampling",
    signature=("timing", "redundancy"),
)
