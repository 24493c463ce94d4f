"""The effort as a loop's answer to what is logged, whatever gains, filters and delays its unknown law is made of.

A cascade that filters its speed, a computed torque, a delay of a tick: none is a PID law, all are linear in error,
speed and setpoint of now and of a little before. Where such an answer leaves nothing but white noise of the effort's
own size, it is what the drive was told, without its sensor's noise. It must be no longer than is needed: with all 26
parts it was uncertain by a weight of 4 % of that noise. And it must stand for the whole effort: with the noise taken
off its quick part only, or a doubt of that size left, a sound gearbox seemed to be damped, for under feedback an
observer that doubts the effort too much answers its own sensors' noise.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter

from gsfdi.model import JointModel
from gsfdi.reconcile.law import EXACT
from gsfdi.reconcile.noise import power_of_means
from gsfdi.reconcile.sensing import believed_noise, effort_noise
from gsfdi.reconcile.sheet import Sheet, hiss, unit_sheets
from gsfdi.types import Array, JointRecord

LAGS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Time constants of the filters of which a law's own are made up, in samples, unless one of some other will do."""
GRID, FINER = 13, 3
"""Time constants tried at once of one filter that does for all, and how often, nearer to the best each time."""
FADED = 80
"""Samples after which little is left of what a filter began with, which nobody knows."""
MAIN = 5
"""Parts that any law has: error, its integral and that of the speed's, speed and setpoint's rate."""
PLENTY = 20
"""Samples for every part that is needed, from which a law can be learnt."""
DOUBT = 4.0
"""Standard deviations by which an answer is doubted at every sample: its errors last as long as the motion does."""
FEW, WHITE, SURE = (16, 64), 1.2, 3.0
"""Samples over which what a learnt law leaves is averaged, and its power then over that of white noise, at most, and
standard deviations of that; of right laws it is between 0.93 and 1.07 over 16."""


class Answered(NamedTuple):
    """Records with the answer to what is logged for an effort, and what is left of its sensor's noise."""

    records: list[JointRecord]
    noise: float
    needed: int
    """Parts of which the answer is made."""


def answered(records: Sequence[JointRecord], model: JointModel) -> Answered | None:
    """Put the answer to what is logged in the place of the recorded effort; None where it is not all of that.

    Parameters
    ----------
    records : sequence of JointRecord
        With position and speed.
    model : JointModel
        With the noise of the effort's sensor, if that is stated.
    """
    laid_out = unit_sheets(records, model)
    if laid_out is None:
        return None
    _, sheets = laid_out
    tried = [unanswered(*all_laid_out(sheets, lags)) for lags in (LAGS, (likeliest_lag(sheets),))]
    left, needed = min(tried, key=lambda found: unlikelihood(*found))
    parts = np.split(left, np.cumsum([len(sheet.t) for sheet in sheets])[:-1])
    shown = [part[part != 0] for part in parts]  # 0 is where nothing was asked of the answer
    if (count := sum(map(len, shown))) < PLENTY * needed:
        return None
    noise = believed_noise(effort_noise(model), hiss(shown))
    if np.sqrt(float(left @ left) / count) > EXACT * noise or not is_white(shown):
        return None
    found = []
    for record, sheet, part in zip(records, sheets, parts, strict=True):
        own = np.interp(record.t, sheet.t, part)
        found.append(
            replace(record, channels={**record.channels, record.effort: record[record.effort] - own}, valid={})
        )
    return Answered(found, DOUBT * noise * (needed / count) ** 0.5, needed)


def is_closer(wide: Answered, plain: Sequence[JointRecord], recorded: Sequence[JointRecord]) -> bool:
    """Whether an answer is nearer to the recorded efforts than those of a plain law by more than its parts cost."""

    def energy(told: Sequence[JointRecord]) -> float:
        return sum(float(np.nansum((r[r.effort] - t[t.effort]) ** 2)) for r, t in zip(recorded, told, strict=True))

    count = sum(len(record.t) for record in recorded)
    return count * float(np.log(energy(plain) / energy(wide.records))) > wide.needed * float(np.log(count))


