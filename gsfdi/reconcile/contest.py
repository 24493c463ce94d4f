"""One contest: every offer is screened, the finalists are refitted, the best are settled, and the likeliest may win.

Every offer's signature is the change of the white innovations when the term is switched on in a replay. A linear
regression on signature and plant together says how much of the log-likelihood the term could gain, from the start or
from an onset on. The best are then refitted by replay, all numbers at once, each under the noise that suits it, and the
winner must gain more than chance would give the luckiest of as many offers on this very motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.fit import Fitted
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.finalists import (
    CHANCE,
    FINALISTS,
    UNPROMISED,
    beside_ends,
    calibrated,
    cost_of,
    credible,
    distinct,
    fairly,
    finalists_of,
    idle,
    is_at_bound,
    matters,
    merit,
    needed,
    never_slips,
    only_turns,
    settled_bar,
    settled_onset,
    shows_at_once,
    stretched_knobs,
)
from gsfdi.reconcile.forms import relawed, reordered, reshaped, retuned, shared_anew, swung
from gsfdi.reconcile.glaring import glares, glaring
from gsfdi.reconcile.hand import (
    Round,
    Turn,
    at_a_glance,
    coarse,
    exact,
    from_above,
    from_below,
    leaves_nothing,
    likelier,
    missing,
    refined,
    settle,
    without_terms,
)
from gsfdi.reconcile.lagging import beside_positions
from gsfdi.reconcile.offering import MATERIAL, all_offers
from gsfdi.reconcile.pairs import paired_anew
from gsfdi.reconcile.screen import LEAST, Entry, Screening, refits, screen
from gsfdi.reconcile.smallest import Smallest, smallest
from gsfdi.reconcile.verify import SILENCED, SILENCERS, STRAYS, strays
from gsfdi.types import Array

NEAR = 0.3
"""Share of the best finalist's merit from which another is settled under its own noise, too."""
WORTH = 60.0
"""Merit from which a finalist below its bar is settled, and what it must gain once it is.

Where something is missing, a lower merit will do, for the noise of that hides what a term is worth: a mode of merit 47
gained 1,416.
"""
CLEAR = 2.0
"""Times its bar that a settled finalist gains which goes before any that gains less."""
FAR = 0.5
"""Share of the gain of one that leaves a trifle below which a rival is not given other shapes."""
EARLY = 0.5
"""Share of the best one's gain below which a rival is left after its first turn: of 43 on 36 joints none came up."""
GLANCED = 0.15
"""The same before it: of 9 on 36 joints that gained less as they were, none came to a third once settled."""
IDLE = 0.5
"""Part of what a winner gains from which on that is none of its own doing."""
OWED = 0.5
"""Part of what another law of a finalist gains that does not count against the others while something is left.

A gravity and a Stribeck friction were missing; an asymmetry that turns smoothly came before the gravity by 3 of 10,240,
of which it owed 330 to its smoothness.
"""
LEFT = 0.1
"""Share of what is missing above which what the best finalist leaves has others looked for by size."""
PLAINLY = 2.5
"""Times what the best of all others gains from which a term that shapes another may come without that."""
SETTLED, LEVEL = 4, 0.99
"""Finalists that are settled at most, unless more come within this share of the best."""
TRIVIAL = 0.02
"""Share of the missing torque below which a further term is looked for only where regression promises it its bar.

A second effect may be felt plainly beside one that is a hundred times as large.
"""


@dataclass(frozen=True, slots=True)
class Contest:
    """One round as it went: who competed, best first, who won, how many offers there were, and what would have won."""

    entries: tuple[Entry, ...]
    winner: Entry | None
    trials: int
    smallest: tuple[Smallest, ...] = ()
    beyond: frozenset[tuple[str, str | None]] = frozenset()
    """Terms and sides that came nowhere near the winner, though each was fitted under the noise that suits it."""
    far: frozenset[tuple[str, str | None]] = frozenset()
    """Terms and sides that were left after their first turn: they come nowhere near where nothing more has joined."""


@dataclass(frozen=True, slots=True)
class Leader:
    """A settled finalist that gains what it must: one that gains far more than that goes before any that does not."""

    entry: Entry
    settled: Round
    rank: tuple[bool, float]


