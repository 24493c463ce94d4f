"""Signs that what was found are pieces of something that has no name here: then it explains the mismatch in part only.

Each asks a case by itself, and names nothing. What was found stays named, for it is the nearest that the library has.
"""

from collections import Counter
from itertools import combinations

import numpy as np

from gsfdi.fit import Knob
from gsfdi.reconcile.case import Case
from gsfdi.reconcile.compete import MOST
from gsfdi.reconcile.constancy import inconstant
from gsfdi.reconcile.dating import moments_of
from gsfdi.reconcile.finalists import has_ended, never_slips
from gsfdi.reconcile.judge import Name
from gsfdi.reconcile.noise import power_of_means
from gsfdi.reconcile.parameters import TERM_OF, ended
from gsfdi.reconcile.trifles import SHAPED

SPANS, SWAYS = 30, 6.0
"""Spans of time over which innovations are averaged, and standard deviations of their power that no chance makes."""
SILENT, SOLVED = 3e-7, 3e-6
"""Shares of the reach: noise of a position up to which it has none, and by how much a simulation is off by itself."""
LEVELS, UNKNOWN = 2.0, 0.25
"""Times the wind-up over which a loop rises, and relative half width of its height's interval, that leave it open."""
SAME = 0.02
"""Share by which the numbers of two laws may differ that are pieces of one."""
SERIES = 3
"""Waves or bumps of one kind that draw whatever depends on the angle, as the terms of a series do."""
PLANT = {*TERM_OF.values(), "torque_constant_drift", "current_gain"}
"""Terms that each say of a number of the linear plant that it is far from what the model has."""


