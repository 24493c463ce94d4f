"""What could have been seen: the least of each term that this motion can tell from noise.

A signature of information ``I`` gains ``c² I / 2`` in log-likelihood when it is there ``c`` times. The least that could
be seen gains as much as a name costs. It is a bound from below: an effect that is somewhat larger may still pass for
process noise, by which it then is judged.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsfdi.model import Side, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.calibrate import bar
from gsfdi.reconcile.hand import Round, is_sensor, with_term
from gsfdi.reconcile.remainder import torque_between
from gsfdi.reconcile.screen import LEAST, Screening
from gsfdi.types import Array

FAR = 0.5
"""Change of a ratio beyond which its slope at 1 tells nothing any more."""


@dataclass(frozen=True, slots=True)
class Smallest:
    """The least of a term that could have been named: the value of its first number, the others as usual here."""

    term: str
    side: Side | None
    parameter: str
    value: float


def smallest(
    hand: Round, screening: Screening, shelf_terms: Mapping[str, PhysicsTerm], chance: float, material: float
) -> tuple[Smallest, ...]:
    """The least of every term that is proportional to its first number.

    Parameters
    ----------
    hand : Round
        The model in hand.
    screening : Screening
        Of a round that nothing won.
    shelf_terms : mapping of str to PhysicsTerm
    chance : float
        Probability that chance alone makes one of all offers a winner.
    material : float
        Share of the drive's torque below which a torque is not worth a name.
    """
    gain = max(LEAST, bar(1.0, len(screening.information), chance))
    uses: dict[tuple[str, Side | None], tuple[float, TermUse]] = {}
    for offer, rows in screening.offers:
        size, info = shelf_terms[offer.term].params[0], float(np.min(screening.information[rows]))
        if not size.linear or info <= 0:
            continue
        times: Array = np.zeros(rows.stop - rows.start)
        times[0] = np.sqrt(2 * gain / info)
        values = offer.mix(times) or offer.mix(-times)
        if values is None:
            continue
        off = abs(values[size.name] - (size.neutral or 0.0))
        if off < uses.get((offer.term, offer.side), (np.inf,))[0]:
            uses[offer.term, offer.side] = off, offer.use(values)
    found = [use for _, use in uses.values()]
    shares = torque_between(hand.stand, hand.fitted.model, *(with_term(hand.fitted.model, use) for use in found))
    least = [
        _worth(use, shelf_terms[use.term], 1.0 if is_sensor(use.term) else max(1.0, material / max(share, 1e-12)))
        for use, share in zip(found, shares, strict=True)
    ]
    return tuple(one for one in least if one.parameter != "ratio" or abs(one.value - 1.0) < FAR)


def _worth(use: TermUse, term: PhysicsTerm, times: float) -> Smallest:
    """Give a term `times` as large as it is."""
    size = term.params[0]
    neutral = size.neutral or 0.0
    return Smallest(use.term, use.side, size.name, neutral + times * (use.values[size.name] - neutral))
