"""An effort rid of what its own sensor adds from sample to sample, where nobody knows law or setpoint.

Under feedback a joint moves with its sensors' noise, and the recorded effort with that of its own as well. Driven by
it, a fault-free joint seems to answer too weakly, and fits blame the gearbox: of 46 such joints of the proof's world 10
were given a damping, an inertia or a delay; told so, two of the next 30. For within a few samples a setpoint hardly
bends, and what the effort does there is the loop's answer to the logged position and speed. Its gains can be read off
(to 2 % of the true ones), and what they do not account for is the effort's own noise.

Where that is more than its sensor's noise is said to be, a setpoint that jitters moves the effort as well. Nothing
tells one from the other but their sizes; so much is taken off as is noise on average. Driven by the recorded effort,
a joint with a viscous friction was given a motor's inertia of 1.6 times itself besides; one of 20 sound ones a
gearbox damping, of the same 20 none.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter

from gsfdi.drive import measured_velocity
from gsfdi.joint import matrices
from gsfdi.model import JointModel
from gsfdi.reconcile.sensing import effort_noise
from gsfdi.types import Array, JointRecord

WINDOWS = (25, 15, 9)
"""Samples over which a setpoint may hardly bend; the longer they are, the more of the noise is told."""
QUIET = 1.05
"""What the loop does not account for, over the effort's stated noise, up to which it is that noise."""
OUTLYING = 4.0
"""Spreads beyond which it is a corner of the setpoint."""
MOSTLY = 0.95
"""Share of the samples that must be no such corner."""
ANSWERED, HARDLY = 0.3, 0.1
"""Share of a quick effort that its sensors tell from which it answers their noise, and from which it does beside more
than its own: of an arm's that was quiet, 0.05."""
LEAST = 0.25
"""Share of what the loop does not account for that must be noise, if not all of it is."""


class Hushed(NamedTuple):
    """Records whose effort has lost its quick noise, and the model with the noise that is left."""

    records: list[JointRecord]
    model: JointModel


def hushed(records: Sequence[JointRecord], model: JointModel) -> Hushed | None:
    """Rid the recorded efforts of noise, over as long windows as possible; None where the loop does not tell it.

    Parameters
    ----------
    records : sequence of JointRecord
        With positions and speeds, evenly spaced.
    model : JointModel
    """
    seen = [np.column_stack([r["position"], measured_velocity(r, model), r[r.effort]]) for r in records]
    if not all(
        len(r.t) > 2 * WINDOWS[0] and np.isfinite(s).any(axis=0).all() for r, s in zip(records, seen, strict=True)
    ):
        return None
    whole = [np.column_stack([bridged(r.t, column) for column in s.T]) for r, s in zip(records, seen, strict=True)]
    told = {window: own_noise(whole, window) for window in WINDOWS}
    # where none is stated, noise is what is the same through windows of any length
    stated = effort_noise(model) or told[WINDOWS[-1]].size
    windows = WINDOWS if effort_noise(model) > 0 else WINDOWS[:-1]
    plain = [w for w in windows if told[w].share > MOSTLY]
    quiet = [w for w in plain if told[w].size < QUIET * stated]
    window = next((w for w in quiet or plain if told[w].answered > (ANSWERED if quiet else HARDLY)), None)
    if window is None:
        return None
    share = 1.0 if quiet else (effort_noise(model) / told[window].size) ** 2
    if share < LEAST:
        return None
    period = float(np.median(np.diff(records[0].t)))
    # at a mode that is slower than the window all noise is as it was
    rest = 1.0 - share * (1.0 - passed(window)) if spans_mode(window * period, model) else 1.0
    sensors = replace(model.sensors, effort_noise=stated * rest**0.5, effort_resolution=0.0)
    pairs = zip(records, told[window].parts, strict=True)
    return Hushed([without_noise(r, share * part) for r, part in pairs], replace(model, sensors=sensors))


class OwnNoise(NamedTuple):
    """Quick part of the effort's own noise, and how large that noise is.

    `share` of the samples show it; `answered` is the share of the quick effort's power that position and speed tell.
    """

    parts: list[Array]
    size: float
    share: float
    answered: float


def own_noise(whole: Sequence[Array], window: int) -> OwnNoise:
    """What is the effort's own of the quick parts of position, speed and effort ``(n, 3)``.

    Where the setpoint bends, the effort does so for another reason, and nothing is told.
    """
    quick = np.concatenate([part - savgol_filter(part, window, 3, axis=0) for part in whole])
    X, y = quick[:, :2], quick[:, 2]
    scale, kept = np.maximum(np.linalg.norm(X, axis=0), 1e-300), np.ones(len(y), dtype=np.bool_)
    for _ in range(4):
        left = y - X @ (np.linalg.lstsq(X[kept] / scale, y[kept], rcond=1e-9)[0] / scale)
        size = 1.4826 * float(np.median(np.abs(left)))
        kept = np.abs(left) < OUTLYING * size
    parts = np.split(np.where(kept, left, 0.0), np.cumsum([len(part) for part in whole])[:-1])
    answered = 1 - float(left[kept] @ left[kept]) / max(float(y[kept] @ y[kept]), 1e-300)
    return OwnNoise(parts, size / (1 - passed(window)) ** 0.5, float(kept.mean()), answered)


def passed(window: int) -> float:
    """Share of white noise's power that a cubic through `window` samples lets through."""
    return float(savgol_coeffs(window, 3)[window // 2])


def spans_mode(seconds: float, model: JointModel) -> bool:
    """Whether the joint's free mode takes no longer than that; a rigid joint has none."""
    fastest = float(np.abs(np.linalg.eigvals(matrices(model.plant).A)).max())
    return model.structure == "rigid" or seconds * fastest > 2 * np.pi


def without_noise(record: JointRecord, noise: Array) -> JointRecord:
    """Take the noise off the effort of a record."""
    return replace(record, channels={**record.channels, record.effort: record[record.effort] - noise}, valid={})


def bridged(t: Array, values: Array) -> Array:
    """Draw straight lines over the samples that are missing."""
    good = np.isfinite(values)
    return np.asarray(np.interp(t, t[good], values[good]))
