"""When something set in, where the recording leaves it open: a joint that rests does not show it."""

from collections.abc import Iterable

import numpy as np

from gsfdi.fit import Knob
from gsfdi.model import JointModel, TermUse
from gsfdi.reconcile.hand import Round, around
from gsfdi.reconcile.screen import ONSETS, refined_onset
from gsfdi.reconcile.turning import fit_knobs, known_before

OPEN = 2.0
"""Log-likelihood within which one moment is as good as another."""
MOMENTS = 61
"""Moments tried, evenly over the recording."""
NEAR = 64.0
"""Part of the distance of two offered onsets by which one that was only fitted beside a rival may still be off."""
APART = 0.03
"""Share of the time by which two things set in apart from each other."""


def moments_of(uses: Iterable[TermUse], seconds: float) -> int:
    """At how many moments apart from each other, within so many `seconds`, terms set in."""
    count, last = 0, -np.inf
    for onset in sorted(use.onset for use in uses if use.onset is not None):
        if onset > last + APART * seconds:
            count, last = count + 1, onset
    return count


def dated(hand: Round, given: int) -> Round:
    """Put every onset to the sample where it shows, or into the middle of the time in which it may be.

    A load that came three samples late cost 360, which another term seemed to gain.

    Parameters
    ----------
    hand : Round
        The model in hand and its fit.
    given : int
        Terms of the nominal model, which are there from the start.
    """
    for place in range(given, len(hand.fitted.model.physics)):
        use = hand.fitted.model.physics[place]
        if use.onset is None or hand.stand.count > 1:
            continue
        near = refined_onset(hand, hand.fitted, place, hand.stand.scales.seconds / (ONSETS * NEAR), rounds=2)
        if near.cost < hand.fitted.cost - OPEN:
            hand = around(hand, near)
        use = hand.fitted.model.physics[place]
        assert use.onset is not None
        onset = middle(hand, place, use.onset)
        if onset != use.onset:
            fitted = hand.fitted
            near = fit_knobs(hand.misfit, begun(hand, place, onset), fitted.knobs, 2, known_before(fitted, place))
            hand = around(hand, near)
    return hand


def begun(hand: Round, place: int, onset: float) -> JointModel:
    """Give the model in hand with the term at `place` from another moment on."""
    return Knob(place, "onset", 1.0, 0.0, np.inf).turn(hand.fitted.model, onset)


def middle(hand: Round, place: int, onset: float) -> float:
    """Middle of the moments around `onset` [s] at which the term at `place` might as well have set in."""
    moments = np.unique([*np.linspace(0.0, hand.stand.scales.seconds, MOMENTS)[1:-1], onset])
    costs = 0.5 * np.sum(hand.misfit([begun(hand, place, moment) for moment in moments]) ** 2, axis=1)
    now = int(np.searchsorted(moments, onset))
    closed = np.flatnonzero(~(costs < costs[now] + OPEN))
    first = max(closed[closed < now], default=-1) + 1
    last = min(closed[closed > now], default=len(moments)) - 1
    return float(onset if first == last else 0.5 * (moments[first] + moments[last]))
