"""The part of the time that is kept for judging, chosen so that what acts there acts elsewhere, too."""

from collections.abc import Sequence

import numpy as np

from gsfdi.reconcile.bench import HOLD_OUT, Bench
from gsfdi.types import Array

WINDOWS = (HOLD_OUT, (0.52, 0.70), (0.34, 0.52), (0.16, 0.34))
"""Parts that may be kept: the first whose misfit is like the rest's, so that what acts there acts elsewhere, too."""
USUAL = 0.4
"""Share of the misfit up to which a part of 0.18 of the time is like the rest."""


def typical_window(stand: Bench, innovations: Sequence[Array]) -> tuple[float, float]:
    """Choose the part to keep for judging: the first that holds no more than its share of the misfit.

    Parameters
    ----------
    stand : Bench
    innovations : sequence of (n, 2) arrays
        Of the nominal model with its numbers fitted.
    """
    power, when = [], []
    for i, (e, record) in enumerate(zip(innovations, stand.records, strict=True)):
        rows = np.nan_to_num(e[:, list(stand.system.rows)])
        power.append(np.sum(rows**2 / stand.system.R, axis=1))
        when.append(record.t / stand.seconds(i))
    energy, t = np.concatenate(power), np.concatenate(when)
    whole = float(energy[t > 0.02].sum()) or 1.0
    shares = [float(energy[(t >= low) & (t < high)].sum()) / whole for low, high in WINDOWS]
    return next((w for w, share in zip(WINDOWS, shares, strict=True) if share < USUAL), WINDOWS[int(np.argmin(shares))])
