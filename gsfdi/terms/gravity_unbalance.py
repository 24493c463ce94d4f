"""Gravity on an unbalanced link: a torque that follows the joint angle."""

import math

from gsfdi.motion import JOINT_ANGLE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give G sin(θ - angle)."""
    return p[0] * math.sin(m[JOINT_ANGLE] - p[1])


TERM = PhysicsTerm(
    name="gravity_unbalance",
    component="link",
    meaning="an unbalanced weight acts on the joint",
    maintenance="balance the link, or declare the payload",
    place="torque",
    law=torque,
    params=(
        Param(
            "torque_nm",
            "N m",
            "torque with the weight held out level",
            start=10.0,
            low=0.0,
            high=1e6,
            typical=10.0,
            neutral=0.0,
            linear=True,
        ),
        Param(
            "angle_rad",
            "rad",
            "joint angle at which the weight hangs at rest",
            start=0.0,
            low=-math.pi,
            high=math.pi,
            typical=1.0,
            kind="angle",
        ),
    ),
    source="B. Siciliano et al., Robotics (2009): gravity on one joint, m g l sin(θ - θ0)",
    signature=("balance", "output"),
    sides=("output",),
    axes=("rotary",),  # on a linear one the weight does not turn
    stiffness=lambda p: p[0],
)
