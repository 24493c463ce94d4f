"""Terms that are no physics of their own: where two ways of writing a law differ, a term that is there mends it."""

from collections.abc import Mapping, Sequence

import numpy as np

from gsfdi.fit import Fitted
from gsfdi.model import TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.finalists import size_of
from gsfdi.reconcile.hand import Round, around, is_sensor, missing, settle
from gsfdi.reconcile.lagging import LAG
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.simpler import without

TRIVIAL = 0.005
"""Share of the gain in log-likelihood below which a slight term is not worth a name."""
MENDS = 0.04
"""The same beside a weightier term of the same part that is `SHAPED`.

Beside one that is felt `EVERYWHERE` any other term may stand for how it is made, as for the flanks of a backlash.
"""
SHAPED_TOO = 0.02
"""The same for one that is `SHAPED` itself."""
SPARED = 0.15
"""The same where it would take something off what the nominal model holds."""
ERRS = 0.1
"""Share of its torque by which a term that is `SHAPED` may be another than the library's."""
CLEARED = 0.2
"""Share of the missing torque that remains once a term is there that is no mend, however little it gains."""
SLIGHT = 0.005
"""Share of the drive's torque up to which a term is slight."""
WHITE, COLOURED = 1.1, 1.1
"""Power of white innovations up to which they are noise, and times which they have without what is no trifle."""
VOID = 1e-5
"""Share of the drive's torque that is none: a twentieth of what no simulator gets right."""
EVEN = 5e-5
"""Distance of a ratio from one that does nothing which is none: one of 0.99997 mended a gear that creeps."""
TOLD = 2e-4
"""The same beside a speed that the law told, which a sound joint's positions went 1.00015 times as far as."""
SHAPED = ("stribeck_friction", "presliding_friction", "gearbox_hysteresis", "backlash", LAG)
"""Terms of which the literature has several laws, so that the joint's may be another than the library's."""
EVERYWHERE = {"backlash", LAG}
"""Those of them that are felt in every part: a contact, and a speed that is late, by delay or by a filter.

Beside two of nine speeds that passed a filter a motor's inertia was nearly twice as large, for 0.6 % of what they gain.
"""
ONE_WAY = ("asymmetric_friction",)
"""Terms that no law of those can need, for they act the same way whichever way the joint moves."""


def pruned(hand: Round, given: int, shelf_terms: Mapping[str, PhysicsTerm]) -> Round:
    """Take out terms whose part in the mismatch is trivial: where two ways of writing a law differ, not physics."""
    while found := hand.fitted.model.physics[given:]:
        if len(found) == 1 and not is_void(hand, found[0], shelf_terms):
            return hand  # all that was found is no trifle beside anything
        trials = [without(hand, given + i) for i in range(len(found))]
        gains = np.array([max(trial.cost - hand.fitted.cost, 0.0) for trial in trials])
        shares = gains / max(float(gains.sum()), 1e-300)
        beside = list(zip(found, shares, strict=True))
        trivial = [
            i
            for i in sorted(range(len(beside)), key=lambda k: beside[k][1])
            if is_void(hand, found[i], shelf_terms)
            or (_is_trifle(hand, given, i, beside, trials, shelf_terms) and not _clears(hand, trials[i]))
        ]
        if not trivial:
            return hand
        hand = around(hand, trials[trivial[0]])
    return hand


def _is_trifle(
    hand: Round,
    given: int,
    place: int,
    beside: Sequence[tuple[TermUse, float]],
    trials: Sequence[Fitted],
    shelf_terms: Mapping[str, PhysicsTerm],
) -> bool:
    """Whether a term gains hardly anything, or no more than one that only mends a weightier one may."""
    share = beside[place][1]
    if share < TRIVIAL and not _weighs(hand, given + place, trials[place]):
        return True
    return share < least_share(place, beside, shelf_terms) and not _stands_out(hand, place, beside, trials, shelf_terms)


