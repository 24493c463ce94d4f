"""What chance alone would gain: an offer on the user's own motion when nothing is left out.

Innovations of the best model are cut into blocks of time whose signs might as well be the other way round. That keeps
the noise as it is on this recording, correlation and bursts included, and breaks every tie with the offers. Under
flipped signs an offer's score against the innovations is a sum of many signed pieces, so nearly normal, and its gain a
multiple of a chi-squared variable: the multiple is 1 for white innovations, and large for an offer whose signature lies
in the few blocks where the innovations are large. Each offer has its own null in this way, so that one which cannot be
told from noise does not raise the bar for those that can.
"""

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from gsfdi.types import Array

Ints = npt.NDArray[np.int64]


def inflations(bare: Array, information: Array, residual: Array, blocks: Ints) -> Array:
    """How many times more than with white innovations each signature gains by chance, at least 1; ``(m,)``.

    Parameters
    ----------
    bare : (m, n) array
        Signatures, less what the model in hand could take over.
    information : (m,) array
        Their sums of squares.
    residual : (n,) array
        White innovations of the best model.
    blocks : (n,) int array
        Block of time of every innovation, not decreasing.
    """
    first = np.flatnonzero(np.diff(blocks, prepend=-1))
    pieces = np.add.reduceat(bare * residual, first, axis=1)
    known = information > 1e-9 * max(float(information.max(initial=0.0)), 1e-300)
    return np.where(known, np.maximum(np.sum(pieces**2, axis=1) / np.where(known, information, 1.0), 1.0), 1.0)


def bar(inflation: float, trials: int, chance: float) -> float:
    """Gain in log-likelihood that the luckiest of `trials` offers beats with probability `chance`.

    Examples
    --------
    >>> round(bar(1.0, 1, 0.05), 2)
    1.92
    """
    return float(0.5 * inflation * chi2.isf(chance / max(trials, 1), 1))


def by_chance(gain: float, inflation: float, trials: int) -> float:
    """Probability that the luckiest of `trials` offers gains as much by chance."""
    return float(min(1.0, trials * chi2.sf(2.0 * max(gain, 0.0) / inflation, 1)))
