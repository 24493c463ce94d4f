"""Subspace identification without the Hankel matrix: models from lagged products, and what of them can be compared.

References
----------
Verhaegen 1994 (PO-MOESP); Chiuso 2007 (PBSIDopt); Björck & Golub 1973 and Knyazev & Argentati 2002 (angles).
"""

from gsfdi.subspace.compare import angles, markov, observability
from gsfdi.subspace.gram import excitation, factor, hankel_factor, lagged_gram
from gsfdi.subspace.identify import StateSpace, moesp, pbsid

__all__ = [
    "StateSpace",
    "angles",
    "excitation",
    "factor",
    "hankel_factor",
    "lagged_gram",
    "markov",
    "moesp",
    "observability",
    "pbsid",
]
