"""Every kind of case: what acts, and what the data cannot tell it from.

Kinds are data: a new one is a new line of `KINDS`; `sizes` says how large each is.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from gsfdi.proof.sizes import (
    Draw,
    appendage,
    bristles,
    cogging,
    cold_grease,
    critical_damping,
    eccentric_encoder,
    first_in_proportion,
    gain_off_by,
    harness,
    hysteresis,
    in_proportion,
    lower_limit,
    near,
    off_by,
    one_way_drag,
    ripple,
    saturating_magnet,
    shaking_base,
    stop,
    stribeck,
    tight_spot,
    unbalance,
    uneven_mesh,
    weakening_magnet,
    yielding_film,
)
from gsfdi.proof.world import SMOOTH, Effect, Joint

PARAMETERS = {
    "torque_constant_change": "torque_constant",
    "motor_inertia_change": "motor_inertia",
    "output_inertia_change": "output_inertia",
    "stiffness_change": "stiffness",
}
"""Terms that change a number of the linear model and add no physics, and that number."""


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of case.

    `draw` takes scales, joint, size and a generator and returns the effect, or a joint whose controller is not the one
    that its nominal model believes in.
    """

    name: str
    component: str
    draw: Draw
    structures: tuple[str, ...] = ("flexible", "rigid")
    family: Literal["physics", "parameter", "sensor", "controller", "unknown"] = "physics"
    variant: int = 0
    onset: bool = False
    """Whether half of its cases set in during the recording."""


