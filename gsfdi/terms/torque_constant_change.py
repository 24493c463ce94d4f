"""Torque constant off its nominal value: weaker magnets, shorted turns, a wrong scale in the drive."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def factor(m: Vector, p: Vector, s: Vector) -> float:
    """Give the torque constant Kt over its nominal value."""
    return p[0]


TERM = PhysicsTerm(
    name="torque_constant_change",
    component="motor",
    meaning="the motor gives less or more torque per ampere than it should",
    maintenance="check the motor's windings and magnets, and the drive's current scale",
    place="torque_constant",
    law=factor,
    params=(
        Param(
            "ratio",
            "1",
            "torque constant over its nominal value",
            start=0.9,
            low=0.0,
            high=10.0,
            typical=0.1,
            neutral=1.0,
            linear=True,
            plausible=lambda s, ratio: (0.3, 1.5),
        ),
    ),
    source="the paper's eq. 5-1: Kt in B",
    signature=("balance", "proportional"),
)
