import numpy as np
import pytest
from joints import PLANT

from gsfdi.directions import DIRECTIONS, Moving, grouped, library, slipping
from gsfdi.motion import (
    ANGLE,
    DIRECTION,
    JOINT_ANGLE,
    LOAD,
    QUANTITIES,
    SPEED,
    STATES,
    TEMPERATURE,
    PhysicsTerm,
)
from gsfdi.registry import shelf

TERMS = shelf("gsfdi.terms", PhysicsTerm)
T = np.linspace(0.0, 20.0, 400)
ANGLE_OF_T = 0.5 * np.sin(0.7 * T)
SPEED_OF_T = 0.35 * np.cos(0.7 * T) + 1e-6
ZERO = np.zeros_like(T)
MOVING = Moving(
    T, ANGLE_OF_T, SPEED_OF_T, ZERO, ANGLE_OF_T, SPEED_OF_T, ZERO, 1e-4 * np.sin(3 * T), ZERO, 5.0 * np.sin(2 * T),
    4.0 * np.cos(2 * T), 25.0 + ZERO, PLANT, 1e-9,
)  # fmt: skip
RESISTING = {
    "coulomb_friction:motor": {"torque_nm": 1.0},
    "viscous_friction:motor": {"coefficient_nms_rad": 1.0},
    "constant_load": {"torque_nm": 1.0},
    "asymmetric_friction": {"difference_nms_rad": 1.0},
    "stribeck_friction": {"excess_nm": 1.0, "velocity_rad_s": 0.2 * MOVING.brisk},
    "load_dependent_friction": {"ratio": 1.0},
    "quadratic_friction": {"coefficient_nms2_rad2": 1.0},
    "gravity_unbalance:s": {"torque_nm": 1.0, "angle_rad": 0.0},
    "cable_harness": {"stiffness_nm_rad": 1.0, "rest_rad": 0.0},
}
"""Directions of a resisting torque, and the parameters at which the term on the shelf says the same."""


@pytest.mark.parametrize("key", RESISTING)
def test_a_direction_is_the_law_of_its_term(key: str) -> None:
    direction = next(one for one in DIRECTIONS if one.key == key)
    term = TERMS[direction.fault]
    p = np.array([RESISTING[key].get(param.name, 0.0) for param in term.params])
    assert direction.shape is not None
    found = direction.shape(MOVING)
    for k in range(0, len(T), 7):
        m = np.zeros(QUANTITIES)
        m[[ANGLE, JOINT_ANGLE]], m[SPEED], m[LOAD] = ANGLE_OF_T[k], SPEED_OF_T[k], MOVING.load[k]
        m[DIRECTION], m[TEMPERATURE] = np.sign(SPEED_OF_T[k]), 25.0
        value = term.law(m, p, np.full(STATES, np.nan))
        if term.place == "dry":
            value *= np.sign(SPEED_OF_T[k])
        assert found[k] == pytest.approx(value, rel=1e-6, abs=1e-9), f"at {T[k]:.2f} s"


def test_every_direction_is_a_fault_that_the_shelf_knows() -> None:
    assert {one.fault for one in DIRECTIONS} <= set(TERMS)
    for one in DIRECTIONS:
        assert one.component == TERMS[one.fault].component
        if one.fault != "magnetic_saturation":
            assert one.parameter in [param.name for param in TERMS[one.fault].params]


def test_keys_are_unique() -> None:
    assert len({one.key for one in DIRECTIONS}) == len(DIRECTIONS)


def test_amplitudes_are_finite_whatever_the_motion() -> None:
    still = MOVING._replace(
        angle=ZERO, speed=ZERO, motor_angle=ZERO, motor_speed=ZERO, windup=ZERO, windup_rate=ZERO, drive=ZERO, load=ZERO
    )
    for one in DIRECTIONS:
        if one.shape is not None:
            assert np.isfinite(one.shape(still)).all(), one.key
            assert np.isfinite(one.shape(MOVING)).all(), one.key


def test_sine_and_cosine_share_a_group() -> None:
    names = dict(grouped(DIRECTIONS))
    assert len(names["cogging:2"]) == 2
    assert len(names["gravity_unbalance"]) == 2
    assert len(names["torque_constant_change"]) == 1


def test_a_rigid_joint_has_no_gearbox() -> None:
    assert not [one for one in library(False, True, False) if one.component == "gearbox"]
    assert not [one for one in library(True, False, False) if one.enters == "velocity"]


def test_a_slipping_element_bears_no_more_than_its_level() -> None:
    borne = slipping(np.sin(T), 0.1)
    assert np.abs(borne).max() == 1.0
    assert slipping(1e-3 * np.sin(T), 0.1) == pytest.approx(1e-2 * np.sin(T), abs=1e-12)