def likeliest_lag(sheets: Sequence[Sheet]) -> float:
    """Find the time constant, in samples, of the one filter that accounts for most.

    Five of fixed ones made up that of a speed but for some 1e-4 A, which were a mode of a sound harmonic drive.
    """

    def left(log: float) -> float:
        columns, asked = all_laid_out(sheets, (float(np.exp(log)),))
        return float(np.sum((asked - columns @ np.linalg.lstsq(columns, asked, rcond=1e-9)[0]) ** 2))

    best, step = 0.5 * float(np.log(LAGS[0] * LAGS[-1])), 2.0
    for _ in range(FINER):
        best = float(min((best + step * np.linspace(-1, 1, GRID)).tolist(), key=left))
        step *= 2 / (GRID - 1)
    return float(np.exp(best))


def unlikelihood(left: Array, needed: int) -> float:
    """Give half the Bayesian information criterion of what so many parts leave."""
    count = max(int(np.count_nonzero(left)), 1)
    return 0.5 * count * float(np.log(max(float(left @ left), 1e-300))) + 0.5 * needed * float(np.log(count))


def unanswered(columns: Array, asked: Array) -> tuple[Array, int]:
    """What no column ``(n, k)`` accounts for of an effort, and how many are needed: others go, but for the `MAIN`."""
    columns, kept = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300), np.arange(columns.shape[1])
    # all that a regression on any of them asks for is in this triangle
    triangle: Array = np.asarray(np.linalg.qr(np.column_stack([columns, asked]), mode="r"))
    while True:
        X, y = triangle[:, kept], triangle[:, -1]
        gains = np.linalg.lstsq(X, y, rcond=1e-9)[0]
        spread = np.diag(np.linalg.pinv(X.T @ X, rcond=1e-18, hermitian=True)) * np.sum((y - X @ gains) ** 2)
        worth = gains**2 * len(asked) / np.maximum(spread, 1e-200)
        least = MAIN + int(np.argmin(worth[MAIN:])) if len(kept) > MAIN else 0
        if least == 0 or worth[least] > np.log(len(asked)):
            return np.asarray(asked - columns[:, kept] @ gains), len(kept)
        kept = np.delete(kept, least)


def all_laid_out(sheets: Sequence[Sheet], lags: Sequence[float]) -> tuple[Array, Array]:
    """Lay out sheets one after another."""
    columns, asked = zip(*(_laid_out(sheet, lags) for sheet in sheets), strict=True)
    return np.concatenate(columns), np.concatenate(asked)


def _laid_out(sheet: Sheet, lags: Sequence[float]) -> tuple[Array, Array]:
    """Columns ``(n, k)`` that a law may answer to, and the effort less what was fed forward; 0 where nobody knows."""
    error, speed, rate = sheet.parts["proportional"], -sheet.braking, sheet.rate
    # a loop of speed sums up what it sees of that, with all its noise
    swept = cumulative_trapezoid(rate - speed, sheet.t, initial=0)
    parts = [error, sheet.parts["integral"], swept, speed, rate, np.gradient(rate, sheet.t)]
    for signal in (error, speed, rate):
        parts.append(np.concatenate([signal[:1], signal[:-1]]))
        for lag in lags:
            share = 1.0 / (1.0 + lag)
            parts.append(lfilter([share], [1.0, share - 1.0], signal - signal[0]))
    columns, asked, held = np.column_stack(parts), sheet.effort - sheet.parts["feedforward"], ~sheet.unheld
    held[:FADED] = False
    if not held.any():
        return np.zeros_like(columns), np.zeros_like(asked)
    # a law's integral begins with a constant of its own
    columns, asked = columns - columns[held].mean(axis=0), asked - asked[held].mean()
    return np.where(held[:, None], columns, 0.0), np.where(held, asked, 0.0)


def is_white(stretches: Sequence[Array]) -> bool:
    """Whether values average out over a few samples as white noise does."""
    averaged = (power_of_means(stretches, few) for few in FEW)
    return all(power <= WHITE + SURE * (2.0 / max(count, 1)) ** 0.5 for power, count in averaged)
