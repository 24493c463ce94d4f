"""What chance alone would gain: the luckiest offer on the user's own motion when nothing is left out.

Innovations of the best model are cut into blocks of time whose signs are flipped at random. That keeps the noise as it
is on this recording, correlation and bursts included, and breaks every tie with the offers; the same regression then
gives the null distribution of the largest gain over all of them.
"""

import numpy as np
import numpy.typing as npt

from gsfdi.types import Array

Ints = npt.NDArray[np.int64]


def luckiest(bare: Array, information: Array, residual: Array, blocks: Ints, draws: int = 400, seed: int = 0) -> Array:
    """Sorted largest gains ``(draws,)`` in log-likelihood over all signatures, under flipped signs.

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
    draws, seed : int
        How often signs are flipped, and the seed of it.
    """
    known = information > 1e-9 * max(float(information.max(initial=0.0)), 1e-300)
    if not known.any():
        return np.zeros(draws)
    first = np.flatnonzero(np.diff(blocks, prepend=-1))
    pieces = np.add.reduceat(bare[known] * residual, first, axis=1)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (draws, len(first)))
    gains = 0.5 * np.square(signs @ pieces.T) / information[known]
    return np.sort(gains.max(axis=1))
