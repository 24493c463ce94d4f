"""Cable harness: a soft spring across the joint."""

from gsfdi.motion import JOINT_ANGLE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give k (θ - rest)."""
    return p[0] * (m[JOINT_ANGLE] - p[1])


TERM = PhysicsTerm(
    name="cable_harness",
    component="link",
    meaning="the cable harness pulls the joint towards a rest angle",
    maintenance="inspect the routing and clamps of the harness",
    place="torque",
    law=torque,
    params=(
        Param(
            "stiffness_nm_rad",
            "N m/rad",
            "stiffness of the harness",
            start=10.0,
            low=0.0,
            high=1e6,
            typical=10.0,
            neutral=0.0,
            linear=True,
        ),
        Param(
            "rest_rad",
            "rad",
            "joint angle at which the harness is slack",
            start=0.0,
            low=-1e3,
            high=1e3,
            typical=0.5,
            kind="arm",
            trials=lambda s: (s.centre - s.reach, s.centre + s.reach),
            plausible=lambda s, rest: (s.centre - 10 * s.reach, s.centre + 10 * s.reach),
            step=lambda s: s.reach,
        ),
    ),
    source="Hooke's law across the joint: τ = k (θ - θ0)",
    signature=("balance", "output"),
    sides=("output",),
    stiffness=lambda p: p[0],
    sets_in="rarely",
)
