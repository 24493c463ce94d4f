"""End stop: a stiff spring beyond a joint angle."""

from gsfdi.motion import JOINT_ANGLE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give k (θ - angle) beyond the angle: above it if the angle is positive, else below."""
    past = m[JOINT_ANGLE] - p[0]
    beyond = past > 0.0 if p[0] >= 0.0 else past < 0.0
    return p[1] * past if beyond else 0.0


TERM = PhysicsTerm(
    name="end_stop",
    component="link",
    meaning="the joint runs into its end stop",
    maintenance="check the joint's zero and its soft limits",
    place="torque",
    law=torque,
    params=(
        Param("angle_rad", "rad", "joint angle of the stop", start=1.0, low=-1e3, high=1e3, typical=1.0),
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
        ),
    ),
    source="Hooke's law, one-sided: τ = k max(0, θ - θ0)",
    signature=("balance", "output"),
    sides=("output",),
    stiffness=lambda p: p[1],
    sudden=False,
    several=True,
)
