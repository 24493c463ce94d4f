"""The law held where no speed is logged, by instrumental variables.

The slope of noisy positions is a poor speed. Its noise fills the law's misfit, and since the parts of the law carry the
same noise, a regression on them finds every gain too weak. What the nominal model shows on the same setpoint carries
none of it: the parts computed from the simulation are instruments (T. Söderström, P. Stoica, "Instrumental Variable
Methods for System Identification", 1983). With the misfit made white, whose noise is blue, gains are known to a
fraction of a percent where the misfit itself is larger than the effort's noise by orders of magnitude.

Two things tell a wrong law from joints that move otherwise than the model says, which change the motor's unseen speed:
a wrong gain is the same in every stretch of time, and leaves nothing that the setpoint could account for.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter
from scipy.stats import chi2

from gsfdi.drive import drive_of
from gsfdi.model import JointModel
from gsfdi.reconcile.sensing import shown_speed
from gsfdi.reconcile.sheet import Held, LawFinding, Log, Sheet, columns_of, commanded, scaled
from gsfdi.simulate import replay
from gsfdi.types import Array, JointRecord

ORDER = 16
"""Lags of the filter that makes the misfit white."""
STRETCHES = 10
"""Stretches of time in which a finding must be the same."""
UNLIKE = float(chi2.ppf(0.95, STRETCHES - 1))
"""How unlike they may be by chance, once in twenty."""
WHOLE = 0.88
"""Share of everything that the setpoint accounts for that a finding must hold."""
BETWEEN = 0.03
"""Standard deviation, in ticks, of what reading between samples costs a delay."""
DELAYS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
"""Ticks by which measurements may be stamped late."""


@dataclass(frozen=True, slots=True)
class Blind:
    """Recordings without speed: with the motor's as far as the model knows it, and as the model itself shows them."""

    log: Log
    shown: Log


def blind(records: Sequence[JointRecord], model: JointModel) -> Blind | None:
    """Replay the nominal model beside `records`; None where it runs away."""
    beyond, shown = [], []
    for record in records:
        trace = replay(model, drive_of(record, model))
        speed = shown_speed(trace, model)
        if not (np.isfinite(trace.position) & np.isfinite(speed)).all():
            return None
        beyond.append(speed - np.gradient(trace.position, record.t))
        channels = {name: record[name] for name in record.channels}
        channels["position"] = np.where(np.isfinite(record["position"]), trace.position, np.nan)
        shown.append(replace(record, channels=channels, valid={}))
    return Blind(Log(records, model, beyond), Log(shown, model, beyond))


@dataclass(frozen=True, slots=True)
class _Trial:
    """A column that may account for the misfit, as recorded and as its instrument shows it, both white."""

    term: str
    seen: Array
    shown: Array
    felt: float
    """Root mean square of the instrument [effort's unit], as it is."""

    def size(self, misfit: Array) -> float:
        """Coefficient of the recorded column, from the instrument."""
        return float(self.shown @ misfit / (self.shown @ self.seen))


def instrumental(held: Held, model: Log, least: float) -> list[LawFinding]:
    """What may be wrong besides what was found: what alone holds all that the setpoint accounts for.

    `model` is the log that the nominal simulation shows. Nothing that moves the effort by less than `least` is given.
    """
    if max(map(len, held.off), default=0) <= 2 * ORDER:
        return []
    law, findings, shown = held.law, held.findings, model.sheets(held.law, held.late)
    white = _White(held.off, shown)
    misfit = white(held.off)
    trials = [
        _Trial(name, white(columns), white(instruments), float(np.concatenate(instruments).std()))
        for (name, columns), instruments in zip(
            columns_of(held.sheets, findings).items(), columns_of(shown, findings).values(), strict=True
        )
    ]
    taken = {f.term for f in findings}
    trials = [trial for trial in trials if trial.shown @ trial.shown > 0 and trial.term not in taken]
    if not trials or not misfit.any():  # a setpoint that moves nothing, or a law that holds to the last digit
        return []
    ages = {ticks: model.sheets(law, held.late + ticks / law.sample_rate) for ticks in DELAYS}
    delays = {ticks: white(_later(shown, aged, findings)) for ticks, aged in ages.items()}
    rest = [white(columns) for columns in _motions(shown)]
    basis = np.linalg.qr(_unit([*(t.shown for t in trials), *delays.values(), *rest]))[0]
    caught = float(np.sum((basis.T @ misfit) ** 2))
    power = max(float(misfit @ misfit) - caught, 1e-9 * caught) / len(misfit)
    whole = caught - basis.shape[1] * power  # every column catches some noise
    found = [_sized(t, misfit, power, whole) for t in trials if abs(t.size(misfit)) * t.felt > least]
    if not any("delay_s" in f.values for f in findings):
        found.append(_delayed(delays, misfit, power, whole, 1.0 / law.sample_rate))
    return [finding for finding in found if finding is not None]


