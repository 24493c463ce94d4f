"""A motion that hardly accelerates, as its torque balance sees it: what resists it, row by row."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import savgol_filter

from gsfdi.model import JointModel
from gsfdi.reconcile.bench import Bench, drive_gain
from gsfdi.reconcile.remainder import missing_torque
from gsfdi.types import Array, Mask

WIDE = (0.3, 0.15, 0.075)
"""Times [s] over which a polynomial may be a motion: the longer, the less noise, the shorter, the more of its jolts."""
DEGREE = 4
BACK = np.pi / 100  # [rad] of the motor by which it must fall back to have turned round, at least
NOISE = 6.0  # standard deviations of the position's noise that are no turning, either
ORDERS = 100
PER_WAVE = 4.0
"""Rows in the shortest wave that is looked for, at working speed."""
ROWS = 20_000
"""Rows that a regression needs at most."""
MEMORY = 8
"""Rows over which what remains may hang together."""


@dataclass(frozen=True, slots=True)
class Crawl:
    """One stretch of a slow motion.

    Parameters
    ----------
    turn, angle : (n,) arrays
        Of the motor and of the joint [rad].
    way, pace : (n,) arrays
        Where the motion is going, +1 or -1, whatever it falls back by little; and its speed [rad/s] so, without what
        waves over a turn of the motor make of it.
    drive : (n,) array
        Torque of the drive [N m], likewise without what waves make of it.
    torque : (n,) array
        What the drive does against all that the model does not know of [N m].
    inertial : (n,) array
        What goes into inertia [N m].
    used : (n,) mask
        What may be told from: not the first moments, nor what is kept for judging.
    """

    turn: Array
    angle: Array
    way: Array
    pace: Array
    drive: Array
    torque: Array
    inertial: Array
    used: Mask


@dataclass(frozen=True, slots=True)
class Rows:
    """Motions in rows of `width` moments, just fine enough for waves of up to `top` over a turn of the motor."""

    crawls: tuple[Crawl, ...]
    width: int
    top: int

    def of(self, law: Callable[[Crawl], Array]) -> Array:
        """Give means over every row of what is known moment by moment; what fills none is left out."""
        means = []
        for crawl in self.crawls:
            values = np.asarray(law(crawl), dtype=np.float64)
            whole = len(values) // self.width
            means.append(values[: whole * self.width].reshape(whole, self.width, *values.shape[1:]).mean(axis=1))
        return np.concatenate(means)

    @property
    def told(self) -> Mask:
        """Rows from which something may be told."""
        return np.asarray(self.of(lambda crawl: np.where(crawl.used, 1.0, 0.0)) == 1.0)

    @property
    def settled(self) -> Mask:
        """Rows of which that also holds of all that came within `MEMORY`, none of it of another stretch."""
        found = []
        for crawl in self.crawls:
            told = Rows((crawl,), self.width, self.top).told
            lost = np.concatenate([[0], np.cumsum(~told)])
            rows = np.arange(len(told))
            found.append((rows >= MEMORY) & (lost[rows + 1] == lost[np.maximum(rows - MEMORY, 0)]))
        return np.concatenate(found)


def rows_of(stand: Bench, model: JointModel, wide: float) -> Rows:
    """Lay out the torque balance of all that is on a bench, that of a rigid joint, with rates over so long [s]."""
    motions = tuple(crawls(stand, model, wide))
    step = stand.scales.speed * model.plant.gear_ratio * stand.scales.period / (2 * np.pi)  # turns within a moment
    count = sum(len(crawl.turn) for crawl in motions)
    width = max(1, int(1.0 / (PER_WAVE * ORDERS * step)), -(-count // ROWS))
    return Rows(motions, width, min(ORDERS, int(1.0 / (PER_WAVE * step * width))))


def crawls(stand: Bench, model: JointModel, wide: float) -> list[Crawl]:
    """Lay out the torque balance stretch by stretch, moment by moment: midway, as an effort acts until the next."""
    plant, period, found = model.plant, stand.scales.period, []
    total = plant.output_inertia + plant.gear_ratio**2 * plant.motor_inertia
    whole = max(1, round(2 * np.pi / (plant.gear_ratio * stand.scales.speed * period)))
    least = max(BACK / plant.gear_ratio, NOISE * stand.scales.noise)
    for i, (record, known) in enumerate(zip(stand.records, known_torque(stand, model), strict=True)):
        good, driven = np.isfinite(record["position"]), np.isfinite(record[record.effort])
        midway, width = record.t + 0.5 * period, round(wide / period)
        angle, speed, acceleration = motion(record.t[good], record["position"][good], midway, period, width)
        turn, way = min(whole, len(angle)), ways(angle, least)
        drive = drive_gain(model, record.effort) * np.interp(record.t, record.t[driven], record[record.effort][driven])
        found.append(
            Crawl(
                turn=plant.gear_ratio * angle,
                angle=angle,
                way=way,
                pace=way * averaged(np.abs(speed), turn),
                drive=averaged(drive, turn),
                torque=drive - total * acceleration - plant.damping * speed - known,
                inertial=total * acceleration,
                used=(stand.awake(i)[:: len(stand.system.rows)] > 0) & good & driven,
            )
        )
    return found


def known_torque(stand: Bench, model: JointModel) -> list[Array]:
    """Torque with which the model's own terms resist, by stretch [N m].

    Between two replays beside one recording the sensors' noise is the same.
    """
    if not model.physics:
        return [np.zeros(len(record.t)) for record in stand.records]
    both = stand.innovations([replace(model, physics=()), model])
    bare, whole = (missing_torque(stand, [pair[k] for pair in both]) for k in range(2))
    return [with_them - without for with_them, without in zip(whole, bare, strict=True)]


def motion(t: Array, angle: Array, at: Array, period: float, width: int) -> tuple[Array, Array, Array]:
    """Give angle, speed and acceleration at other times than those measured, of one local polynomial over `width`."""
    even = np.arange(t[0], t[-1] + period, period)
    odd = min(max(DEGREE + 1, width), len(even) - 2) // 2 * 2 + 1
    seen = np.interp(even, t, angle)
    smooth = (savgol_filter(seen, odd, DEGREE, deriv=order, delta=period) for order in range(3))
    known, speed, acceleration = (np.interp(at, even, values) for values in smooth)
    return known, speed, acceleration


def averaged(values: Array, width: int) -> Array:
    """Give moving averages over `width` rows; at the ends values are held."""
    ends = (width // 2, width - 1 - width // 2)
    return np.convolve(np.pad(values, ends, mode="edge"), np.ones(width) / width, mode="valid")


def ways(angle: Array, least: float) -> Array:
    """Tell which way a motion goes, +1 or -1: it has turned where it comes back from its furthest by `least`."""
    found, way, furthest, since = np.zeros(len(angle)), 0, float(angle[0]), 0
    for row, here in enumerate(angle.tolist()):
        if way != 0 and (here - furthest) * way >= 0:
            furthest, since = here, row
        elif abs(here - furthest) > least:
            way = 1 if here > furthest else -1
            found[since:row] = way
            furthest, since = here, row
        found[row] = way
    return found