def contend(
    hand: Round, shelf_terms: Mapping[str, PhysicsTerm], floor: Array, given: int, promised: float = 0.0
) -> tuple[Contest, Round | None]:
    """Hold one round: screen every offer, refit the finalists, settle the best, and test the winner against luck.

    While much is missing every term is judged under a large noise, where the true one is hardly better than its
    likes. So the best few are settled each under the noise that suits it, and the likeliest wins. Only what regression
    promises at least `promised` may compete. Beside no winner there may be the model in hand, fitted better.
    """
    screening = screen(hand, all_offers(hand, shelf_terms, given))
    ranked, worthy = refitted(hand, screening, shelf_terms, floor, promised)
    trials, entries = len(screening.information), (*ranked, *screening.entries)
    best, beyond, behind = led(hand, to_settle(worthy, shelf_terms), None, shelf_terms, floor, given, trials)
    if glares(hand) and falls_short(best, hand, floor):
        more = calibrated(hand, screening, glaring(hand, screening))
        entries = (*sorted([*more, *ranked], key=merit, reverse=True), *screening.entries)
        best, further, farther = led(hand, more, best, shelf_terms, floor, given, trials)
        beyond, behind = beyond | further, behind | farther
        if best and falls_short(best, hand, floor):
            best = by_itself(hand, best, shelf_terms, floor, given, trials)
    if best is None:
        return undecided(hand, screening, entries, shelf_terms), None
    left = loosened(hand, best.entry, best.settled, shelf_terms, floor)
    if left is not best.settled:
        return undecided(hand, screening, entries, shelf_terms), None if left is hand else left
    contest = Contest(entries, best.entry, trials, beyond=beyond, far=behind)
    return contest, exact(from_above(from_below(left, floor), floor))


def falls_short(best: Leader | None, hand: Round, floor: Array) -> bool:
    """Whether the best finalist leaves so much of what is missing that another may be the cause.

    Of eleven effects from a fifth of the drive's torque up the true one left at most 0.018, another 0.3 and more.
    """
    if best is None:
        return True
    return not leaves_nothing(best.settled, floor) and missing(best.settled, floor) > LEFT * missing(hand, floor)


def led(
    hand: Round,
    entries: Sequence[Entry],
    best: Leader | None,
    shelf_terms: Mapping[str, PhysicsTerm],
    floor: Array,
    given: int,
    trials: int,
) -> tuple[Leader | None, frozenset[tuple[str, str | None]], frozenset[tuple[str, str | None]]]:
    """Settle finalists one after another, each only as far as it may come up to the best so far.

    Returns
    -------
    Leader or None
        The best; the one that was given where none is better.
    frozenset of tuple
        Terms and sides that come nowhere near it, each fitted under the noise that suits it.
    frozenset of tuple
        Those that were left after their first turn.
    """
    beyond, behind = set[tuple[str, str | None]](), set[tuple[str, str | None]]()
    for entry in entries:
        assert entry.fitted is not None
        rival = pursued(hand, entry.fitted, best.settled if best else None, floor)
        if best and is_beyond(best.settled, rival, hand, floor):
            beyond.add((entry.offer.term, entry.offer.side))
        elif isinstance(rival, Turn):
            behind.add((entry.offer.term, entry.offer.side))
        else:
            found = worked_out(rival, hand, entry, shelf_terms, floor, given, trials)
            if found and found.rank > (best.rank if best else (False, 0.0)):
                best = found  # one that gains nothing only moves the mismatch about
    return best, frozenset(beyond), frozenset(behind)


def by_itself(
    hand: Round, best: Leader, shelf_terms: Mapping[str, PhysicsTerm], floor: Array, given: int, trials: int
) -> Leader:
    """Try a term that shapes another without that, where it is plainly better than the best so far.

    A grease that yields, of half the drive's torque, gained four times what the best of the others did. On a real arm,
    where viscous and Coulomb friction were missing, the one that comes near both together gained a quarter more.
    """
    offers = all_offers(hand, shelf_terms, given, alone=True)
    if not offers:
        return best
    screening = screen(hand, offers)
    entries = calibrated(hand, screening, glaring(hand, screening))
    found = led(hand, entries, best, shelf_terms, floor, given, trials)[0]
    return found if found and found.rank[1] > PLAINLY * best.rank[1] else best