def _sized(trial: _Trial, misfit: Array, power: float, whole: float) -> LawFinding | None:
    """Give a gain as a finding, if it is the same throughout and holds all that there is."""
    drop = float(trial.shown @ misfit) ** 2 / float(trial.shown @ trial.shown)
    spread = float(np.sqrt(power * (trial.shown @ trial.shown)) / abs(trial.shown @ trial.seen))
    slope = trial.size(misfit)
    if abs(slope) < 4 * spread or drop < WHOLE * whole or not _steady(trial.shown, trial.seen, misfit, slope, power):
        return None
    return scaled(trial.term, slope, 0.5 * drop / power, drop / whole, spread)


def _delayed(delays: dict[float, Array], misfit: Array, power: float, whole: float, period: float) -> LawFinding | None:
    """Give the delay under which the instrument lies nearest to the misfit."""
    drops = {ticks: float(2 * z @ misfit - z @ z) for ticks, z in delays.items()}
    near = max(drops, key=lambda ticks: drops[ticks])
    z = delays[near]
    share = float(z @ misfit / (z @ z)) if z @ z > 0 else 0.0
    drop = share * float(z @ misfit)
    if not 0.5 < share < 2.0 or drop < WHOLE * whole or not _steady(z, z, misfit, share, power):
        return None
    delay, spread = share * near * period, float(np.hypot(np.sqrt(power / (z @ z)) * near, BETWEEN)) * period
    return LawFinding("timestamp_latency", {"delay_s": delay}, None, 0.5 * drop / power, drop / whole, spread)


def _steady(shown: Array, seen: Array, misfit: Array, slope: float, power: float) -> bool:
    """Whether a coefficient is the same in every stretch of time."""
    unlike = 0.0
    for part in np.array_split(np.arange(len(misfit)), STRETCHES):
        z, rest = shown[part], misfit[part] - slope * seen[part]
        if z @ z > 0:
            unlike += float(z @ rest) ** 2 / (power * float(z @ z))
    return unlike < UNLIKE


def _later(shown: Sequence[Sheet], aged: Sequence[Sheet], findings: Sequence[LawFinding]) -> list[Array]:
    """What stamps do to the law's misfit that are as late as those of the `aged` sheets."""
    found = []
    for now, then in zip(shown, aged, strict=True):
        moved = commanded(then, findings) - commanded(now, findings)[: len(then.t)]
        found.append(np.concatenate([moved, np.zeros(len(now.t) - len(then.t))]))
    return found


def _motions(sheets: Sequence[Sheet]) -> list[list[Array]]:
    """Other functions of the motion, which account for what physics does to an unseen speed."""
    found: list[list[Array]] = [[] for _ in range(5)]
    for sheet in sheets:
        push = np.gradient(sheet.rate, sheet.t)
        jerk = np.gradient(push, sheet.t)
        parts = (np.sign(sheet.rate), push, np.sign(push), jerk, np.gradient(jerk, sheet.t))
        for columns, part in zip(found, parts, strict=True):
            columns.append(part)
    return found


class _White:
    """The filter that makes white what the law's parts do not account for."""

    def __init__(self, off: Sequence[Array], shown: Sequence[Sheet]) -> None:
        parts = ("proportional", "integral", "derivative")
        X = np.concatenate([np.column_stack([s.parts[p] - s.parts[p].mean() for p in parts]) for s in shown])
        X = X / np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-300)
        y = np.concatenate(off)
        left = y - X @ np.linalg.lstsq(X, y, rcond=1e-9)[0]
        stretches = [part for part in np.split(left, np.cumsum([len(o) for o in off])[:-1]) if len(part) > 2 * ORDER]
        lags = np.concatenate([np.lib.stride_tricks.sliding_window_view(s[:-1], ORDER)[:, ::-1] for s in stretches])
        now = np.concatenate([s[ORDER:] for s in stretches])
        self.taps: Array = np.concatenate([[1.0], -np.linalg.lstsq(lags, now, rcond=1e-12)[0]])

    def __call__(self, columns: Sequence[Array]) -> Array:
        found = [lfilter(self.taps, [1.0], c - c.mean())[ORDER:] for c in columns if len(c) > 2 * ORDER]
        return np.concatenate([f - f.mean() for f in found])


def _unit(columns: Sequence[Array]) -> Array:
    """Stack columns, each of length 1; those of nothing are left out."""
    sizes = [float(np.sqrt(c @ c)) for c in columns]
    return np.column_stack([c / size for c, size in zip(columns, sizes, strict=True) if size > 0])
