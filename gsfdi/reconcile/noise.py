"""Process noise: the torque that innovations ask for beside the model, and what is known to be there."""

from collections.abc import Callable, Sequence

import numpy as np

from gsfdi.reconcile.bench import Bench, drive_gain
from gsfdi.reconcile.sensing import effort_noise
from gsfdi.types import Array

PASSES = 6
"""Times that the noise of one side is looked for beside that of the other: a pass costs no replay, a turn many."""
TRIFLE = 2e-4
"""Share of the drive's torque that no simulator gets right: sampling, holding, and how a contact is written."""


def power_of_means(stretches: Sequence[Array], length: int) -> tuple[float, int]:
    """Power of means over so many samples over that of white noise, and how many means there are.

    Parameters
    ----------
    stretches : sequence of Array
        Values ``(n,)`` of each.
    length : int
        Samples of a mean; those beyond the last whole one count for the power of the values only.
    """
    means = np.concatenate([s[: len(s) // length * length].reshape(-1, length).mean(axis=1) for s in stretches])
    white = float(np.mean(np.concatenate(stretches) ** 2)) / length
    return float(np.mean(means**2)) / max(white, 1e-300) if len(means) else 1.0, len(means)


def process_noise(stand: Bench, innovations: Sequence[Array], floor: Array) -> Array:
    """Torque noise [N m], both sides alike, under which `innovations` are most likely, and no less than `floor`.

    Parameters
    ----------
    stand : Bench
        The recordings on their bench.
    innovations : sequence of (n, 2) arrays
        Of the model in hand, by record, under the base gain.
    floor : (k,) array
        What is known to be there: noise of the recorded effort.
    """

    def at(trial: Array) -> float:
        return surprise(stand, innovations, np.maximum(floor, trial))

    size = min((stand.scales.torque * f * np.ones(len(floor)) for f in 10.0 ** np.arange(-4, 0.6, 0.5)), key=at)
    size = min((size * f for f in 10.0 ** np.arange(-0.25, 0.3, 0.25)), key=at)
    return np.asarray(np.maximum(floor, size))


def by_side(stand: Bench, innovations: Sequence[Array], floor: Array, near: Array) -> Array:
    """Torque noise [N m] of each side by itself, looked for from `near` on; for the rest see `process_noise`."""
    known = dict[tuple[float, ...], float]()

    def at(trial: Array) -> float:
        where = tuple(np.maximum(floor, trial))
        if where not in known:
            known[where] = surprise(stand, innovations, np.array(where))
        return known[where]

    size = np.maximum(near, floor)
    for _ in range(PASSES):
        before = size
        for side in range(len(floor)):
            size = np.maximum(floor, downhill(at, size, 10.0 ** (0.25 * np.eye(len(floor))[side])))
        if np.array_equal(size, before):
            break
    return np.asarray(size)


def downhill(cost: Callable[[Array], float], size: Array, factor: Array, most: int = 4) -> Array:
    """Multiply or divide `size` by `factor`, `most` times at most, for as long as that lowers its cost."""
    best, here = size, cost(size)
    for step in (factor, 1.0 / factor):
        for _ in range(most):
            there = cost(best * step)
            if not there < here:
                break
            best, here = best * step, there
        if best is not size:  # what lay the other way is behind
            break
    return best


def surprise(stand: Bench, innovations: Sequence[Array], torque: Array) -> float:
    """Negative log-likelihood, up to a constant, of innovations under process noise of `torque` [N m]."""
    tools = stand.whiteners(torque)
    white = stand.white([e[None] for e in innovations], tools)[0]
    fade = np.concatenate([stand.awake(i)[:: len(stand.system.rows)] for i in range(len(tools))])
    return 0.5 * float(white @ white + np.concatenate([w.logdet[w.place] for w in tools]) @ fade)


def effort_floor(stand: Bench) -> Array:
    """Torque noise [N m] that the noise of the recorded effort makes, by side; a trifle where none is stated."""
    model = stand.model
    noise = drive_gain(model, stand.records[0].effort) * effort_noise(model)
    trifle = TRIFLE * stand.scales.torque
    return np.array([max(noise, trifle), trifle][: len(stand.spread)])