def refitted(
    hand: Round, screening: Screening, shelf_terms: Mapping[str, PhysicsTerm], floor: Array, promised: float
) -> tuple[list[Entry], list[Entry]]:
    """Refit the finalists of a screening.

    Returns
    -------
    list of Entry
        All of them, those of the greatest merit first.
    list of Entry
        Those that are worth settling under a noise of their own, however small their merit where that noise hides it.
    """
    able = [entry for entry in screening.entries if entry.linear >= promised]
    ended = beside_ends(screening.entries, hand, floor)
    finalists = finalists_of(able)
    finalists += [e for e in ended if not any(e is other for other in finalists)]
    finalists += beside_positions(screening.entries, hand.stand)
    ranked = credible(hand, screening, refits(hand, finalists))
    fair = [fairly(hand, e, shelf_terms) if merit(e) > LEAST else e for e in ranked]
    hope = np.inf if leaves_nothing(hand, floor) else LEAST
    wanted = {entry.offer.term for entry in ended}
    pairs = zip(fair, ranked, strict=True)
    hopeful = {id(one) for one, whole in pairs if merit(whole) > (0.0 if one.offer.term in wanted else hope)}
    ranked = sorted(fair, key=merit, reverse=True)
    near = [e for e in needed(ranked) if merit(e) > NEAR * merit(ranked[0]) or e.offer.term in wanted]
    near = [e for e in near if matters(hand, e)]
    return ranked, [e for e in near if merit(e) > min(e.bar, WORTH) or id(e) in hopeful]


def worked_out(
    rival: Round,
    hand: Round,
    entry: Entry,
    shelf_terms: Mapping[str, PhysicsTerm],
    floor: Array,
    given: int,
    trials: int,
) -> Leader | None:
    """Give a settled finalist its onset, its shapes and its share of what came before; none if it is no winner."""
    settled, owed = shaped(rival, hand, entry, shelf_terms[entry.offer.term], floor)
    settled = settled and unstretched(settled, hand, floor)
    settled = settled and shared_anew(settled, given, shelf_terms, floor)
    settled = settled and paired_anew(settled, given, shelf_terms, floor)
    if settled is None or is_another(settled, shelf_terms) or not shows_at_once(settled):
        return None
    gain, least = likelier(settled, hand) - cost_of(entry) - owed, settled_bar(settled, entry, trials)
    if merit(entry) < entry.bar and gain < max(least, WORTH):
        return None
    return Leader(entry, settled, (gain > CLEAR * least, gain))


def pursued(hand: Round, fitted: Fitted, best: Round | None, floor: Array) -> Round | Turn:
    """Settle what was fitted, unless it stays far behind the best so far at a glance or in its first turn.

    Where there is none yet, it is settled whatever its first turn gains: a Stribeck friction came from -1039 to 1897.
    """
    if best is None:
        return settle(hand.stand, fitted.model, fitted.knobs, floor)
    most, glance = likelier(best, hand), at_a_glance(hand, fitted, floor)
    if likelier(glance, hand) < GLANCED * most:
        return glance
    turn = coarse(hand.stand, fitted.model, fitted.knobs, floor)
    return turn if likelier(turn, hand) < EARLY * most else refined(turn, floor)


def loosened(hand: Round, winner: Entry, settled: Round, shelf_terms: Mapping[str, PhysicsTerm], floor: Array) -> Round:
    """Take out a winner that regression had not promised, and that gains as much where it does nothing.

    A fit that is stuck is loosened by any further term: a position gain of 0.91 gained 1400 beside a payload that was
    a third off. And a joint that sticks is stepped otherwise beside some terms, and slips a sample sooner or later: a
    wave of 8e-9 rad gained 290, a gearbox damping of nothing 190.

    Returns
    -------
    Round
        `settled` where the winner is no such one; the model in hand with what came beside the winner where that gains
        without it; `hand` where it gains with it only, which is of no use.
    """
    use = idle(settled.fitted.model.physics[-1], shelf_terms)
    if use is None or winner.gain < UNPROMISED * winner.linear:
        return settled
    place, model = len(hand.fitted.model.physics), settled.fitted.model
    bare, knobs, _ = without_terms(settled.fitted, [place])
    enough = IDLE * likelier(settled, hand)
    without = settle(hand.stand, bare, knobs, floor)
    if likelier(without, hand) > enough:
        return without
    return hand if likelier(settle(hand.stand, model.with_use(place, use), knobs, floor), hand) > enough else settled


