from dataclasses import replace

import numpy as np
import pytest
from joints import PLANT
from scipy.linalg import expm, null_space

from gsfdi.detectors.parity import stacked
from gsfdi.joint import MISPRINTS, groups, hold, hold_direction, matrices, ramp_hold, relative_directions
from gsfdi.model import Plant

FIELDS = {
    "torque_constant_change": "torque_constant",
    "motor_inertia_change": "motor_inertia",
    "output_inertia_change": "output_inertia",
    "stiffness_change": "stiffness",
}


def changed(plant: Plant, fault: str, factor: float) -> Plant:
    return replace(plant, **{FIELDS[fault]: getattr(plant, FIELDS[fault]) * factor})


def mode(A: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(A).imag).max() / (2 * np.pi))


def test_the_free_mode_is_where_the_physics_puts_it() -> None:
    motor, output = PLANT.gear_ratio**2 * PLANT.motor_inertia, PLANT.output_inertia
    assert mode(matrices(PLANT).A) == pytest.approx(
        np.sqrt(PLANT.stiffness * (1 / motor + 1 / output)) / 2 / np.pi, rel=1e-6
    )
    assert mode(matrices(PLANT).A) == pytest.approx(7.23, abs=0.01)


def test_the_printed_stiffness_term_gives_another_mode() -> None:
    A = matrices(PLANT).A.copy()
    product = PLANT.stiffness / PLANT.gear_ratio**2 * PLANT.motor_inertia
    A[1, 2], A[3, 2] = product, -(product + PLANT.stiffness / PLANT.output_inertia)
    assert mode(A) == pytest.approx(2.87, abs=0.01)


def test_the_printed_trailing_one_is_unstable() -> None:
    A = matrices(PLANT).A.copy()
    A[3, 1], A[3, 3] = 0.0, 1.0
    fast = max(np.linalg.eigvals(A), key=lambda pole: abs(pole.imag))
    assert fast.real == pytest.approx(0.5, abs=0.01)
    assert abs(fast.imag) == pytest.approx(45.4, abs=0.2)
    assert np.linalg.eigvals(matrices(PLANT).A).real.max() < 1e-9


def test_the_printed_brackets_leave_the_input_in_the_residual() -> None:
    joint = matrices(PLANT)
    A, B = hold(joint.A, joint.effort[:, None], 0.01)
    gamma, toeplitz = stacked(A, B, joint.C, 3)
    V = null_space(gamma.T).T
    u, x = np.ones((3, 1)), np.array([0.1, 0.02, 1e-4, 0.0])
    Y = (gamma @ x)[:, None] + toeplitz @ u
    assert np.abs(V @ (Y - toeplitz @ u)).max() < 1e-9
    assert (V @ Y).shape != (toeplitz @ u).shape  # V Y - T U, as printed, cannot even be formed


def test_without_measurement_noise_the_printed_pencil_is_singular() -> None:
    joint = matrices(PLANT)
    A, B = hold(joint.A, joint.effort[:, None], 0.01)
    gamma, toeplitz = stacked(A, B, joint.C, 6)
    V = null_space(gamma.T).T
    fault = V @ toeplitz
    assert np.linalg.matrix_rank(fault @ fault.T) < len(fault)


def test_observability_has_an_empty_kernel() -> None:
    joint = matrices(PLANT)
    A, B = hold(joint.A, joint.effort[:, None], 0.01)
    gamma, _ = stacked(A, B, joint.C, 3)
    scale = np.abs(gamma).max(axis=0)
    assert null_space(gamma / scale).shape[1] == 0
    assert null_space((gamma / scale).T).shape[1] > 0


def test_every_misprint_says_why() -> None:
    assert len(MISPRINTS) >= 4
    assert all(one.printed != one.used and one.why for one in MISPRINTS)


def test_hold_is_exact_for_a_held_input() -> None:
    joint = matrices(PLANT)
    A, B = hold(joint.A, joint.effort[:, None], 0.01)
    fine_A, fine_B = hold(joint.A, joint.effort[:, None], 0.001)
    x, y, u = np.array([0.0, 0.01, 1e-4, 0.0]), np.array([0.0, 0.01, 1e-4, 0.0]), np.array([0.3])
    y = A @ y + B @ u
    for _ in range(10):
        x = fine_A @ x + fine_B @ u
    assert y == pytest.approx(x, rel=1e-9)


def test_ramp_hold_agrees_with_hold_on_a_constant() -> None:
    joint = matrices(PLANT)
    A, B = hold(joint.A, joint.effort[:, None], 0.01)
    A1, early, late = ramp_hold(joint.A, joint.effort[:, None], 0.01)
    assert pytest.approx(A) == A1
    assert early + late == pytest.approx(B)


@pytest.mark.parametrize("plant", [PLANT, Plant(95.0, damping=3.0)], ids=["flexible", "rigid"])
@pytest.mark.parametrize("fault", FIELDS)
def test_directions_are_the_derivatives_of_the_matrices(plant: Plant, fault: str) -> None:
    if fault not in relative_directions(plant):
        pytest.skip("a rigid joint has no such parameter")
    dA, dB = relative_directions(plant)[fault]
    step = 1e-6
    above, below = matrices(changed(plant, fault, 1 + step)), matrices(changed(plant, fault, 1 - step))
    assert dA == pytest.approx((above.A - below.A) / (2 * step), rel=1e-6, abs=1e-7)
    assert dB == pytest.approx((above.effort - below.effort) / (2 * step), rel=1e-6, abs=1e-9)


def test_a_component_failure_can_be_written_in_discrete_time() -> None:
    """The paper holds that it cannot; the Fréchet derivative comes within half a percent, Euler does not."""
    joint, step = matrices(PLANT), 0.01
    dA, dB = relative_directions(PLANT)["stiffness_change"]
    exact = expm((joint.A - 0.1 * dA) * step) - expm(joint.A * step)
    found, _ = hold_direction(joint.A, joint.effort[:, None], -0.1 * dA, -0.1 * dB[:, None], step)
    euler = -0.1 * dA * step
    assert np.linalg.norm(found - exact) < 0.005 * np.linalg.norm(exact)
    assert np.linalg.norm(euler - exact) > 0.05 * np.linalg.norm(exact)


def test_scaling_everything_together_leaves_the_groups() -> None:
    both = Plant(800.0, 0.0022, 260.6, 260000.0, 0.8, 1.2)
    assert groups(both) == pytest.approx(groups(PLANT))
    assert pytest.approx(matrices(PLANT).A) == matrices(both).A
