"""How large an effect is, in the joint's own scales: what a size from plain to hidden means for each kind.

Every function takes the scales, the joint, the size and a generator, and gives the effect; those that make such a
function say so.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gsfdi.proof.world import Effect, Joint, tuned

Rng = np.random.Generator
SIZES = {"plain": 1.0, "moderate": 0.3, "small": 0.05, "hidden": 0.003}


@dataclass(frozen=True, slots=True)
class Scales:
    """What a joint does on its motion when nothing is amiss.

    Torque is the 95th percentile of the drive torque at the output, speed of the joint's speed, effort of the current;
    reach is half the range of motion, windup the 95th percentile of the wind-up.
    """

    torque: float
    speed: float
    effort: float
    reach: float
    centre: float
    windup: float
    seconds: float
    peak_effort: float


Draw = Callable[[Scales, Joint, float, Rng], Effect]


def either_way(rng: Rng) -> float:
    """Draw a sign."""
    return float(rng.choice([-1.0, 1.0]))


def near(rng: Rng, value: float) -> float:
    """Draw a value within a quarter of this one."""
    return float(value * rng.uniform(0.8, 1.25))


def side_of(joint: Joint, rng: Rng) -> Literal["motor", "output"] | None:
    """Draw the side on which a friction sits; a rigid joint has none."""
    if joint.structure == "rigid":
        return None
    return "motor" if rng.random() < 0.7 else "output"


def off_by(term: str, most: float) -> Draw:
    """Make a kind that changes a number by a ratio, up or down."""

    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        return Effect(term, {"ratio": 1.0 + either_way(rng) * near(rng, most) * f})

    return draw


def weakening_magnet(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the torque constant fall from some moment on."""
    onset = float(rng.uniform(0.2, 0.6) * s.seconds)
    rate = -near(rng, 0.25) * f / (s.seconds - onset)
    return Effect("torque_constant_drift", {"rate_per_s": rate, "onset_s": onset}, onset=onset)


def order_per_turn(s: Scales, j: Joint, rng: Rng) -> float:
    """Order per motor turn that stays below a third of the sampling frequency at working speed."""
    highest = j.sample_rate / 3.0 / max(s.speed * j.gear_ratio / (2 * np.pi), 1e-9)
    return float(rng.integers(1, max(2, min(24, int(highest)) + 1)))


