"""What a fault-free joint is taken to be: a linear model, the terms learnt beside it, and its noise.

`watch` runs the observer of this model over an even stretch; `score` asks of its innovations how much they look like
each direction of the fault library.
"""

from gsfdi.nominal.description import Nominal
from gsfdi.nominal.loudness import loudness, screen
from gsfdi.nominal.observing import filtered, observer, output_matrix
from gsfdi.nominal.scoring import entries, score
from gsfdi.nominal.watching import Watched, watch

__all__ = [
    "Nominal",
    "Watched",
    "entries",
    "filtered",
    "loudness",
    "observer",
    "output_matrix",
    "score",
    "screen",
    "watch",
]
