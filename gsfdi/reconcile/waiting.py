"""A limit of the current at which the integral waits, where the law told a speed that nobody logged.

A law that does not know the limit believes that the integral went on: from each time that the limit is met, the told
speed is too high for good, by what the integral would have grown. A bias that sets in does as much once, but it need
not do so when the effort is highest, nor by as much. The way that the told speed covers, less that of the motor, shows
it. Of sixteen simulated joints (60 s, limits of 90 to 99.8 % of the highest effort) six drift so, by nine tenths or
more of all that they drift by, and are named; the integral of the others hardly waits. From each time on the speed is
told anew: the samples at which the integral waited are not known well enough for its sum, and terms were named that
make up for one too many.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import nnls

from gsfdi.model import Controller
from gsfdi.reconcile.bench import WARM_UP
from gsfdi.reconcile.drifting import beside, drift_of, gained, position_of
from gsfdi.reconcile.gaps import stretches
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.law import MEDIAN
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.simulate import Trace
from gsfdi.types import Array, JointRecord
from gsfdi.whiten import LONGEST

Ints = npt.NDArray[np.int64]

HIGHEST, FEW = 0.995, 3
"""Share of the highest efforts, these few left out, from which others may lie at the same limit."""
APART = 1.0
"""Time [s] after which an effort that is as high again meets a limit again."""
PLAIN = 0.9
"""Share of what a told speed drifts by that the waits of a limit must explain."""
AS_MUCH = (0.5, 2.0)
"""How much of what the integral would have grown the told speed must be off by; noise decides what meets a limit."""


def suspect_limit(first: Round, shadows: Sequence[Trace]) -> LawFinding | None:
    """Find the limit, of which the waits explain how the told speed drifts from what `shadows` show without it."""
    stand, law = first.stand, first.fitted.model.controller
    if law is None or any(use.term in ("current_bias", "current_limit") for use in first.fitted.model.physics):
        return None
    effort = np.abs(np.concatenate([record[record.effort] for record in stand.records]))
    near = effort > HIGHEST * float(np.sort(effort)[-FEW])
    least = float(np.min(effort[near]))
    drifts = [_drift(record, shadow, law, least, first) for record, shadow in zip(stand.records, shadows, strict=True)]
    explained, energy, grown = np.sum(drifts, axis=0)
    if explained < PLAIN * energy or not AS_MUCH[0] * explained < grown < AS_MUCH[1] * explained:
        return None
    limit, share = float(np.median(effort[near])), float(explained / energy)
    spread = MEDIAN * float(np.std(effort[near])) / float(np.sqrt(near.sum()))
    return LawFinding("current_limit", {"limit_a": limit}, None, gained(share, len(effort)), share, spread)


def _drift(
    record: JointRecord, shadow: Trace, law: Controller, least: float, first: Round
) -> tuple[float, float, float]:
    """Energy of a drift that waits at efforts of `least` explain, all of it, and the first times how much they grow.

    While a limit is met the law tells nothing: the way that is covered then is free.
    """
    t, drift = drift_of(record, first)
    stays = stays_of(record, least)
    covered = [np.cumsum(np.isin(t, record.t[stay])) for stay in stays]
    free = np.linalg.qr(np.column_stack([np.ones(len(t)), t, *covered]))[0]
    drift = beside(free, drift + np.interp(t, record.t, shadow.windup))  # of the motor, not of the joint
    energy = float(drift @ drift)
    if not stays:
        return 0.0, energy, 0.0
    ways = beside(free, np.column_stack([np.interp(t, record.t, way_of(record, law, stay)) for stay in stays]))
    grown = nnls(ways, drift)[0]
    parts = grown * (ways.T @ drift)
    return float(parts.sum()), energy, float(parts @ grown)


def stays_of(record: JointRecord, least: float) -> list[Ints]:
    """Samples of each time that the effort reaches `least`."""
    met = np.flatnonzero(np.abs(record[record.effort]) >= least)
    return [stay for stay in np.split(met, np.flatnonzero(np.diff(record.t[met]) > APART) + 1) if len(stay)]


def between_stays(records: Sequence[JointRecord], limit: float, period: float) -> list[JointRecord]:
    """Records cut where they meet a limit: how long the integral waited is not known to a sample."""
    found = []
    for record in records:
        effort = record[record.effort].copy()
        for stay in stays_of(record, HIGHEST * limit):
            effort[max(0, stay[0] - LONGEST // 2) : stay[-1] + LONGEST // 2 + 2] = np.nan
        found += stretches(replace(record, channels={**record.channels, record.effort: effort}), period, 2 * WARM_UP)
    return found


def way_of(record: JointRecord, law: Controller, stay: Ints) -> Array:
    """Way that a told speed covers too much [rad] where the integral waited for these samples."""
    error = np.zeros(len(record.t))
    error[stay] = (record["setpoint"] - position_of(record))[stay]
    speed = law.integral / law.derivative * cumulative_trapezoid(error, record.t, initial=0)
    return np.asarray(cumulative_trapezoid(speed, record.t, initial=0))
