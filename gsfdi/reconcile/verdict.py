"""The verdict: what was named, and what remains of the mismatch."""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from gsfdi.fit import Knob
from gsfdi.reconcile.case import Case
from gsfdi.reconcile.compete import MOST
from gsfdi.reconcile.constancy import inconstant
from gsfdi.reconcile.dating import moments_of
from gsfdi.reconcile.enough import is_blind
from gsfdi.reconcile.finalists import has_ended, never_slips
from gsfdi.reconcile.hand import is_sensor
from gsfdi.reconcile.judge import Name, torque_left, white_left
from gsfdi.reconcile.noise import power_of_means
from gsfdi.reconcile.offering import SIMULATED
from gsfdi.reconcile.parameters import TERM_OF
from gsfdi.reconcile.reconciliation import Outcome
from gsfdi.reconcile.ticks import left_by_shift
from gsfdi.reconcile.trifles import SHAPED
from gsfdi.reconcile.twin import left_by_twin
from gsfdi.reconcile.verify import felt_noise, left_over, misfit, strays

REMAINS = 0.12
"""Share of the missing torque (root mean square) that may remain when a mismatch is called explained."""
PARTLY = 0.6
"""Share of the mismatch that may remain when what was found is worth a name: of torque, or of held-out misfits."""
HOPELESS = 0.8
"""The same before rivals of what was found are tried, which might leave less."""
MATERIAL = 0.01
"""Share of the drive's torque below which a mismatch without a name is not worth reporting."""
NOISY = 3.0
"""How many times the torque noise that is known to be there may remain: what is found is told in such steps."""
AS_MUCH = 2.0
"""What may remain, over what a simulated twin leaves, before a mismatch is seen in it."""
AS_GOOD = 1.3
"""The same before a model with what was found in it is taken to lack more."""
FOLLOWS = 1.3
"""Times what noise leaves of a simulation that it may be off by where nothing is missing any more."""
SPANS, SWAYS = 30, 6.0
"""Spans of time over which innovations are averaged, and standard deviations of their power that no chance makes."""
LEVELS, UNKNOWN = 2.0, 0.25
"""Times the wind-up over which a loop rises, and relative half width of its height's interval, that leave it open."""
SAME = 0.02
"""Share by which the numbers of two laws may differ that are pieces of one."""
SERIES = 3
"""Waves or bumps of one kind that draw whatever depends on the angle, as the terms of a series do."""
PLANT = {*TERM_OF.values(), "torque_constant_drift", "current_gain"}
"""Terms that each say of a number of the linear plant that it is far from what the model has."""


def left_of(case: Case) -> float:
    """Share of the mismatch that remains.

    As torque where torque is missing; but its noise is known on a coarse scale only, on which a faint effect makes no
    step, so that white innovations have the last word on what is not explained.
    """
    found = case.hand.fitted.model.physics[len(case.settled.model.physics) :]
    if any(is_sensor(use.term) for use in found):
        return white_left(case.first, case.hand, case.floor)
    left = torque_left(case.first, case.hand, case.floor)
    if left <= REMAINS:
        return left
    return min(left, max(REMAINS + 0.01, white_left(case.first, case.hand, case.floor)))


def verdict_of(case: Case, entries: Sequence[Mapping[str, Any]], left: float) -> Outcome:
    """Draw the verdict from what was named and what remains."""
    remains, near_noise = remaining(case)
    material = remains > MATERIAL and not near_noise
    if not entries:
        if material and remains > AS_MUCH * left_by_twin(case.first.stand, case.refitted, case.settled):
            return "unexplained"
        return "not_enough_data" if is_blind(case.first) else "no_mismatch"
    if strays(case.logged, case.refitted, case.updated, held_out=True):
        return "unexplained"
    piled = [name.use.term for name in case.found if name.use.term in PLANT]
    if len(piled) > 1 or any(sign(case) for sign in SIGNS):
        # a joint of which two numbers are far off at once has another law than any of these
        return "unexplained" if is_hopeless(case, left, PARTLY) else "partly_explained"
    physics = any(not is_sensor(name.use.term) for name in case.found)
    if left <= REMAINS or not (physics or material):  # an error of what is seen is no missing torque
        return "explained"
    if (near_noise and follows(case)) or remains <= AS_GOOD * left_by_twin(case.stand, case.updated, case.settled):
        return "explained"
    return "unexplained" if explains_little(case, left) else "partly_explained"


def is_hopeless(case: Case, left: float, most: float = HOPELESS) -> bool:
    """Whether what was found leaves more than a share `most` of a mismatch that is not of the simulation's own making.

    Then none of it is going to be a name.
    """
    remains, _ = remaining(case)
    if remains <= MATERIAL or not explains_little(case, left, most):
        return False
    return remains > AS_GOOD * left_by_twin(case.stand, case.updated, case.settled)


def remaining(case: Case) -> tuple[float, bool]:
    """Torque that is still missing, as a share of the drive's, and whether that is near the noise that is known."""
    remains, known = (float(np.linalg.norm(t)) / case.stand.scales.torque for t in (case.hand.torque, case.floor))
    stepped = min(left_by_shift(case.hand.fitted, case.stand.scales.period), SIMULATED)
    return remains, remains <= max(NOISY * known, stepped)


def explains_little(case: Case, left: float, most: float = PARTLY) -> bool:
    """Whether more than a share `most` is left of the missing torque, and of what simulations miss where held out."""
    if left < most or remaining(case)[1]:
        return False
    return left_over(case.logged, case.refitted, case.updated) >= most


def follows(case: Case) -> bool:
    """Whether the updated model follows what is held out to within its noise, as far as a loop holds it to that.

    A torque near the noise may be a part of something else: a gear that creeps was a hysteresis, which left half more
    than the noise of the position.
    """
    if case.updated.controller is None or any("setpoint" not in record for record in case.logged.records):
        return True
    after = misfit(case.logged, case.updated)
    floor = felt_noise(case.logged, case.updated, list(after))
    return all(value <= FOLLOWS * floor[name] for name, value in after.items())


def sways(case: Case) -> bool:
    """Whether beside nothing but numbers of the linear plant the position is off for seconds, as by another law.

    Innovations of a right model are white. Of gearboxes that creep, told as a stiffness of up to 1.4, five swayed by 8
    to 21 of these deviations, and of twelve joints of which numbers were off none by more than 3.
    """
    if not {name.use.term for name in case.found} <= PLANT or case.findings:
        return False
    seen = case.hand.fitted.residual[:: len(case.stand.system.rows)]
    seen = seen[seen != 0.0]
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
        knob.place >= 0 and fitted.model.physics[knob.place].term in series and is_at_end(knob, value)
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
            return is_at_end(knob, value)
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
    fitted = case.hand.fitted
    ends = [
        TERM_OF[knob.name]
        for knob, value in zip(fitted.knobs, fitted.values, strict=True)
        if knob.place == -1 and knob.name in TERM_OF and knob.low < knob.high and is_at_end(knob, value)
    ]
    return ends if len(ends) > 1 else []


def bent_by_law(case: Case) -> list[str]:
    """Numbers that are `strained` beside what was found: all of them are bent by a law that is not the joint's.

    Where no law was found, one number that is off bends the others.
    """
    return strained(case) if case.found or case.findings else []


def is_at_end(knob: Knob, value: float) -> bool:
    """Whether a number ended where it may go no farther."""
    return any(knob.is_at(end, value) for end in (knob.low, knob.high))


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
