"""Process noise: the torque that innovations ask for beside the model, and what is known to be there."""

from collections.abc import Sequence

import numpy as np

from gsfdi.reconcile.bench import Bench, drive_gain
from gsfdi.reconcile.sensing import effort_noise
from gsfdi.types import Array

TRIFLE = 2e-4
"""Share of the drive's torque that no simulator gets right: sampling, holding, and how a contact is written."""


def process_noise(stand: Bench, innovations: Sequence[Array], floor: Array, near: Array | None = None) -> Array:
    """Torque noise [N m] under which `innovations` are most likely, and no less than `floor`.

    Parameters
    ----------
    stand : Bench
        The recordings on their bench.
    innovations : sequence of (n, 2) arrays
        Of the model in hand, by record, under the base gain.
    floor : (k,) array
        What is known to be there: noise of the recorded effort.
    near : (k,) array, optional
        Where to look, each side by itself; without it, both sides alike and over all sizes.
    """

    def best(trials: Sequence[Array]) -> Array:
        return min((surprise(stand, innovations, trial), tuple(trial)) for trial in trials)[1]  # type: ignore[return-value]

    if near is None:
        size = np.array(best([np.maximum(floor, stand.scales.torque * f) for f in 10.0 ** np.arange(-4, 0.6, 0.5)]))
        return np.array(best([np.maximum(floor, size * f) for f in 10.0 ** np.arange(-0.25, 0.3, 0.25)]))
    size = np.maximum(near, floor)
    for side in range(len(floor)):
        moved = np.eye(len(floor))[side]
        size = np.array(best([np.maximum(floor, size * f**moved) for f in 10.0 ** np.arange(-1, 1.1, 0.25)]))
    return size


def surprise(stand: Bench, innovations: Sequence[Array], torque: Array) -> float:
    """Negative log-likelihood, up to a constant, of innovations under process noise of `torque` [N m]."""
    tools = stand.whiteners(torque)
    white = stand.white([e[None] for e in innovations], tools)[0]
    fade = np.concatenate([stand.awake(i)[:: len(stand.system.rows)] for i in range(len(tools))])
    return 0.5 * float(white @ white + np.concatenate([w.logdet for w in tools]) @ fade)


def effort_floor(stand: Bench) -> Array:
    """Torque noise [N m] that the noise of the recorded effort makes, by side; a trifle where none is stated."""
    model = stand.model
    noise = drive_gain(model, stand.records[0].effort) * effort_noise(model)
    trifle = TRIFLE * stand.scales.torque
    return np.array([max(noise, trifle), trifle][: len(stand.spread)])