def to_settle(ranked: Sequence[Entry], shelf_terms: Mapping[str, PhysicsTerm]) -> list[Entry]:
    """The best entries of so many terms, and the best that is there from the start if all of these set in.

    What a joint meets but once, as a stop at the end of its way, looks like much that sets in. Those that have gone as
    far as is plausible come last: where three frictions are missing, a drive that moves hardly anything leads them all.
    Under a large noise likes are level: a weight was the fifth, by 0.3 %, and won once it was settled.
    """
    ranked = sorted(ranked, key=lambda e: e.fitted is not None and is_at_bound(e.fitted, shelf_terms))
    least = LEVEL * max(map(merit, ranked), default=0.0)
    level = distinct([entry for entry in ranked if merit(entry) > least], FINALISTS, onsets=False)
    found = max(distinct(ranked, SETTLED, onsets=False), level, key=len)
    if all(entry.onset is not None for entry in found):
        found += [entry for entry in ranked if entry.onset is None][:1]
    return found


def shaped(settled: Round, hand: Round, entry: Entry, term: PhysicsTerm, floor: Array) -> tuple[Round | None, float]:
    """Give a settled finalist its onset and its shapes; none if it gains nothing, or leads the simulation astray.

    Of what another law or a detail of it gains it owes a part while something else is missing, which that may suit.
    """
    last = len(hand.fitted.model.physics)
    settled = settled_onset(settled, last, floor)
    if likelier(settled, hand) <= 0:
        return None, 0.0
    plain = reordered(retuned(swung(settled, last, term, floor), last, term, floor), last, term, floor)
    other = relawed(plain, last, term, floor)
    found = reshaped(other, term, floor)
    most = SILENCED if term.place in SILENCERS else STRAYS
    if strays(hand.stand, hand.fitted.model, found.fitted.model, most=most):
        return None, 0.0
    return found, 0.0 if leaves_nothing(other, floor) else OWED * likelier(other, plain)


def unstretched(settled: Round, hand: Round, floor: Array) -> Round:
    """Fit what was settled once more, details of earlier terms that it stretches as far as may be held as they were.

    A drag was a friction at a place as yet; beside a cogging it turned round as smoothly as a friction may.
    """
    stretched = {(k.place, k.name) for k in stretched_knobs(settled.fitted) if k.place < len(hand.fitted.model.physics)}
    if not stretched:
        return settled
    knobs = [knob for knob in settled.fitted.knobs if (knob.place, knob.name) not in stretched]
    model = settled.fitted.model
    for place, name in stretched:
        use = model.physics[place]
        before = hand.fitted.model.physics[place].values[name]
        model = model.with_use(place, replace(use, values={**use.values, name: before}))
    return settle(settled.stand, model, knobs, floor)


def is_another(settled: Round, shelf_terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether the last term of a model is not what its name says, but stands for another or mends one."""
    scales = settled.stand.scales
    at_once = scales.torque / scales.inertia * scales.period
    model = settled.fitted.model
    return (
        is_at_bound(settled.fitted, shelf_terms) or only_turns(model, at_once) or never_slips(model.physics[-1], scales)
    )


def is_beyond(best: Round, rival: Round | Turn, hand: Round, floor: Array) -> bool:
    """Whether no other onset or shape of the rival brings it up to the best, which explains all, or nearly all.

    A rival that has taken its first turn only must be the farther behind.
    """
    gained, most = likelier(rival, hand), likelier(best, hand) * (EARLY if isinstance(rival, Turn) else 1.0)
    if leaves_nothing(best, floor):
        return gained < most
    return gained < FAR * most and missing(best, floor) < TRIVIAL * missing(hand, floor)


def undecided(
    hand: Round, screening: Screening, entries: Sequence[Entry], shelf_terms: Mapping[str, PhysicsTerm]
) -> Contest:
    """Lay out a round that nobody won, with the least of every term that would have."""
    least = smallest(hand, screening, shelf_terms, CHANCE, MATERIAL)
    return Contest(tuple(entries), None, len(screening.information), least)
