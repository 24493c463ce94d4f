"""A model made simpler: what the terms that came later have made needless goes again."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

from gsfdi.fit import Fitted
from gsfdi.reconcile.finalists import KNOB_COST
from gsfdi.reconcile.hand import Round, around, without_terms
from gsfdi.reconcile.screen import EARLIEST, refined_onset
from gsfdi.reconcile.turning import fit_knobs, known_before


def simplified(hand: Round, given: int) -> Round:
    """Take out, one after another, terms and onsets that the others have made needless.

    Parameters
    ----------
    hand : Round
        The model in hand and its fit.
    given : int
        Terms of the nominal model, which stay.
    """
    hand = there_all_along(hand, given)
    while True:
        trials = [(without(hand, place), _price(hand, place)) for place in range(given, len(hand.fitted.model.physics))]
        trials += [
            (always(hand, place), 2 * KNOB_COST)
            for place in range(given, len(hand.fitted.model.physics))
            if _sets_in(hand, place)
        ]
        kept = [(fitted.cost - hand.fitted.cost - price, fitted) for fitted, price in trials]
        if len(hand.fitted.model.physics) - given < 2:
            kept = kept[1:]
        if not kept:
            return hand
        worth, fitted = min(kept, key=lambda pair: pair[0])
        if worth > 0:
            return hand
        hand = around(hand, fitted)


def there_all_along(hand: Round, given: int) -> Round:
    """Give terms that set in at the very start no onset; for the arguments see `simplified`."""
    for place, use in list(enumerate(hand.fitted.model.physics))[given:]:
        if use.onset is not None and use.onset < EARLIEST * hand.stand.scales.seconds:
            hand = around(hand, always(hand, place))
    return hand


def fewer(hand: Round, given: int, likes: Sequence[Sequence[Fitted]]) -> Fitted | None:
    """Put a like in the place of a term where it makes another needless that has likes, too; None where none does.

    A cable and a weight stood for a constant load: with that in the place of either, the other was nothing.

    Parameters
    ----------
    hand, given
        See `simplified`.
    likes : sequence of sequence of Fitted
        For every term that was found the model with one that the data cannot tell from it as its last.
    """
    doubted = [place for place, others in enumerate(likes) if others]
    for place, other in permutations(doubted, 2):
        for like in likes[place]:
            bare = without(around(hand, like), given + other - (other > place))  # the like is the last of its terms
            if bare.cost - hand.fitted.cost < _price(hand, given + other):
                return bare
    return None


def _price(hand: Round, place: int) -> float:
    use = hand.fitted.model.physics[place]
    return KNOB_COST * (len(use.values) + (2 if use.onset is not None else 0)) + 3.0


def _sets_in(hand: Round, place: int) -> bool:
    return hand.fitted.model.physics[place].onset is not None


def without(hand: Round, place: int) -> Fitted:
    """Refit the model in hand without the term at `place`; the same term on the other side may set in for both."""
    fitted, gone = hand.fitted, hand.fitted.model.physics[place]
    model, knobs, keep = without_terms(fitted, [place])
    known = fitted.jacobian[:, keep]
    alone = fit_knobs(hand.misfit, model, knobs, 3, known)
    for i, use in enumerate(model.physics):
        if use.term == gone.term and use.onset is not None and gone.onset is not None:
            alone = refined_onset(
                hand, fit_knobs(hand.misfit, alone.model, knobs, 6), i, abs(use.onset - gone.onset), known
            )
    return alone


def always(hand: Round, place: int) -> Fitted:
    """Refit the model in hand with the term at `place` there from the start."""
    fitted = hand.fitted
    use = replace(fitted.model.physics[place], onset=None)
    return fit_knobs(hand.misfit, fitted.model.with_use(place, use), fitted.knobs, 4, known_before(fitted, place))
