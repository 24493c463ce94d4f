"""The linear joint: matrices, discretisation, what can be identified, and the direction of a fault.

States are ``[Ω, Ω̇, ε, ε̇]``: motor angle reflected to the output side, its rate, the gearbox wind-up and its rate; the
joint angle is ``θ = Ω + ε``. A rigid joint keeps the first two. With ``Jm = N² Im`` and ``Jo = Ison``::

    Jm Ω̈ = N Kt i + c ε - τ_motor           Jo θ̈ + β θ̇ + c ε + τ_output = 0

The paper prints four of its formulas wrongly; :data:`MISPRINTS` says how each is used here and why, and
``tests/test_joint.py`` shows that the printed form fails.

References
----------
NLR, "A concept for a predictive maintenance facility for a space robot", eqs. 2-1 to 2-5, 5-1, 5-2.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm, expm_frechet

from gsfdi.model import Plant
from gsfdi.types import Array


class Misprint(NamedTuple):
    """A formula of the paper that cannot be used as printed."""

    where: str
    printed: str
    used: str
    why: str


MISPRINTS = (
    Misprint(
        "eq. 5-1, A[2,3] and A[4,3]",
        "c/N² Im, a product",
        "c/(N² Im)",
        "the motor inertia divides: the product form puts the free mode at 2.87 Hz instead of 7.23 Hz",
    ),
    Misprint(
        "eq. 5-1, A[4,4]",
        "1",
        "-β/Ison (and -β/Ison in A[4,2])",
        "a positive rate feedback gives poles at 0.5 ± 45j: the joint would explode without any input",
    ),
    Misprint(
        "eqs. 2-3, 2-5",
        "V(Y) - T U: the kernel multiplies the outputs only",
        "r = V (Y - T U)",
        "with the printed brackets the dimensions differ and the input's effect is never removed",
    ),
    Misprint(
        "eqs. 2-1, 2-4",
        "y = C x, no measurement noise; w from the smallest eigenvalue of (noise, fault)",
        "y = C x + v; w from the largest eigenvalue of (fault, noise), sorted",
        "without v there is nothing to minimise; the fault Gram is singular beyond two past samples, so the printed "
        "pencil has infinite eigenvalues and an arbitrary w",
    ),
    Misprint(
        "section 2, 'kernel of the observability matrix'",
        "V = ker Γ",
        "V = left null space of Γ",
        "V must satisfy V Γ = 0; Γ has full column rank, so its kernel is empty",
    ),
)


class LinearJoint(NamedTuple):
    """Continuous-time matrices of a joint.

    ``A (n, n)``, ``effort (n,)`` the column of the drive's effort, ``motor``, ``output`` and ``spring`` the columns of
    a torque that resists on either side or adds to the gearbox spring, ``C (2, n)`` to joint angle and motor speed.
    """

    A: Array
    effort: Array
    motor: Array
    output: Array
    spring: Array
    C: Array


def matrices(plant: Plant) -> LinearJoint:
    """Write the joint's equations as matrices.

    Parameters
    ----------
    plant : Plant
        A rigid plant is one whose stiffness is infinite.

    Examples
    --------
    >>> A = matrices(Plant(400.0, 0.0011, 260.6, 130000.0, 0.4, 0.6)).A
    >>> round(float(np.abs(np.linalg.eigvals(A).imag).max() / 2 / np.pi), 2)
    7.23
    """
    ratio, output = plant.gear_ratio, plant.output_inertia
    motor = ratio**2 * plant.motor_inertia
    drive = ratio * plant.torque_constant
    if not np.isfinite(plant.stiffness):
        total = motor + output
        push = np.array([0.0, 1.0 / total])
        A = np.array([[0.0, 1.0], [0.0, -plant.damping / total]])
        return LinearJoint(A, drive * push, -push, -push, 0.0 * push, np.array([[1.0, 0.0], [0.0, ratio]]))
    c, beta = plant.stiffness, plant.damping
    A = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, c / motor, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, -beta / output, -(c / motor + c / output), -beta / output],
        ]
    )
    push = np.array([0.0, 1.0 / motor, 0.0, -1.0 / motor])
    load = np.array([0.0, 0.0, 0.0, -1.0 / output])
    C = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, ratio, 0.0, 0.0]])
    return LinearJoint(A, drive * push, -push, load, push + load, C)


class Groups(NamedTuple):
    """What input and output can tell of a flexible joint: scaling Kt, c, Im and Ison together changes none of these."""

    drive: float
    motor_spring: float
    output_spring: float
    damping: float


def groups(plant: Plant) -> Groups:
    """Identifiable groups ``Kt/(N Im)``, ``c/(N² Im)``, ``c/Ison`` and ``β/Ison``."""
    motor = plant.gear_ratio * plant.motor_inertia
    return Groups(
        plant.torque_constant / motor,
        plant.stiffness / (plant.gear_ratio * motor),
        plant.stiffness / plant.output_inertia,
        plant.damping / plant.output_inertia,
    )


def hold(A: Array, B: Array, step: float) -> tuple[Array, Array]:
    """Discretise ``ẋ = A x + B u`` with the input held over each step.

    Parameters
    ----------
    A : (n, n) array
    B : (n, m) array
    step : float
        Sampling period [s].

    Returns
    -------
    (n, n) array, (n, m) array
        ``e^{A step}`` and the integral of ``e^{A s} B`` over a step.
    """
    n, m = B.shape
    whole = np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = A * step, B * step
    power = expm(whole)
    return power[:n, :n], power[:n, n:]


def ramp_hold(A: Array, B: Array, step: float) -> tuple[Array, Array, Array]:
    """Discretise with the input linear between samples: ``x⁺ = Ad x + B0 u_k + B1 u_{k+1}``."""
    n, m = B.shape
    whole = np.zeros((n + 2 * m, n + 2 * m))
    whole[:n, :n], whole[:n, n : n + m] = A * step, B * step
    whole[n : n + m, n + m :] = np.eye(m)
    power = expm(whole)
    late = power[:n, n + m :]
    return power[:n, :n], power[:n, n : n + m] - late, late


def hold_direction(A: Array, B: Array, dA: Array, dB: Array, step: float) -> tuple[Array, Array]:
    """First-order change of :func:`hold` when A and B change by `dA` and `dB` (Fréchet derivative of the exponential).

    The paper holds that a component failure "cannot be written" in discrete time since A and ΔA mix in the exponential.
    The difference ``(e^{(A+ΔA)Δt} - e^{AΔt}) x`` is exact, and this is its direction.
    """
    n, m = B.shape
    whole, change = np.zeros((n + m, n + m)), np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = A * step, B * step
    change[:n, :n], change[:n, n:] = dA * step, dB * step
    turned: Array = np.asarray(expm_frechet(whole, change, compute_expm=False), dtype=np.float64)
    return turned[:n, :n], turned[:n, n:]


def relative_directions(plant: Plant) -> dict[str, tuple[Array, Array]]:
    """Change of A and of the effort's column for a relative change of one physical parameter.

    Keys are the contract's fault ids; a value of +1 is +100 %. Written from the equations, not by differences.
    """
    joint = matrices(plant)
    n = len(joint.effort)
    none = np.zeros((n, n))
    found = {"torque_constant_change": (none, joint.effort.copy())}
    total = plant.output_inertia + plant.gear_ratio**2 * plant.motor_inertia
    if n == 2:
        for fault, inertia in (
            ("output_inertia_change", plant.output_inertia),
            ("motor_inertia_change", plant.gear_ratio**2 * plant.motor_inertia),
        ):
            if inertia > 0:
                found[fault] = (-joint.A * [[0.0], [1.0]] * inertia / total, -joint.effort * inertia / total)
        return found
    motor_part, output_part = none.copy(), none.copy()
    motor_part[:, 2] = joint.motor * -plant.stiffness  # what divides by the motor's inertia
    output_part[3] = joint.A[3] - motor_part[3]
    found["motor_inertia_change"] = (-motor_part, -joint.effort)
    found["output_inertia_change"] = (-output_part, np.zeros(n))
    spring = none.copy()
    spring[:, 2] = joint.spring * plant.stiffness
    found["stiffness_change"] = (spring, np.zeros(n))
    return found