def ripple(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the torque constant vary over a motor turn."""
    return Effect(
        "torque_ripple",
        {"amplitude_ratio": near(rng, 0.2) * f, "order": order_per_turn(s, j, rng), "phase_rad": rng.uniform(-3, 3)},
    )


def cogging(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the magnets pull at the iron over a motor turn."""
    size = near(rng, 0.3) * s.torque * f
    return Effect(
        "cogging", {"amplitude_nm": size, "order": order_per_turn(s, j, rng), "phase_rad": rng.uniform(-3, 3)}
    )


def saturating_magnet(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the iron saturate so that a share of the peak torque is lost."""
    loss = near(rng, 0.25) * f  # share of the torque that is lost at the peak
    return Effect("magnetic_saturation", {"current_a": s.peak_effort / np.sqrt(1 / (1 - loss) ** 2 - 1)})


def lower_limit(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Clip the current below the peak that the motion asks for."""
    return Effect("current_limit", {"limit_a": s.peak_effort * (1 - near(rng, 0.25) * f)})


def in_proportion(
    term: str,
    name: str,
    scale: Callable[[Scales, Joint], float],
    most: float,
    signed: bool = False,
    sided: bool = False,
) -> Draw:
    """Make a kind of one number, in proportion to a scale of the joint."""

    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        value = near(rng, most) * scale(s, j) * f * (either_way(rng) if signed else 1.0)
        return Effect(term, {name: float(value)}, side_of(j, rng) if sided else None)

    return draw


def stribeck(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Give friction that is greater near standstill."""
    values = {"excess_nm": near(rng, 0.3) * s.torque * f, "velocity_rad_s": near(rng, 0.12) * s.speed}
    return Effect("stribeck_friction", values, side_of(j, rng))


def yielding_film(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Give friction that builds up over a small part of the speed."""
    values = {"torque_nm": near(rng, 0.3) * s.torque * f, "velocity_rad_s": near(rng, 0.08) * s.speed}
    return Effect("shear_thinning_friction", values)


def bristles(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Give friction that is a spring before it slides."""
    torque = near(rng, 0.3) * s.torque * f
    return Effect(
        "presliding_friction",
        {"torque_nm": torque, "stiffness_nm_rad": torque / (near(rng, 0.01) * s.reach)},
        side_of(j, rng),
    )


def one_way_drag(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let friction differ by direction, dry and viscous."""
    dry = either_way(rng) * near(rng, 0.2) * s.torque * f
    wet = either_way(rng) * near(rng, 0.25) * s.torque / s.speed * f
    return Effect("asymmetric_friction", {"difference_nm": dry, "difference_nms_rad": wet}, side_of(j, rng))


def cold_grease(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let viscous friction fall with temperature."""
    values = {"coefficient_nms_rad": near(rng, 0.4) * s.torque / s.speed * f, "per_degc": -rng.uniform(0.02, 0.035)}
    return Effect("temperature_dependent_friction", values)


def tight_spot(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Put friction around one angle."""
    return Effect(
        "position_dependent_friction",
        {
            "torque_nm": near(rng, 0.5) * s.torque * f,
            "centre_rad": s.centre + rng.uniform(-0.5, 0.5) * s.reach,
            "width_rad": near(rng, 0.15) * s.reach,
        },
    )


def hysteresis(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the wind-up depend on where the load came from."""
    return Effect(
        "gearbox_hysteresis", {"torque_nm": near(rng, 0.3) * s.torque * f, "width_rad": near(rng, 0.3) * s.windup}
    )


def uneven_mesh(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the gear lead and lag over a motor turn."""
    values = {"amplitude_rad": near(rng, 0.8) * s.windup * f, "order": float(rng.integers(1, 4))}
    return Effect("transmission_error", values | {"phase_rad": rng.uniform(-3, 3)})


def unbalance(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Hang a mass beside the axis."""
    return Effect(
        "gravity_unbalance",
        {"torque_nm": near(rng, 0.6) * s.torque * f, "angle_rad": s.centre + rng.uniform(-1.2, 1.2)},
    )


def harness(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let a cable pull the link back."""
    values = {"stiffness_nm_rad": near(rng, 0.4) * s.torque / s.reach * f}
    return Effect("cable_harness", values | {"rest_rad": s.centre + rng.uniform(-0.5, 0.5) * s.reach})


def appendage(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Hang something springy on the link."""
    share = near(rng, 0.25) * f
    return Effect(
        "structural_mode",
        {
            "inertia_kg_m2": share * j.output_inertia,
            "frequency_hz": float(rng.uniform(0.01, 0.035) * j.sample_rate),
            "damping_ratio": float(rng.uniform(0.01, 0.04)),
        },
    )


def stop(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the link touch a stop at the end of its range."""
    side = (
        either_way(rng) if abs(s.centre) < 0.7 * s.reach else float(np.sign(s.centre))
    )  # the sign of a stop says its side
    angle = s.centre + side * s.reach * (1 - 0.2 * f)
    return Effect("end_stop", {"angle_rad": angle, "stiffness_nm_rad": near(rng, 6.0) * s.torque / s.reach})


def eccentric_encoder(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Let the encoder lead and lag over a turn."""
    values = {"amplitude_rad": near(rng, 2e-3) * s.reach * f, "order": float(rng.integers(2, 9))}
    return Effect("encoder_eccentricity", values | {"phase_rad": rng.uniform(-3, 3)})


def shaking_base(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    """Shake the base at a frequency of its own."""
    values = {"torque_nm": near(rng, 0.3) * s.torque * f, "frequency_hz": float(rng.uniform(0.3, 1.5))}
    return Effect("base_vibration", values)


def first_in_proportion(
    term: str, names: tuple[str, ...], sizes: Callable[[Scales, Joint, Rng], tuple[float, ...]]
) -> Draw:
    """Draw an effect whose first parameter scales with the size and whose others do not."""

    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        values = [float(value) for value in sizes(s, j, rng)]
        return Effect(term, dict(zip(names, [values[0] * f, *values[1:]], strict=True)))

    return draw


def gain_off_by(name: str, most: float) -> Draw:
    """Make a kind whose controller has another gain than the nominal model believes."""

    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        return Effect(f"controller_{name}", {"ratio": 1.0 + either_way(rng) * near(rng, most) * f})

    return draw


def critical_damping(s: Scales, j: Joint) -> float:
    """Critical damping of the gearbox mode."""
    reflected = j.motor_inertia * j.gear_ratio**2
    return float(2 * np.sqrt(j.stiffness * reflected * j.output_inertia / (reflected + j.output_inertia)))


def faulty_controller(joint: Joint, effect: Effect) -> Joint:
    """Give the joint the gains that it really runs with."""
    name = effect.term.removeprefix("controller_")
    return tuned(joint, {name: getattr(joint, name) * effect.values["ratio"]})
