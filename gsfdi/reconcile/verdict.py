"""The verdict: what was named, and what remains of the mismatch."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gsfdi.reconcile.case import Case
from gsfdi.reconcile.enough import is_blind
from gsfdi.reconcile.hand import is_sensor
from gsfdi.reconcile.judge import torque_left, white_left
from gsfdi.reconcile.offering import SIMULATED
from gsfdi.reconcile.reconciliation import Outcome
from gsfdi.reconcile.signs import PLANT, SIGNS
from gsfdi.reconcile.ticks import left_by_shift
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
