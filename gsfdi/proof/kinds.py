"""Every kind of case: what acts, how large it is in the joint's own scales, and what the data cannot tell it from.

Sizes run from plain (1) to where hardly anything could see them (0.003); a kind turns a size and the joint's own
scales into the parameters of an effect. Kinds are data: a new one is a new line of `KINDS`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gsfdi.proof.world import Effect, Joint, tuned

Rng = np.random.Generator
SIZES = {"plain": 1.0, "moderate": 0.3, "small": 0.05, "hidden": 0.003}

PARAMETERS = ("torque_constant_change", "motor_inertia_change", "output_inertia_change", "stiffness_change")
"""Terms that change a number of the linear model and add no physics."""


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


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _near(rng: Rng, value: float) -> float:
    return float(value * rng.uniform(0.8, 1.25))


def _side(joint: Joint, rng: Rng) -> Literal["motor", "output"] | None:
    if joint.structure == "rigid":
        return None
    return "motor" if rng.random() < 0.7 else "output"


def _ratio(term: str, most: float) -> Draw:
    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        return Effect(term, {"ratio": 1.0 + _sign(rng) * _near(rng, most) * f})

    return draw


def _drift(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    onset = float(rng.uniform(0.2, 0.6) * s.seconds)
    rate = -_near(rng, 0.25) * f / (s.seconds - onset)
    return Effect("torque_constant_drift", {"rate_per_s": rate, "onset_s": onset}, onset=onset)


def _per_turn(s: Scales, j: Joint, rng: Rng) -> float:
    """Order per motor turn that stays below a third of the sampling frequency at working speed."""
    highest = j.sample_rate / 3.0 / max(s.speed * j.gear_ratio / (2 * np.pi), 1e-9)
    return float(rng.integers(1, max(2, min(24, int(highest)) + 1)))


def _ripple(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    return Effect(
        "torque_ripple",
        {"amplitude_ratio": _near(rng, 0.2) * f, "order": _per_turn(s, j, rng), "phase_rad": rng.uniform(-3, 3)},
    )


def _cogging(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    size = _near(rng, 0.3) * s.torque * f
    return Effect("cogging", {"amplitude_nm": size, "order": _per_turn(s, j, rng), "phase_rad": rng.uniform(-3, 3)})


def _magnet(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    loss = _near(rng, 0.25) * f  # share of the torque that is lost at the peak
    return Effect("magnetic_saturation", {"current_a": s.peak_effort / np.sqrt(1 / (1 - loss) ** 2 - 1)})


def _limit(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    return Effect("current_limit", {"limit_a": s.peak_effort * (1 - _near(rng, 0.25) * f)})


def _one(
    term: str,
    name: str,
    scale: Callable[[Scales, Joint], float],
    most: float,
    signed: bool = False,
    sided: bool = False,
) -> Draw:
    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        value = _near(rng, most) * scale(s, j) * f * (_sign(rng) if signed else 1.0)
        return Effect(term, {name: float(value)}, _side(j, rng) if sided else None)

    return draw


def _stribeck(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    values = {"excess_nm": _near(rng, 0.3) * s.torque * f, "velocity_rad_s": _near(rng, 0.12) * s.speed}
    return Effect("stribeck_friction", values, _side(j, rng))


def _presliding(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    torque = _near(rng, 0.3) * s.torque * f
    return Effect(
        "presliding_friction",
        {"torque_nm": torque, "stiffness_nm_rad": torque / (_near(rng, 0.01) * s.reach)},
        _side(j, rng),
    )


def _asymmetric(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    dry = _sign(rng) * _near(rng, 0.2) * s.torque * f
    wet = _sign(rng) * _near(rng, 0.25) * s.torque / s.speed * f
    return Effect("asymmetric_friction", {"difference_nm": dry, "difference_nms_rad": wet}, _side(j, rng))


def _warm(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    values = {"coefficient_nms_rad": _near(rng, 0.4) * s.torque / s.speed * f, "per_degc": -rng.uniform(0.02, 0.035)}
    return Effect("temperature_dependent_friction", values)


def _bump(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    return Effect(
        "position_dependent_friction",
        {
            "torque_nm": _near(rng, 0.5) * s.torque * f,
            "centre_rad": s.centre + rng.uniform(-0.5, 0.5) * s.reach,
            "width_rad": _near(rng, 0.15) * s.reach,
        },
    )


def _hysteresis(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    return Effect(
        "gearbox_hysteresis", {"torque_nm": _near(rng, 0.3) * s.torque * f, "width_rad": _near(rng, 0.3) * s.windup}
    )


def _mesh(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    values = {"amplitude_rad": _near(rng, 0.8) * s.windup * f, "order": float(rng.integers(1, 4))}
    return Effect("transmission_error", values | {"phase_rad": rng.uniform(-3, 3)})


def _gravity(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    return Effect(
        "gravity_unbalance",
        {"torque_nm": _near(rng, 0.6) * s.torque * f, "angle_rad": s.centre + rng.uniform(-1.2, 1.2)},
    )


def _harness(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    values = {"stiffness_nm_rad": _near(rng, 0.4) * s.torque / s.reach * f}
    return Effect("cable_harness", values | {"rest_rad": s.centre + rng.uniform(-0.5, 0.5) * s.reach})


def _mode(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    share = _near(rng, 0.25) * f
    return Effect(
        "structural_mode",
        {
            "inertia_kg_m2": share * j.output_inertia,
            "frequency_hz": float(rng.uniform(0.01, 0.035) * j.sample_rate),
            "damping_ratio": float(rng.uniform(0.01, 0.04)),
        },
    )


def _stop(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    side = _sign(rng) if abs(s.centre) < 0.7 * s.reach else float(np.sign(s.centre))  # the sign of a stop says its side
    angle = s.centre + side * s.reach * (1 - 0.2 * f)
    return Effect("end_stop", {"angle_rad": angle, "stiffness_nm_rad": _near(rng, 6.0) * s.torque / s.reach})


def _eccentric(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    values = {"amplitude_rad": _near(rng, 2e-3) * s.reach * f, "order": float(rng.integers(2, 9))}
    return Effect("encoder_eccentricity", values | {"phase_rad": rng.uniform(-3, 3)})


def _vibration(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
    values = {"torque_nm": _near(rng, 0.3) * s.torque * f, "frequency_hz": float(rng.uniform(0.3, 1.5))}
    return Effect("base_vibration", values)


def _pair(term: str, names: tuple[str, ...], sizes: Callable[[Scales, Joint, Rng], tuple[float, ...]]) -> Draw:
    """Draw an effect whose first parameter scales with the size and whose others do not."""

    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        values = [float(value) for value in sizes(s, j, rng)]
        return Effect(term, dict(zip(names, [values[0] * f, *values[1:]], strict=True)))

    return draw


def _gain(name: str, most: float) -> Draw:
    def draw(s: Scales, j: Joint, f: float, rng: Rng) -> Effect:
        return Effect(f"controller_{name}", {"ratio": 1.0 + _sign(rng) * _near(rng, most) * f})

    return draw


def _damping(s: Scales, j: Joint) -> float:
    """Critical damping of the gearbox mode."""
    reflected = j.motor_inertia * j.gear_ratio**2
    return float(2 * np.sqrt(j.stiffness * reflected * j.output_inertia / (reflected + j.output_inertia)))


FLEXIBLE, ROTARY = ("flexible",), ("flexible", "rigid")
KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("torque_constant_change", "motor", _ratio("torque_constant_change", 0.2), family="parameter", onset=True),
        Kind("torque_constant_drift", "motor", _drift),
        Kind("torque_ripple", "motor", _ripple),
        Kind("cogging", "motor", _cogging),
        Kind("magnetic_saturation", "motor", _magnet),
        Kind("current_limit", "motor", _limit),
        Kind("actuation_delay", "motor", _one("actuation_delay", "delay_s", lambda s, j: 1 / j.sample_rate, 3.0)),
        Kind("motor_inertia_change", "motor", _ratio("motor_inertia_change", 0.4), FLEXIBLE, family="parameter"),
        Kind(
            "coulomb_friction",
            "friction",
            _one("coulomb_friction", "torque_nm", lambda s, j: s.torque, 0.3, sided=True),
            onset=True,
        ),
        Kind(
            "viscous_friction",
            "friction",
            _one("viscous_friction", "coefficient_nms_rad", lambda s, j: s.torque / s.speed, 0.3, sided=True),
            onset=True,
        ),
        Kind("stribeck_friction", "friction", _stribeck),
        Kind("stribeck_friction/lorentz", "friction", _stribeck, variant=1),
        Kind("presliding_friction", "friction", _presliding),
        Kind("asymmetric_friction", "friction", _asymmetric),
        Kind("load_dependent_friction", "friction", _one("load_dependent_friction", "ratio", lambda s, j: 1.0, 0.25)),
        Kind("temperature_dependent_friction", "friction", _warm),
        Kind("position_dependent_friction", "friction", _bump),
        Kind(
            "quadratic_friction",
            "friction",
            _one("quadratic_friction", "coefficient_nms2_rad2", lambda s, j: s.torque / s.speed**2, 0.4),
        ),
        Kind("stiffness_change", "gearbox", _ratio("stiffness_change", 0.25), FLEXIBLE, family="parameter", onset=True),
        Kind("stiffening", "gearbox", _one("stiffening", "cubic_per_rad2", lambda s, j: s.windup**-2, 0.5), FLEXIBLE),
        Kind("backlash", "gearbox", _one("backlash", "half_width_rad", lambda s, j: s.windup, 1.5), FLEXIBLE),
        Kind(
            "backlash/lossy",
            "gearbox",
            _one("backlash", "half_width_rad", lambda s, j: s.windup, 1.5),
            FLEXIBLE,
            variant=2,
        ),
        Kind("gearbox_hysteresis", "gearbox", _hysteresis, FLEXIBLE),
        Kind("gearbox_damping", "gearbox", _one("gearbox_damping", "coefficient_nms_rad", _damping, 0.2), FLEXIBLE),
        Kind("transmission_error", "gearbox", _mesh, FLEXIBLE),
        Kind("output_inertia_change", "link", _ratio("output_inertia_change", 0.25), family="parameter"),
        Kind("gravity_unbalance", "link", _gravity),
        Kind("cable_harness", "link", _harness),
        Kind("structural_mode", "link", _mode),
        Kind(
            "constant_load",
            "link",
            _one("constant_load", "torque_nm", lambda s, j: s.torque, 0.4, signed=True),
            onset=True,
        ),
        Kind("end_stop", "link", _stop),
        Kind(
            "position_bias",
            "sensor",
            _one("position_bias", "bias_rad", lambda s, j: s.reach, 4e-3, signed=True),
            family="sensor",
            onset=True,
        ),
        Kind("position_gain", "sensor", _ratio("position_gain", 0.05), family="sensor"),
        Kind("encoder_eccentricity", "sensor", _eccentric, family="sensor"),
        Kind("velocity_gain", "sensor", _ratio("velocity_gain", 0.08), family="sensor"),
        Kind(
            "velocity_bias",
            "sensor",
            _one("velocity_bias", "bias_rad_s", lambda s, j: s.speed * j.gear_ratio, 0.1, signed=True),
            family="sensor",
        ),
        Kind("current_gain", "sensor", _ratio("current_gain", 0.1), family="sensor"),
        Kind(
            "current_bias",
            "sensor",
            _one("current_bias", "bias_a", lambda s, j: s.effort, 0.15, signed=True),
            family="sensor",
            onset=True,
        ),
        Kind(
            "quantisation",
            "sensor",
            _one("quantisation", "step_rad", lambda s, j: max(j.position_noise, j.position_resolution), 40.0),
            family="sensor",
        ),
        Kind(
            "timestamp_latency",
            "sensor",
            _one("timestamp_latency", "delay_s", lambda s, j: 1 / j.sample_rate, 3.0),
            family="sensor",
        ),
        Kind("controller_proportional", "controller", _gain("proportional", 0.2), family="controller"),
        Kind("controller_derivative", "controller", _gain("derivative", 0.2), family="controller"),
        Kind("controller_integral", "controller", _gain("integral", 0.6), family="controller"),
        Kind("base_vibration", "link", _vibration, family="unknown"),
        Kind(
            "neighbour_motion",
            "link",
            _one("neighbour_motion", "torque_nm", lambda s, j: s.torque, 0.3),
            family="unknown",
        ),
        Kind(
            "grabbing_brake",
            "friction",
            _one("grabbing_brake", "torque_nm", lambda s, j: s.torque, 0.6),
            family="unknown",
        ),
        Kind(
            "demagnetisation",
            "motor",
            _pair("demagnetisation", ("loss", "heat"), lambda s, j, rng: (_near(rng, 0.4), s.effort**2 / 4)),
            family="unknown",
        ),
        Kind(
            "gear_creep",
            "gearbox",
            _pair(
                "gear_creep",
                ("stiffness_nm_rad", "relaxation_s"),
                lambda s, j, rng: (_near(rng, 1.5) * j.stiffness, rng.uniform(0.5, 3)),
            ),
            FLEXIBLE,
            family="unknown",
        ),
        Kind(
            "moving_payload",
            "link",
            _pair(
                "moving_payload",
                ("share", "order", "angle_rad"),
                lambda s, j, rng: (
                    _near(rng, 0.35),
                    rng.uniform(1.5, 3) / s.reach,
                    s.centre + rng.uniform(-1, 1) * s.reach,
                ),
            ),
            family="unknown",
        ),
        Kind(
            "sector_drag",
            "friction",
            _pair(
                "sector_drag",
                ("torque_nm", "order", "level"),
                lambda s, j, rng: (_near(rng, 0.4) * s.torque, rng.uniform(8, 20) / s.reach, rng.uniform(-0.4, 0.4)),
            ),
            family="unknown",
        ),
        Kind(
            "wave_generator_slip",
            "gearbox",
            _pair(
                "wave_generator_slip",
                ("torque_nm", "memory_s", "threshold_nm"),
                lambda s, j, rng: (_near(rng, 0.4) * s.torque, rng.uniform(0.2, 0.6), 0.4 * s.torque),
            ),
            family="unknown",
        ),
    )
}


def faulty_controller(joint: Joint, effect: Effect) -> Joint:
    """Give the joint the gains that it really runs with."""
    name = effect.term.removeprefix("controller_")
    return tuned(joint, {name: getattr(joint, name) * effect.values["ratio"]})


def equivalents(joint: Joint, effect: Effect, told: Mapping[str, bool]) -> tuple[str, ...]:
    """Other names that the same data would bear exactly or nearly, given what the tool is `told`.

    Known in advance from the equations, whatever a tool answers; a set that holds the truth or one of these counts as
    covering it, the first name counts only when it is the truth itself or an exact equivalent.
    """
    near = set(EQUIVALENT.get(effect.term, ()))
    if joint.structure == "rigid":
        near |= set(EQUIVALENT_RIGID.get(effect.term, ()))
    if not told.get("controller", True):
        near |= set(EQUIVALENT_WITHOUT_CONTROLLER.get(effect.term, ()))
    return tuple(sorted(near))


EQUIVALENT: dict[str, tuple[str, ...]] = {
    # Scaling torque constant, stiffness and both inertias together leaves input and output as they were.
    # A constant torque is a friction that differs by direction as long as the joint moves.
    "constant_load": ("asymmetric_friction",),
}
EQUIVALENT_RIGID: dict[str, tuple[str, ...]] = {
    # One equation: torque constant against everything it drives, and no spring to tell the sides apart.
    "torque_constant_change": ("output_inertia_change",),
    "output_inertia_change": ("torque_constant_change",),
}
EQUIVALENT_WITHOUT_CONTROLLER: dict[str, tuple[str, ...]] = {
    "current_gain": ("torque_constant_change",),
    "torque_constant_change": ("current_gain",),
    "current_bias": ("constant_load", "asymmetric_friction"),
    "constant_load": ("current_bias",),
}
