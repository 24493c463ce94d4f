"""Cable harness: a soft spring across the joint."""

from gsfdi.motion import JOINT_ANGLE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give k x (1 + h x²) with x = θ - rest."""
    x = m[JOINT_ANGLE] - p[1]
    return p[0] * x * (1.0 + p[2] * x * x)


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
        Param(
            "hardening_per_rad2",
            "1/rad²",
            "by how much the harness grows stiffer the further it is bent",
            start=0.0,
            low=0.0,
            high=1e6,
            typical=1.0,
            kind="detail",
            trials=lambda s: [share / s.reach**2 for share in (0.1, 0.5)],
            plausible=lambda s, hardening: (0.0, 3.0 / s.reach**2),
        ),
    ),
    source="Hooke's law across the joint, and Duffing's where it hardens: τ = k x (1 + h x²) with x = θ - θ0",
    signature=("balance", "output"),
    sides=("output",),
    stiffness=lambda p: p[0],
    sets_in="rarely",
)
