"""The discrete linear joint as the sensors see it, and the samples at which they do."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_discrete_are

from gsfdi.joint import hold, matrices
from gsfdi.model import JointModel, Plant
from gsfdi.types import Array

Ints = npt.NDArray[np.int64]
LONGEST = 8
"""Samples that may be missing in a row before the filter starts anew."""


class Observed(NamedTuple):
    """The discrete linear joint as the sensors see it.

    ``Ad (n, n)``; ``Bt (n, 2)`` torque on motor and output side, held over a step; ``C (p, n)``; ``R (p,)`` variances
    of the measured channels; ``rows`` which of position and motor velocity are measured.
    """

    Ad: Array
    Bt: Array
    C: Array
    R: Array
    rows: tuple[int, ...]
    common: Array
    """(n, p) what the noise of each channel tells of the drive's over the next step, in units of the state."""


def observed(model: JointModel, step: float, variances: tuple[float, float], shared: float = 0.0) -> Observed:
    """Discretise the linear part of `model` at `step` [s] for the channels whose variance is finite.

    Parameters
    ----------
    model : JointModel
        Its plant, with those of its terms that are linear.
    variances : tuple of float
        Variance of position [rad²] and of motor velocity [(rad/s)²]; infinite where the channel is missing.
    shared : float
        Covariance of the speed's noise with that of the drive's torque until the next sample [N m rad/s].
    """
    joint = matrices(linear_plant(model))
    A = joint.A.copy()
    for use in model.physics:
        if use.onset is None and use.term == "viscous_friction":
            side = joint.motor if use.side != "output" else joint.output
            rate = use.values["coefficient_nms_rad"] * side
            A[:, 1] += rate
            if use.side == "output" and len(A) == 4:
                A[:, 3] += rate
        elif use.onset is None and use.term == "gearbox_damping" and len(A) == 4:
            A[:, 3] += use.values["coefficient_nms_rad"] * joint.spring
    torques = -joint.motor[:, None] if len(A) == 2 else np.column_stack([-joint.motor, -joint.output])
    Ad, Bt = hold(A, torques, step)
    C = joint.C.copy()
    if len(A) == 2:
        C[1, 1] = 1.0  # a rigid joint's motor velocity is its joint velocity
    rows = tuple(i for i, variance in enumerate(variances) if np.isfinite(variance))
    C = np.ascontiguousarray(C[list(rows)])
    R = np.array([variances[i] for i in rows])
    common = np.zeros((len(Ad), len(rows)))
    if 1 in rows:
        common[:, rows.index(1)] = Bt[:, 0] * shared / R[rows.index(1)]
    return Observed(np.ascontiguousarray(Ad), np.ascontiguousarray(Bt), C, R, rows, common)


def linear_plant(model: JointModel) -> Plant:
    """Plant of `model` with its changes of parameters in it."""
    plant = model.plant
    for use in model.physics:
        name = use.term.removesuffix("_change")
        if use.onset is None and use.term.endswith("_change"):
            plant = replace(plant, **{name: getattr(plant, name) * use.values["ratio"]})
    return plant


def steady_gain(system: Observed, torque: Array) -> Array:
    """Gain ``(4, 2)`` of the steady Kalman filter with white torque noise of standard deviation `torque` [N m].

    States and channels are counted in units of their noise meanwhile, without which light joints have no solution.
    """
    Q = (system.Bt * np.square(torque)) @ system.Bt.T
    Q += 1e-12 * np.trace(Q) / len(Q) * np.eye(len(Q))
    x, y = np.sqrt(np.diag(Q)), np.sqrt(system.R)
    A, C, unit = system.Ad * x / x[:, None], system.C * x / y[:, None], np.outer(x, x)
    P = unit * solve_discrete_are(A.T, C.T, Q / unit, np.eye(len(y)))
    gain = P @ system.C.T @ np.linalg.inv(system.C @ P @ system.C.T + np.diag(system.R))
    whole = np.zeros((4, 2))
    whole[: len(gain), list(system.rows)] = gain
    return whole


def steps_of(t: Array, period: float, gap: int = LONGEST) -> Ints:
    """Sampling periods between samples, 0 at the first and after a gap of more than `gap` of them."""
    steps: Ints = np.maximum(1, np.round(np.diff(t, prepend=t[0]) / period)).astype(np.int64)
    steps[steps > gap] = 0
    steps[0] = 0
    return steps
