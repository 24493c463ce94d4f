"""A law of physics as a small plot of characters, against the quantity that it depends on."""

from typing import NamedTuple

import numpy as np

from gsfdi import motion
from gsfdi.motion import PhysicsTerm
from gsfdi.types import Array

WIDE, HIGH = 56, 9


class Axis(NamedTuple):
    """A quantity to plot against: its name, unit, places in the motion vector, and usual extent."""

    name: str
    unit: str
    places: tuple[int, ...]
    extent: float


MAPPED = {
    "windup": Axis("joint angle less motor angle", "rad", (motion.VALUE,), 1e-3),
    "position_sensor": Axis("joint angle", "rad", (motion.VALUE,), 0.1),
    "velocity_sensor": Axis("speed", "rad/s", (motion.VALUE,), 0.1),
    "current": Axis("current", "A", (motion.VALUE,), 10.0),
    "current_sensor": Axis("current", "A", (motion.VALUE,), 10.0),
}
"""What a map acts on, by its place."""
AXES = (
    Axis("speed", "rad/s", (motion.SPEED, motion.DIRECTION), 0.1),
    Axis("joint angle", "rad", (motion.ANGLE, motion.JOINT_ANGLE), 3.2),
    Axis("motor angle", "rad", (motion.MOTOR_TURN,), 6.3),
    Axis("wind-up", "rad", (motion.WINDUP,), 1e-3),
    Axis("wind-up rate", "rad/s", (motion.WINDUP_RATE,), 1e-2),
    Axis("load", "N m", (motion.LOAD,), 100.0),
    Axis("current", "A", (motion.CURRENT,), 10.0),
    Axis("temperature", "degC", (motion.TEMPERATURE,), 60.0),
    Axis("time", "s", (motion.TIME,), 60.0),
)


def sketch(term: PhysicsTerm) -> list[str]:
    """Plot a term's law at its usual parameters, against the first quantity that it depends on.

    Parameters
    ----------
    term : PhysicsTerm
        One of the shelf.

    Returns
    -------
    list of str
        Lines of the plot; none for a law that is a plain number.
    """
    p = np.array([param.start for param in term.params])
    mapped = MAPPED.get(term.place)
    for axis in (mapped, *AXES) if mapped else AXES:
        widths = [abs(param.start) for param in term.params if param.unit == axis.unit and param.start]
        extent = 4 * min(widths) if widths else axis.extent
        if term.wave:
            extent = min(extent, 8.0 / p[[param.name for param in term.params].index(term.wave)])
        there = np.linspace(-extent, extent, 8 * WIDE)
        x = np.concatenate([there, there[::-1], there])  # there and back: a law with memory shows its loop
        y = _law(term, p, axis, x)
        bends = y - x if axis is mapped else y
        if np.isfinite(y).all() and np.ptp(bends) > 1e-9 * (np.abs(y).max() + 1e-300):
            return _drawn(f"{axis.name} [{axis.unit}]", x[there.size :], y[there.size :])
    return []


def _law(term: PhysicsTerm, p: Array, axis: Axis, x: Array) -> Array:
    """The law along a path of one quantity, all others at rest."""
    m, s = np.zeros(motion.QUANTITIES), np.full(motion.STATES, np.nan)
    m[[motion.STIFFNESS, motion.GEAR, motion.LEVER, motion.STEP]] = 1.3e5, 160.0, 1 / 160.0, 1e-3
    m[motion.TEMPERATURE] = motion.REFERENCE_TEMPERATURE
    m[[motion.SPEED, motion.DIRECTION]] = 1e-3, 1.0
    y = np.empty(x.size)
    for i, value in enumerate(x):
        for place in axis.places:
            m[place] = np.sign(value) if place == motion.DIRECTION else value
        y[i] = term.law(m, p, s)
        if term.place == "dry":
            y[i] *= m[motion.DIRECTION]
    return y


def _drawn(label: str, x: Array, y: Array) -> list[str]:
    low, high = float(y.min()), float(y.max())
    rows = [[" "] * WIDE for _ in range(HIGH)]
    columns = np.round((x - x.min()) / np.ptp(x) * (WIDE - 1)).astype(int)
    heights = np.round((high - y) / (high - low) * (HIGH - 1)).astype(int)
    for column, height in zip(columns, heights, strict=True):
        rows[height][column] = "•"
    edge = max(len(f"{high:.3g}"), len(f"{low:.3g}"))
    margins = [f"{high:.3g}", *[""] * (HIGH - 2), f"{low:.3g}"]
    lines = [f"{margin:>{edge}} │{''.join(row).rstrip()}" for margin, row in zip(margins, rows, strict=True)]
    ends = f"{x.min():.3g}", label, f"{x.max():.3g}"
    return [
        *lines,
        f"{'':{edge}} └{'─' * WIDE}",
        f"{'':{edge}}  {ends[0]}{ends[1]:^{WIDE - len(ends[0]) - len(ends[2])}}{ends[2]}",
    ]
