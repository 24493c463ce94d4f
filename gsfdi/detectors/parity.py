"""Parity residuals over the paper's three samples, and over a longer window with a running sum.

A finding reads: *the parity residual of 21 samples grew to 9.4 times its usual power from 10.5 s on.*

``r = wᵀ V (Y - T U)``: stacked outputs less what the inputs explain, seen through the left null space V of the
observability matrix, so that the unknown state drops out. With ``y = C x + v`` the noise of ``V(Y - T U)`` has
covariance N and a fault of the drive the Gram F; w is the eigenvector of the *largest* eigenvalue of (F, N). Three
samples weigh noise as much as the fault; twenty-one see far more, and their power is watched by a cumulative sum whose
limit follows from the wander of fault-free batches.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.optimize import nnls

from gsfdi.detectors import Binned, Detector, Numbers
from gsfdi.joint import hold, matrices
from gsfdi.nominal import Nominal, Watched, output_matrix
from gsfdi.types import Array, Finding

BIN = 0.25
WINDOWS = ("short", "long")


class Residual(NamedTuple):
    """A parity residual as two sliding sums: ``(s, p)`` weights on the outputs, ``(s, k)`` on the inputs."""

    outputs: Array
    inputs: Array


def stacked(A: Array, B: Array, C: Array, samples: int) -> tuple[Array, Array]:
    """Observability matrix Γ and the Toeplitz matrix T of the inputs over a window (eq. 2-2)."""
    powers = [np.eye(len(A))]
    for _ in range(samples - 1):
        powers.append(powers[-1] @ A)
    gamma = np.vstack([C @ power for power in powers])
    p, k = C.shape[0], B.shape[1]
    toeplitz = np.zeros((samples * p, samples * k))
    for row in range(samples):
        for column in range(row):
            toeplitz[row * p : (row + 1) * p, column * k : (column + 1) * k] = C @ powers[row - column - 1] @ B
    return gamma, toeplitz


def design(A: Array, B: Array, C: Array, noise: Array, unrest: float, samples: int) -> Residual:
    """Parity residual that weighs a fault of the drive most against the noise.

    Parameters
    ----------
    A, B, C : arrays
        Discrete model; the first column of B is the drive.
    noise : (p,) array
        Standard deviation of each output's noise.
    unrest : float
        Standard deviation of what disturbs the drive.
    samples : int
        Length of the window; it must exceed the order over the number of outputs.
    """
    gamma, toeplitz = stacked(A, B, C, samples)
    scale = np.tile(noise, samples)
    V = null_space((gamma / scale[:, None]).T).T / scale
    k = B.shape[1]
    fault = V @ toeplitz[:, ::k]
    N = unrest**2 * fault @ fault.T + (V * scale) @ (V * scale).T
    F = fault @ fault.T
    _, vectors = eigh(F, N)
    w = vectors[:, -1] @ V
    return Residual(w.reshape(samples, -1), -(w @ toeplitz).reshape(samples, k))


def run(residual: Residual, outputs: Array, inputs: Array) -> Array:
    """The residual at every sample from the window's length on."""
    return sliding(residual.outputs, outputs) + sliding(residual.inputs, inputs)


def sliding(weights: Array, values: Array) -> Array:
    """Sum of the weighted values over every window; most columns of torques hold nothing and cost nothing."""
    total = np.zeros(len(values) - len(weights) + 1)
    for column, weight in zip(values.T, weights.T, strict=True):
        if column.any():
            total += np.correlate(column, weight)
    return total