def only_mends_flanks(hand: Round, given: int, shelf_terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether the last term only mends how the flanks of a backlash are made: whatever comes after it gains less yet.

    Parameters are those of `pruned`.
    """
    found = hand.fitted.model.physics[given:]
    if len(found) < 2 or not any(use.term == "backlash" for use in found[:-1]):
        return False
    left = pruned(hand, given, shelf_terms).fitted.model.physics[given:]
    return found[-1].term not in {use.term for use in left}


def least_share(place: int, beside: Sequence[tuple[TermUse, float]], shelf_terms: Mapping[str, PhysicsTerm]) -> float:
    """Share of the gain that a term must hold, however large it is, beside weightier ones that it may only mend.

    Parameters
    ----------
    place : int
        Of the term among the others.
    beside : sequence of tuple
        Every term, with its share.
    shelf_terms : mapping of str to PhysicsTerm
        The library.
    """
    use, shaped = beside[place][0], _weightier_shaped(place, beside)
    if not shaped or use.term in ONE_WAY:
        return 0.0
    if _is_apart(use, [beside[i][0] for i in shaped], shelf_terms):
        return TRIVIAL
    if use.term in SHAPED:
        return SHAPED_TOO
    size = shelf_terms[use.term].params[0]
    taken_off = size.low >= 0.0 > use.values[size.name]
    return SPARED if taken_off else MENDS


def _weightier_shaped(place: int, beside: Sequence[tuple[TermUse, float]]) -> list[int]:
    """Find the `SHAPED` terms that gain more than the one at `place`."""
    return [i for i, (other, share) in enumerate(beside) if share > beside[place][1] and other.term in SHAPED]


def _is_apart(use: TermUse, shaped: Sequence[TermUse], shelf_terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether a term is of a part in which none of the shaped ones is felt."""
    parts = {shelf_terms[other.term].component for other in shaped}
    return shelf_terms[use.term].component not in parts and not any(other.term in EVERYWHERE for other in shaped)


def _stands_out(
    hand: Round,
    place: int,
    beside: Sequence[tuple[TermUse, float]],
    trials: Sequence[Fitted],
    shelf_terms: Mapping[str, PhysicsTerm],
) -> bool:
    """Whether a term apart from all weightier shaped ones, of which there are some, acts with more than they err by."""
    use, shaped = beside[place][0], _weightier_shaped(place, beside)
    is_seen = shelf_terms[use.term].component == "sensor"
    if is_seen or not _is_apart(use, [beside[i][0] for i in shaped], shelf_terms):
        return False
    return size_of(hand, trials[place]) > ERRS * max(size_of(hand, trials[i]) for i in shaped)


def _clears(hand: Round, bare: Fitted) -> bool:
    """Whether nearly all that the model in hand would lack without a term goes when it comes: no mend does that."""
    floor = effort_floor(hand.stand)
    settled = settle(hand.stand, bare.model, bare.knobs, floor)
    return missing(hand, floor) < CLEARED * missing(settled, floor)


def is_void(hand: Round, use: TermUse, shelf_terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether a term has no size left, so that only a detail of it acts, or the substeps that are made for it."""
    size = shelf_terms[use.term].params[0]
    even = TOLD if hand.stand.lever > 0 and is_sensor(use.term) else EVEN
    hardly = {"N m": VOID * hand.stand.scales.torque, "1": even}.get(size.unit, 0.0)
    return size.neutral is not None and abs(use.values[size.name] - size.neutral) <= hardly


def _weighs(hand: Round, place: int, bare: Fitted) -> bool:
    """Whether the term at `place`, that `bare` is without, acts with more than a slight torque.

    An error of a sensor has none: it must be what leaves nothing but noise. A speed that lagged by 0.6 samples gained
    6,500, which was a trifle beside the 8 million of an inertia that was off by a fifth.
    """
    if is_sensor(hand.fitted.model.physics[place].term):
        white = 2.0 * hand.fitted.cost < WHITE * hand.stand.told
        return white and bare.cost > COLOURED * hand.fitted.cost
    return size_of(hand, bare) > SLIGHT
