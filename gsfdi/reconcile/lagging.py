"""How far a logged speed lags behind the positions, by kinematics alone: no law and no mechanics has a part in it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import savgol_filter

from gsfdi.drive import measured_velocity
from gsfdi.model import JointModel
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.course import CALM
from gsfdi.reconcile.screen import Entry
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.types import Array, JointRecord

LAG = "velocity_lag"
"""What no law has a part in, though laws show it: found again, and better, when terms compete."""
SPAN = 0.2
"""Time [s] over which way and speed are held against each other."""
SURE, NEAR = 4.0, 0.3
"""Spreads that a lag must be above none, and the share by which one told otherwise may differ from it."""
HINTED, PLAINLY = 2.0, 100.0
"""Spreads of one that the positions hint at, and log-likelihood by which it must then be the likeliest finding."""
ALIKE = 0.95
"""Share of the best finding's gain from which a lag that the positions leave open is as good."""


def with_positions(
    findings: Sequence[LawFinding], records: Sequence[JointRecord], model: JointModel
) -> list[LawFinding]:
    """Leave of a law's findings what the positions allow: a lag alone where they show it, none where they deny it.

    Where a joint's effort goes into its inertia, a law shows a speed that lags and a gain of the current alike.
    """
    others = [f for f in findings if f.term != LAG]
    if len(others) == len(findings):
        return others
    lag = next(f for f in findings if f.term == LAG)
    shown, spread = kinematic_lag(records, model)
    most = max((f.gain for f in others), default=0.0)
    lags, likely = shown > SURE * spread, lag.gain > ALIKE * most
    if abs(shown - lag.values["lag_s"]) > max(SURE * spread, NEAR * abs(shown)):
        # a gearbox that rings bends the way: it showed 6.0 of 7.8 ms and 1.1 of 3.3, of which the law was sure
        hinted = shown > HINTED * spread and lag.gain > most + PLAINLY
        return [lag] if hinted or (lags and likely) else others
    if lags:
        return [replace(lag, values={"lag_s": shown}) if spread < lag.spread else lag]
    return [lag] if likely else others


def beside_positions(entries: Sequence[Entry], stand: Bench) -> list[Entry]:
    """Lay out the lag that the positions show for sure, whatever regression says of it.

    A speed that lags bends the whole fit of parameters, from which regression no longer sees it: one of 1.2 samples
    that gained 11,800 had promised 800, less than twenty others.

    Parameters
    ----------
    entries : sequence of Entry
        What competes.
    stand : Bench

    Returns
    -------
    list of Entry
        None or one.
    """
    lags = [entry for entry in entries if entry.offer.term == LAG and entry.onset is None]
    if not lags:
        return []
    shown, spread = kinematic_lag(stand.records, stand.model)
    if not shown > SURE * spread:
        return []
    return [replace(lags[0], offer=replace(lags[0].offer, mix=lambda _: {"lag_s": shown}))]


def kinematic_lag(records: Sequence[JointRecord], model: JointModel) -> tuple[float, float]:
    """Estimate the lag of the logged speed behind the positions.

    The way between two instants is the integral of the speed. Of a speed that lags by T, that falls short by T times
    its own change; the rest is scale, bias, and what a spring winds up as the motor accelerates::

        Δq - ∫ v dt = T Δv + g Δq + b Δt + w Δa

    Parameters
    ----------
    records : sequence of JointRecord
        With a speed.
    model : JointModel

    Returns
    -------
    float
        The lag [s].
    float
        Its standard deviation [s]; infinite where nothing can be told.
    """
    rows, short, overlap = [], [], 1
    for record in records:
        speed = measured_velocity(record, model) / (model.plant.gear_ratio if model.structure == "flexible" else 1.0)
        good = np.isfinite(speed) & np.isfinite(record["position"])
        t, q, v = record.t[good], record["position"][good], speed[good]
        period = float(np.median(np.diff(t))) if len(t) > 1 else np.inf
        apart = max(2, round(SPAN / period))
        if len(t) < 10 * max(apart, CALM):
            continue
        calm = savgol_filter(v, CALM, 3)
        way = q - cumulative_trapezoid(v, t, initial=0)
        held = _over(t, apart) < 1.2 * apart * period
        columns = (calm, q, t, np.gradient(calm, t))
        rows.append(np.column_stack([_over(column, apart)[held] for column in columns]))
        short.append(_over(way, apart)[held])
        overlap = max(overlap, apart)
    if not rows:
        return 0.0, np.inf
    X, y = np.concatenate(rows), np.concatenate(short)
    size = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    inverse = np.linalg.pinv(X / size, rcond=1e-9)
    found = inverse @ y
    rest = y - X / size @ found
    spread = np.sqrt(overlap * np.mean(rest**2)) * np.linalg.norm(inverse[0])
    return float(found[0] / size[0]), float(spread / size[0])


def _over(values: Array, apart: int) -> Array:
    """Change of values over `apart` samples."""
    return np.asarray(values[apart:] - values[:-apart])
