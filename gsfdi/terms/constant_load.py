"""Constant load: a torque that is always there."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give the torque, which resists positive motion."""
    return p[0]


TERM = PhysicsTerm(
    name="constant_load",
    component="link",
    meaning="a constant torque acts on the joint",
    maintenance="look for a hanging weight or a preloaded spring",
    place="torque",
    law=torque,
    params=(
        Param(
            "torque_nm",
            "N m",
            "torque against positive motion",
            start=2.0,
            low=-1e6,
            high=1e6,
            typical=2.0,
            neutral=0.0,
            linear=True,
        ),
    ),
    source="B. Siciliano et al., Robotics (2009): gravity on a joint, over a small range of angles",
    signature=("balance", "output"),
    sides=("output",),
)