FLEXIBLE = ("flexible",)
KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("torque_constant_change", "motor", off_by("torque_constant_change", 0.2), family="parameter", onset=True),
        Kind("torque_constant_drift", "motor", weakening_magnet),
        Kind("torque_ripple", "motor", ripple),
        Kind("cogging", "motor", cogging),
        Kind("magnetic_saturation", "motor", saturating_magnet),
        Kind("magnetic_saturation/froehlich", "motor", saturating_magnet, variant=4),
        Kind("current_limit", "motor", lower_limit),
        Kind(
            "actuation_delay", "motor", in_proportion("actuation_delay", "delay_s", lambda s, j: 1 / j.sample_rate, 3.0)
        ),
        Kind("motor_inertia_change", "motor", off_by("motor_inertia_change", 0.4), FLEXIBLE, family="parameter"),
        Kind(
            "coulomb_friction",
            "friction",
            in_proportion("coulomb_friction", "torque_nm", lambda s, j: s.torque, 0.3, sided=True),
            onset=True,
        ),
        Kind(
            "coulomb_friction/smooth",
            "friction",
            in_proportion("coulomb_friction", "torque_nm", lambda s, j: s.torque, 0.3, sided=True),
            variant=SMOOTH,
        ),
        Kind(
            "viscous_friction",
            "friction",
            in_proportion("viscous_friction", "coefficient_nms_rad", lambda s, j: s.torque / s.speed, 0.3, sided=True),
            onset=True,
        ),
        Kind("stribeck_friction", "friction", stribeck),
        Kind("stribeck_friction/lorentz", "friction", stribeck, variant=1),
        Kind("presliding_friction", "friction", bristles),
        Kind("asymmetric_friction", "friction", one_way_drag),
        Kind(
            "load_dependent_friction",
            "friction",
            in_proportion("load_dependent_friction", "ratio", lambda s, j: 1.0, 0.25),
        ),
        Kind("temperature_dependent_friction", "friction", cold_grease),
        Kind("temperature_dependent_friction/exponential", "friction", cold_grease, variant=6),
        Kind("position_dependent_friction", "friction", tight_spot),
        Kind(
            "quadratic_friction",
            "friction",
            in_proportion("quadratic_friction", "coefficient_nms2_rad2", lambda s, j: s.torque / s.speed**2, 0.4),
        ),
        Kind("shear_thinning_friction", "friction", yielding_film),
        Kind("stiffness_change", "gearbox", off_by("stiffness_change", 0.25), FLEXIBLE, family="parameter", onset=True),
        Kind(
            "stiffening",
            "gearbox",
            in_proportion("stiffening", "cubic_per_rad2", lambda s, j: s.windup**-2, 0.5),
            FLEXIBLE,
        ),
        Kind("backlash", "gearbox", in_proportion("backlash", "half_width_rad", lambda s, j: s.windup, 1.5), FLEXIBLE),
        Kind(
            "backlash/lossy",
            "gearbox",
            in_proportion("backlash", "half_width_rad", lambda s, j: s.windup, 1.5),
            FLEXIBLE,
            variant=2,
        ),
        Kind("gearbox_hysteresis", "gearbox", hysteresis, FLEXIBLE),
        Kind(
            "gearbox_damping",
            "gearbox",
            in_proportion("gearbox_damping", "coefficient_nms_rad", critical_damping, 0.2),
            FLEXIBLE,
        ),
        Kind("transmission_error", "gearbox", uneven_mesh, FLEXIBLE),
        Kind("output_inertia_change", "link", off_by("output_inertia_change", 0.25), family="parameter"),
        Kind("gravity_unbalance", "link", unbalance),
        Kind("cable_harness", "link", harness),
        Kind("cable_harness/hardening", "link", harness, variant=5),
        Kind("structural_mode", "link", appendage),
        Kind(
            "constant_load",
            "link",
            in_proportion("constant_load", "torque_nm", lambda s, j: s.torque, 0.4, signed=True),
            onset=True,
        ),
        Kind("end_stop", "link", stop),
        Kind(
            "position_bias",
            "sensor",
            in_proportion("position_bias", "bias_rad", lambda s, j: s.reach, 4e-3, signed=True),
            family="sensor",
            onset=True,
        ),
        Kind("position_gain", "sensor", off_by("position_gain", 0.05), family="sensor"),
        Kind("encoder_eccentricity", "sensor", eccentric_encoder, family="sensor"),
        Kind("velocity_gain", "sensor", off_by("velocity_gain", 0.08), family="sensor"),
        Kind(
            "velocity_bias",
            "sensor",
            in_proportion("velocity_bias", "bias_rad_s", lambda s, j: s.speed * j.gear_ratio, 0.1, signed=True),
            family="sensor",
        ),
        Kind("current_gain", "sensor", off_by("current_gain", 0.1), family="sensor"),
        Kind(
            "current_bias",
            "sensor",
            in_proportion("current_bias", "bias_a", lambda s, j: s.effort, 0.15, signed=True),
            family="sensor",
            onset=True,
        ),
        Kind(
            "quantisation",
            "sensor",
            in_proportion("quantisation", "step_rad", lambda s, j: max(j.position_noise, j.position_resolution), 40.0),
            family="sensor",
        ),
        Kind(
            "timestamp_latency",
            "sensor",
            in_proportion("timestamp_latency", "delay_s", lambda s, j: 1 / j.sample_rate, 3.0),
            family="sensor",
        ),
        Kind(
            "velocity_lag",
            "sensor",
            in_proportion("velocity_lag", "lag_s", lambda s, j: 1 / j.sample_rate, 1.0),
            family="sensor",
        ),
        Kind("controller_proportional", "controller", gain_off_by("proportional", 0.2), family="controller"),
        Kind("controller_derivative", "controller", gain_off_by("derivative", 0.2), family="controller"),
        Kind("controller_integral", "controller", gain_off_by("integral", 0.6), family="controller"),
        Kind("base_vibration", "link", shaking_base, family="unknown"),
        Kind(
            "neighbour_motion",
            "link",
            in_proportion("neighbour_motion", "torque_nm", lambda s, j: s.torque, 0.3),
            family="unknown",
        ),
        Kind(
            "grabbing_brake",
            "friction",
            in_proportion("grabbing_brake", "torque_nm", lambda s, j: s.torque, 0.6),
            family="unknown",
        ),
        Kind(
            "demagnetisation",
            "motor",
            first_in_proportion(
                "demagnetisation", ("loss", "heat"), lambda s, j, rng: (near(rng, 0.4), s.effort**2 / 4)
            ),
            family="unknown",
        ),
        Kind(
            "gear_creep",
            "gearbox",
            first_in_proportion(
                "gear_creep",
                ("stiffness_nm_rad", "relaxation_s"),
                lambda s, j, rng: (near(rng, 1.5) * j.stiffness, rng.uniform(0.5, 3)),
            ),
            FLEXIBLE,
            family="unknown",
        ),
        Kind(
            "moving_payload",
            "link",
            first_in_proportion(
                "moving_payload",
                ("share", "order", "angle_rad"),
                lambda s, j, rng: (
                    near(rng, 0.35),
                    rng.uniform(1.5, 3) / s.reach,
                    s.centre + rng.uniform(-1, 1) * s.reach,
                ),
            ),
            family="unknown",
        ),
        Kind(
            "sector_drag",
            "friction",
            first_in_proportion(
                "sector_drag",
                ("torque_nm", "order", "level"),
                lambda s, j, rng: (near(rng, 0.4) * s.torque, rng.uniform(8, 20) / s.reach, rng.uniform(-0.4, 0.4)),
            ),
            family="unknown",
        ),
        Kind(
            "wave_generator_slip",
            "gearbox",
            first_in_proportion(
                "wave_generator_slip",
                ("torque_nm", "memory_s", "threshold_nm"),
                lambda s, j, rng: (near(rng, 0.4) * s.torque, rng.uniform(0.2, 0.6), 0.4 * s.torque),
            ),
            family="unknown",
        ),
    )
}


