"""The part of the time that is kept for judging, chosen so that what acts there acts elsewhere, too."""

from collections.abc import Sequence

import numpy as np

from gsfdi.model import TermUse
from gsfdi.reconcile.bench import HOLD_OUT, Bench
from gsfdi.types import Array

WINDOWS = (HOLD_OUT, (0.52, 0.70), (0.34, 0.52), (0.16, 0.34))
"""Parts that may be kept: the first whose misfit is like the rest's, so that what acts there acts elsewhere, too."""
BESIDE = 0.05
"""Share of the time beside a part within which what sets in may in truth set in there."""
USUAL = 0.4
"""Share of the misfit up to which a part of 0.18 of the time is like the rest."""


def typical_window(stand: Bench, innovations: Sequence[Array]) -> tuple[float, float]:
    """Choose the part to keep for judging: the first that holds no more than its share of the misfit.

    Parameters
    ----------
    stand : Bench
        The part that it keeps so far comes first.
    innovations : sequence of (n, 2) arrays
        Of a model with its numbers fitted.
    """
    power, when = [], []
    for i, (e, record) in enumerate(zip(innovations, stand.records, strict=True)):
        rows = np.nan_to_num(e[:, list(stand.system.rows)])
        power.append(np.sum(rows**2 / stand.system.R, axis=1))
        when.append(record.t / stand.seconds(i))
    energy, t = np.concatenate(power), np.concatenate(when)
    whole = float(energy[t > 0.02].sum()) or 1.0
    windows = (stand.window, *WINDOWS)
    shares = [float(energy[(t >= low) & (t < high)].sum()) / whole for low, high in windows]
    return next((w for w, share in zip(windows, shares, strict=True) if share < USUAL), windows[int(np.argmin(shares))])


def dating_window(stand: Bench, uses: Sequence[TermUse]) -> tuple[float, float]:
    """Choose the part to keep where one of the `uses` seems to set in within it or beside it, and so cannot be dated.

    Another part, the first in which nothing seems to set in, is better kept then; if there is none, it stays.
    """
    begun = [use.onset / stand.scales.seconds for use in uses if use.onset is not None]

    def dates(window: tuple[float, float]) -> bool:
        return not any(window[0] - BESIDE < share < window[1] + BESIDE for share in begun)

    return next((window for window in (stand.window, *WINDOWS) if dates(window)), stand.window)