class _Tally:
    """Power and peak of both residuals by bin of time."""

    def __init__(self, nominal: Nominal, settings: Mapping[str, float]) -> None:
        joint = matrices(nominal.plant)
        B = np.column_stack([joint.effort, joint.motor, joint.output, joint.spring])
        Ad, Bd = hold(joint.A, B, nominal.step)
        C = output_matrix(nominal)
        least = -(-len(Ad) // len(C)) + 1
        lengths = (max(3, least), max(int(settings["window"]), least + 1))
        noise = np.array(nominal.noise[: len(C)])
        self.residuals = [design(Ad, Bd, C, noise, nominal.unrest, n) for n in lengths]
        self.bins = Binned(BIN)

    def add(self, watched: Watched) -> None:
        for name, residual in zip(WINDOWS, self.residuals, strict=True):
            length = len(residual.outputs)
            if len(watched.live) < 2 * length:
                continue
            inputs = np.column_stack([watched.acting, watched.torque])
            driven = sliding(residual.inputs, inputs)
            r = sliding(residual.outputs, watched.y) + driven
            clear = (
                np.convolve(watched.stretch.trusted & watched.moving_freely, np.ones(length), mode="valid")
                > length - 0.5
            )
            bins, first, count = self.bins.place(watched.stretch.t[length - 1 :])
            columns = [np.bincount(bins, some * clear, minlength=count) for some in (r**2, np.ones(len(r)), driven**2)]
            self.bins.add(name, np.column_stack(columns), first)

    def numbers(self) -> dict[str, Array]:
        sums = self.bins.sums
        return {**sums, "width": np.array([self.bins.width])} if sums else {}


def _expected(bins: Array, learnt: Array) -> Array:
    """Power that a fault-free joint would show in each bin, from the number of samples and how hard it was driven."""
    return np.asarray(learnt[0] * bins[:, 1] + learnt[1] * bins[:, 2])


def learn(gathered: Sequence[Numbers], settings: Mapping[str, float]) -> dict[str, Array]:
    """Usual power of each residual and its share of the drive's, how it wanders within batches, and between them."""
    learnt = {}
    for name in WINDOWS:
        batches = [one[name] for one in gathered if name in one]
        bins = np.concatenate(batches)
        bins = bins[bins[:, 1] > 0.5 * bins[:, 1].max()]
        steady, driven = _nonnegative(bins)
        model = np.array([steady, max(driven, settings["tolerance"] ** 2)])
        power = bins[:, 0] / np.maximum(_expected(bins, model), 1e-300)
        wander = float(np.var(power) * np.median(bins[:, 1]))  # per sample, were the bins independent
        many = power[: len(power) // 8 * 8].reshape(-1, 8).mean(axis=1)  # two seconds see the slow part of it too
        if len(many) > 4:
            wander = max(wander, float(np.var(many) * np.median(bins[:, 1]) * 8))
        ratios = [one[:, 0].sum() / max(float(_expected(one, model).sum()), 1e-300) for one in batches]
        learnt[name] = np.array([*model, wander, float(np.std(ratios)), float(np.max(power)), bins[:, 1].max()])
    return learnt


def _nonnegative(bins: Array) -> tuple[float, float]:
    """Power per sample and share of the drive's power, of which neither is below zero."""
    scale = np.maximum(bins[:, 1:].max(axis=0), 1e-300)
    expected = np.full(len(bins), bins[:, 0].mean())
    for _ in range(4):  # weights from what is expected: weights from what was seen would prefer quiet bins
        weight = 1.0 / np.maximum(expected, 1e-300)
        found = nnls(bins[:, 1:] / scale * weight[:, None], bins[:, 0] * weight)[0] / scale
        least = 1e-3 * float(np.median(bins[:, 0] / np.maximum(bins[:, 1], 1.0)))
        steady, driven = max(float(found[0]), least), float(found[1])
        expected = steady * bins[:, 1] + driven * bins[:, 2]
    return steady, driven


def _cumulative(power: Array, slack: Array) -> Array:
    total, sums = 0.0, np.zeros(len(power))
    for i, (value, less) in enumerate(zip(power, slack, strict=True)):
        total = max(0.0, total + value - less)
        sums[i] = total
    return sums


def look(numbers: Numbers, learnt: Numbers, rate: float, settings: Mapping[str, float]) -> Finding | None:
    """Watch the power of both residuals."""
    if "long" not in numbers:
        return None
    width = float(numbers["width"][0])
    watched = {}
    for name in WINDOWS:
        wander, between, top, full = learnt[name][2:]
        bins = numbers[name]
        # What fault-free batches reach in their worst quarter of a second is normal, however their motion differs.
        slack = settings["slack"] + 4.0 * between
        ratio = bins[:, 0] / np.maximum(_expected(bins, learnt[name]), 1e-300)
        excess = (np.minimum(ratio, settings["lone"] * max(top, 1.0)) - 1.0) * bins[:, 1]
        # The slack is each sample's own: most bins of a long batch, which is scored in part, hold no samples at all.
        sums = _cumulative(excess, slack * bins[:, 1])
        scale = max(float(wander), 2.0) / (2.0 * slack)
        # A lone bad sample fills a window, and so two bins at most, which are longer in a long batch.
        full = max(float(full), float(bins[:, 1].max()))
        limit = scale * np.log(2.0 * max(len(bins), 2) / rate) + 2.0 * settings["lone"] * max(top, 1.0) * full
        p = float(min(1.0, len(bins) * np.exp(-np.clip((sums.max() - limit) / scale, -50, 600)) * rate / len(bins)))
        watched[name] = (sums, limit, p)
    name = "short" if watched["short"][2] < watched["long"][2] else "long"
    sums, limit, p = watched[name]
    alarm = bool(sums.max() > limit)
    over = int(np.argmax(sums > limit)) if alarm else int(np.argmax(sums))
    began = over - int(np.argmax(sums[over::-1] <= 0.0)) if (sums[: over + 1] <= 0.0).any() else 0
    t = width * (np.arange(len(sums)) + 1.0)
    late = numbers[name][began:]
    times = float(late[:, 0].sum() / max(float(_expected(late, learnt[name]).sum()), 1e-300))
    t3 = width * (np.arange(len(watched["short"][0])) + 1.0)
    return Finding(
        "parity", "parity", "", alarm, min(1.0, 2.0 * p), float(sums.max()), float(limit), "summed excess power",
        f"the parity residual has {times:.3g} times its usual power", began * width if alarm else None,
        {"t": t, "residual": watched["long"][0], "threshold": float(watched["long"][1]), "t3": t3,
         "residual3": watched["short"][0], "threshold3": float(watched["short"][1]),
         "detected_s": float(t[over]) if alarm else None},
    )  # fmt: skip


DETECTOR = Detector(
    name="parity",
    method="parity",
    needs=(),
    settings={"window": 21.0, "slack": 0.3, "lone": 2.0, "tolerance": 3e-4},
    tally=_Tally,
    learn=learn,
    look=look,
    false_alarm_rate=0.2,
    source="NLR predictive maintenance concept, eqs. 2-1 to 2-5; Frank 1996; Page 1954 (cumulative sum)",
)
