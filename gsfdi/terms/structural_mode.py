"""Structural mode: a flexible appendage swings on the link."""

import math

from gsfdi.motion import JOINT_ANGLE, SPEED, STEP, SWING, SWING_RATE, Param, PhysicsTerm, Vector


def torque(m: Vector, p: Vector, s: Vector) -> float:
    """Give k (θ - ξ) + d (dθ - dξ) of an inertia at ξ beyond the output's own; implicit midpoint over the step."""
    if math.isnan(s[0]):
        s[0], s[1] = m[JOINT_ANGLE] - m[SWING], m[SPEED] - m[SWING_RATE]
    omega = 2.0 * math.pi * p[1]
    half, pull, drag = 0.5 * m[STEP], omega * omega, 2.0 * p[2] * omega
    rate = s[1] + half * (pull * (m[JOINT_ANGLE] - s[0]) + drag * m[SPEED])
    rate /= 1.0 + half * (pull * half + drag)
    angle = s[0] + half * rate
    s[0] += m[STEP] * rate
    s[1] = 2.0 * rate - s[1]
    return p[0] * (pull * (m[JOINT_ANGLE] - angle) + drag * (m[SPEED] - rate))


TERM = PhysicsTerm(
    name="structural_mode",
    component="link",
    meaning="a structure on the link vibrates with the motion",
    maintenance="check fasteners of what the link carries; lower the controller's bandwidth",
    place="torque",
    law=torque,
    params=(
        Param(
            "inertia_kg_m2",
            "kg m²",
            "inertia of the appendage, beyond the output's own",
            start=20.0,
            low=0.0,
            high=1e6,
            typical=20.0,
            neutral=0.0,
            size=lambda s: 0.05 * s.inertia,
            plausible=lambda s, inertia: (0.0, 2.0 * s.inertia),
        ),
        Param(
            "frequency_hz",
            "Hz",
            "frequency of the appendage with the joint held",
            start=2.0,
            low=0.01,
            high=1e3,
            typical=2.0,
            plausible=lambda s, frequency: (0.1, 0.25 / s.period),
        ),
        Param(
            "damping_ratio",
            "1",
            "share of critical damping",
            start=0.01,
            low=0.0,
            high=2.0,
            typical=0.01,
            trials=lambda s: (0.02,),
            plausible=lambda s, ratio: (1e-3, 0.3),
        ),
    ),
    source="J. P. Den Hartog, Mechanical Vibrations (1956), ch. 3: a mass on a moving support",
    signature=("balance", "output"),
    sides=("output",),
    dissipative=True,
    memory=True,
    stiffness=lambda p: p[0] * (2.0 * math.pi * p[1]) ** 2,
    damping=lambda p: p[0] * 4.0 * math.pi * p[1] * p[2],
    sets_in="rarely",
    several=True,
)