def sways(case: Case) -> bool:
    """Whether beside nothing but numbers of the linear plant the position is off for seconds, as by another law.

    Innovations of a right model are white. Of gearboxes that creep, told as a stiffness of up to 1.4, five swayed by 8
    to 21 of these deviations, and of twelve joints of which numbers were off none by more than 3. Where sensors have no
    noise what is left is no white noise either, but the last digits of two simulations.
    """
    if not {name.use.term for name in case.found} <= PLANT or case.findings:
        return False
    seen = case.hand.fitted.residual[:: len(case.stand.system.rows)]
    seen = seen[seen != 0.0]
    noise = float(np.sqrt(case.stand.system.R[0]))
    if noise < SILENT * case.stand.scales.reach and noise * np.std(seen) < SOLVED * case.stand.scales.reach:
        return False
    power, count = power_of_means([seen], max(len(seen) // SPANS, 1))
    return power > 1.0 + SWAYS * float(np.sqrt(2.0 / max(count, 1)))


def never_ends(case: Case) -> bool:
    """Whether the competition was broken off at its last term, and two or more of its winners are worth no name.

    Where the joint's own terms are on the shelf they come first, and chance explains the rest. Beside a stiffness, in
    the place of a gearbox that creeps, an eccentric encoder, a drag, a damping and a bias gained 50 to 530 each.
    """
    won = sum(contest.winner is not None for contest in case.contests)
    over = case.contests[-1].winner is not None
    shaped = any(name.use.term in SHAPED for name in case.found)  # how a law is written takes some mending
    return over and won >= MOST and len(case.found) < won - 1 and not shaped


def is_series(case: Case) -> bool:
    """Whether so many terms of one kind were found, one of them as far from its own shape as it may go."""
    counts = Counter(name.use.term for name in case.found)
    series = {term for term, count in counts.items() if count >= SERIES}
    fitted = case.hand.fitted
    return any(
        knob.place >= 0 and fitted.model.physics[knob.place].term in series and knob.is_at_end(value)
        for knob, value in zip(fitted.knobs, fitted.values, strict=True)
    )


def sets_in_anew(case: Case) -> bool:
    """Whether one thing after another sets in, or one kind of term more than once: pieces of what has no name here.

    In the place of a Coulomb friction that set in, frictions by position did: five of them from 66 to 81 s.
    """
    begun = [name.use for name in case.found if name.use.onset is not None]
    return moments_of(begun, case.stand.scales.seconds) > 1 or len({use.term for use in begun}) < len(begun)


def is_far(case: Case) -> bool:
    """Whether a number that sizes or shapes what was found ended as far as it may go.

    What it stands for goes on beyond. A gearbox that creeps was a hysteresis of three times the drive's torque.
    """
    fitted, given = case.hand.fitted, len(case.settled.model.physics)
    physics = fitted.model.physics
    if any(has_ended(fitted, case.terms, place) for place in range(given, len(physics))):
        return True
    if any(never_slips(use, case.stand.scales) for use in physics[given:]):
        return True

    def goes_on(knob: Knob, value: float) -> bool:
        term = case.terms[physics[knob.place].term]
        if knob.name == "onset" or term.param(knob.name).kind != "plain":
            return False
        if term.param(knob.name) is term.order:  # a wave that would not be whole is a piece of something else
            return knob.is_at_end(value)
        return knob.is_at(knob.high, value)

    pairs = zip(fitted.knobs, fitted.values, strict=True)
    return any(knob.place >= given and goes_on(knob, value) for knob, value in pairs)


def never_levels(case: Case) -> bool:
    """Whether a loop is wider than the wind-up swings and nobody can tell how high it would be.

    Two gearboxes that creep were loops of the drive's torque and more, of heights from 0 to 28 and from 9 to 17 N m.
    One of 2.5 times the wind-up is a loop for all that, where its height is known to a seventh.
    """

    def is_open(name: Name) -> bool:
        if name.use.term != "gearbox_hysteresis" or "torque_nm" not in name.ci:
            return False
        low, high = name.ci["torque_nm"]
        wide = name.use.values["width_rad"] > LEVELS * case.stand.scales.windup
        return wide and high - low > UNKNOWN * (high + low)

    return any(map(is_open, case.found))


def gives_by_speed(case: Case) -> bool:
    """Whether a hysteresis is damped beside, too little for a name: its loop is another the faster it is gone through.

    That of a hysteresis is not. Four gearboxes that creep were a hysteresis, and of three the damping gained 77 to 195.
    """
    won = {contest.winner.offer.term for contest in case.contests if contest.winner is not None}
    found = {name.use.term for name in case.found}
    return "gearbox_hysteresis" in found and "gearbox_damping" in won - found


def varies(case: Case) -> list[tuple[str, str]]:
    """Terms that were found whose size is another in one half of the samples, and in which."""
    return inconstant(case.hand, len(case.settled.model.physics), case.terms)


def is_in_pieces(case: Case) -> bool:
    """Whether two laws of friction that were found turn over at one speed and by one torque.

    What one loses the other gains: together they are a law that has no name here.
    """
    laws = [use.values for use in (name.use for name in case.found) if "velocity_rad_s" in use.values]
    sizes = [(law["velocity_rad_s"], max(abs(v) for name, v in law.items() if name.endswith("_nm"))) for law in laws]
    return any(np.allclose(one, other, rtol=SAME, atol=0.0) for one, other in combinations(sizes, 2))


def strained(case: Case) -> list[str]:
    """Numbers of the plant that went as far as they are believed; none where it is one alone."""
    ends = ended(case.hand.fitted)
    return ends if len(ends) > 1 else []


def bent_by_law(case: Case) -> list[str]:
    """Numbers that are `strained` beside what was found: all of them are bent by a law that is not the joint's.

    Where no law was found, one number that is off bends the others.
    """
    return strained(case) if case.found or case.findings else []


SIGNS = (
    never_ends,
    sets_in_anew,
    is_series,
    bent_by_law,
    is_far,
    never_levels,
    gives_by_speed,
    is_in_pieces,
    sways,
    varies,
)
"""Signs that what was found are pieces of something that has no name here."""
