"""Families of joints that the cases are about, what their nominal models know of them, and how wrong those are."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gsfdi.proof.kinds import Kind
from gsfdi.proof.sizes import Rng, Scales
from gsfdi.proof.world import Effect, Joint, tuned

FLEXIBLE = Joint()
LINEAR = Joint(
    structure="rigid",
    axis="linear",
    motor_inertia=0.0,
    gear_ratio=1.0,
    output_inertia=95.0,
    damping=0.0,
    torque_constant=1.0,
    proportional=1.37e6,
    integral=0.0,
    derivative=8.5e3,
    rate_feedforward=0.0,
    sample_rate=1000.0,
    effort="drive_torque",
    position_resolution=1e-7,
    position_noise=2e-7,
    motor_velocity_noise=1e-4,
    effort_noise=0.1,
)
TORQUE = Joint(
    structure="rigid",
    motor_inertia=0.0,
    gear_ratio=1.0,
    output_inertia=3.0,
    damping=0.0,
    torque_constant=1.0,
    proportional=3000.0,
    integral=900.0,
    derivative=240.0,
    sample_rate=125.0,
    effort="drive_torque",
    position_noise=1e-5,
    motor_velocity_noise=8e-4,
    effort_noise=0.05,
)
CURRENT = replace(
    TORQUE,
    torque_constant=8.0,
    proportional=375.0,
    integral=112.0,
    derivative=30.0,
    effort="motor_current",
    effort_noise=6e-3,
)


@dataclass(frozen=True, slots=True)
class Shape:
    """A family of joints: one of them, how far and fast it moves, for how long."""

    joint: Joint
    reach: float
    speed: float
    seconds: tuple[float, float]
    friction: float
    """Chance that it has dry and viscous friction that its nominal model knows."""


SHAPES = {
    "era": Shape(FLEXIBLE, 0.6, 0.06, (90.0, 180.0), 0.4),
    "linear": Shape(LINEAR, 0.12, 0.2, (24.0, 25.0), 1.0),
    "torque": Shape(TORQUE, 1.0, 1.0, (40.0, 80.0), 1.0),
    "current": Shape(CURRENT, 1.0, 1.0, (40.0, 80.0), 0.7),
}

MUJOCO_SHAPE = Shape(replace(FLEXIBLE, damping=0.0), 0.5, 0.06, (50.0, 60.0), 0.4)


def varied(joint: Joint, rng: Rng) -> Joint:
    """Draw another joint of the same family: other numbers, the loop tuned to them."""
    a, b, c = np.exp(rng.uniform(-0.35, 0.35, 3))
    heavier = replace(joint, output_inertia=joint.output_inertia * a, motor_inertia=joint.motor_inertia * a)
    stiffer = replace(heavier, stiffness=joint.stiffness * a * b) if joint.structure == "flexible" else heavier
    gains = {name: getattr(joint, name) * a / c for name in ("proportional", "integral", "derivative")}
    if joint.effort == "drive_torque":
        return tuned(stiffer, {name: value * c for name, value in gains.items()})
    return tuned(stiffer, gains | {"torque_constant": joint.torque_constant * c})


def _off(rng: Rng, value: float) -> float:
    """Two to five percent off, either way."""
    return value * (1.0 + float(rng.choice([-1.0, 1.0])) * float(rng.uniform(0.02, 0.05)))


def nominal_of(joint: Joint, known: tuple[Effect, ...], rng: Rng) -> tuple[Joint, tuple[Effect, ...]]:
    """Give the numbers that the ground believes in: every one of them a little off, the controller's excepted."""
    names = ["output_inertia"]
    if joint.structure == "flexible":
        names += ["motor_inertia", "stiffness"]
    if joint.effort == "motor_current":
        names += ["torque_constant"]
    off = tuned(joint, {name: _off(rng, getattr(joint, name)) for name in names})
    return off, tuple(replace(e, values={k: _off(rng, v) for k, v in e.values.items()}) for e in known)


def shape_for(kinds: list[Kind], rng: Rng) -> Shape:
    """Draw a family in which all these kinds can act."""
    names = ["era", "linear", "torque", "current"]
    weights = np.array([0.55, 0.15, 0.15, 0.15])
    for kind in kinds:
        if kind.structures == ("flexible",):
            weights[1:] = 0.0
        if kind.name in ("torque_ripple", "cogging"):
            weights[1] = 0.0  # a linear drive has no turns to count
        if kind.name in ("torque_constant_change", "torque_constant_drift", "magnetic_saturation", "demagnetisation"):
            weights[1:3] = 0.0  # effort given as torque has no torque constant
        if kind.name in ("gravity_unbalance", "encoder_eccentricity"):
            weights[1] = 0.0
        if kind.name == "controller_integral":
            weights[1] = 0.0
        if kind.name in ("current_limit", "current_gain", "current_bias"):
            weights[1:3] = 0.0  # named in amperes
    return SHAPES[str(rng.choice(names, p=weights / weights.sum()))]


def known_friction(kinds: list[Kind], shape: Shape, joint: Joint, s: Scales, rng: Rng) -> tuple[Effect, ...]:
    """Friction that the nominal model knows of, none of it of the kind that is left out."""
    acting = {kind.name.split("/")[0] for kind in kinds}
    shapes = {"asymmetric_friction", "stribeck_friction", "shear_thinning_friction"}  # of a friction that is there
    needs = bool(acting & shapes)
    if not needs and rng.random() > shape.friction:
        return ()
    side: Literal["motor"] | None = "motor" if joint.structure == "flexible" else None
    known = [
        Effect("coulomb_friction", {"torque_nm": 0.3 * s.torque * float(rng.uniform(0.7, 1.3))}, side),
        Effect(
            "viscous_friction", {"coefficient_nms_rad": 0.2 * s.torque / s.speed * float(rng.uniform(0.7, 1.3))}, side
        ),
    ]
    return tuple(effect for effect in known if effect.term not in acting)
