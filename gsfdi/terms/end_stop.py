"""End stop: a stiff spring beyond a joint angle."""

import math

from gsfdi.motion import JOINT_ANGLE, Param, PhysicsTerm, Vector
from gsfdi.scales import Scales


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give k (θ - angle) beyond the angle: above it if the angle is positive, else below."""
    past = m[JOINT_ANGLE] - p[0]
    beyond = past > 0.0 if p[0] >= 0.0 else past < 0.0
    return p[1] * past if beyond else 0.0


def edges(s: Scales) -> list[float]:
    """Angles near both ends of the motion, each on the side of zero that makes it a stop there."""
    low, high = s.centre - s.reach, s.centre + s.reach
    shares = (0.004, 0.012, 0.035, 0.1, 0.19)
    angles = [angle for share in shares for angle in (low + share * (high - low), high - share * (high - low))]
    return [angle for angle in angles if (angle > 0) == (angle > s.centre)]


PASSED = 0.4
"""Share of half the range by which the joint may press beyond a stop: what it passes by further does not stop it."""


def near_edge(s: Scales, angle: float) -> tuple[float, float]:
    """Give the ends between which a stop near `angle` may lie: at the edge of the motion."""
    reach = math.copysign(s.reach, angle - s.centre)
    ends = s.centre + reach * (1 - PASSED), s.centre + reach * 1.05
    return min(ends), max(ends)


TERM = PhysicsTerm(
    name="end_stop",
    component="link",
    meaning="the joint runs into its end stop",
    maintenance="check the joint's zero and its soft limits",
    place="torque",
    law=torque,
    params=(
        Param(
            "angle_rad",
            "rad",
            "joint angle of the stop",
            start=1.0,
            low=-1e3,
            high=1e3,
            typical=1.0,
            kind="angle",
            trials=edges,
            plausible=near_edge,
            step=lambda s: s.reach,
        ),
        Param(
            "stiffness_nm_rad",
            "N m/rad",
            "stiffness of the stop",
            start=1e5,
            low=0.0,
            high=1e9,
            typical=1e5,
            neutral=0.0,
            linear=True,
            size=lambda s: s.torque / s.reach,
            plausible=lambda s, stiffness: (0.0, 300.0 * s.torque / s.reach),
        ),
    ),
    source="Hooke's law, one-sided: τ = k max(0, θ - θ0)",
    signature=("balance", "output"),
    sides=("output",),
    stiffness=lambda p: p[1],
    sets_in="never",
    several=True,
)