def equivalents(joint: Joint, effect: Effect, told: Mapping[str, bool]) -> tuple[str, ...]:
    """Other names that the same data would bear exactly or nearly, given what the tool is `told`.

    Known in advance from the equations, whatever a tool answers; a set that holds the truth or one of these counts as
    covering it; the first name counts only when it is the truth itself.
    """
    near = set(EQUIVALENT.get(effect.term, ()))
    if joint.structure == "rigid":
        near |= set(EQUIVALENT_RIGID.get(effect.term, ()))
        if joint.gear_ratio == 1 and effect.term == "cogging" and effect.values["order"] == 1:
            near.add("gravity_unbalance")  # one wave a turn of a shaft without gears, whatever it comes from
    if not told.get("controller", True) or effect.onset is None:
        near |= set(EQUIVALENT_FROM_THE_START.get(effect.term, ()))
    if not told.get("controller", True):
        near |= set(EQUIVALENT_WITHOUT_CONTROLLER.get(effect.term, ()))
    return tuple(sorted(near))


EQUIVALENT: dict[str, tuple[str, ...]] = {
    # Too long an angle and too slow a speed differ by one factor on inertias and springs: within the doubt about these.
    "position_gain": ("velocity_gain",),
    "velocity_gain": ("position_gain",),
    # A constant torque is a friction that differs by direction as long as the joint moves.
    "constant_load": ("asymmetric_friction",),
}
NEARLY: dict[str, tuple[str, ...]] = {
    # Over a small angle a weight's torque is a constant and a slope: what a load and a cable are. And a constant is
    # what a friction is that differs by direction, and what a bias of the current looks like.
    "gravity_unbalance": ("cable_harness", "constant_load", "asymmetric_friction", "current_bias"),
    "cable_harness": ("gravity_unbalance", "constant_load", "asymmetric_friction", "current_bias"),
    "constant_load": ("gravity_unbalance", "cable_harness"),
    "coulomb_friction": ("presliding_friction",),
    "presliding_friction": ("coulomb_friction",),
}
"""Terms that describe another's effect so well that, where one is withheld, nothing is left that no term describes."""
EQUIVALENT_RIGID: dict[str, tuple[str, ...]] = {
    # One equation: torque constant against everything it drives, and no spring to tell the sides apart.
    "torque_constant_change": ("output_inertia_change",),
    "output_inertia_change": ("torque_constant_change",),
}
EQUIVALENT_FROM_THE_START: dict[str, tuple[str, ...]] = {
    # The controller's integral began before the recording: a constant current more or less is its start or a bias.
    "current_bias": ("constant_load", "asymmetric_friction"),
    "constant_load": ("current_bias",),
}
EQUIVALENT_WITHOUT_CONTROLLER: dict[str, tuple[str, ...]] = {
    "current_gain": ("torque_constant_change",),
    "torque_constant_change": ("current_gain",),
}
