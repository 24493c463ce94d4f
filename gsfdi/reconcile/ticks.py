"""Shifts of time within a tick, of which no model says anything: when an effort begins to act, how old a speed is.

Every loop has some: a speed that is filtered or sampled a little earlier, a current that the drive takes up a little
later. So has every simulator: one that steps the speed and then the angle with it logs a speed that lags by half its
step, and lets each effort act as much too early. Of forty joints simulated in such steps of a hundredth of a tick ten
were given a sensor's fault or a delay that they do not have, a fault-free one among them. Up to `PART` of a tick such
shifts are how a loop is run and no fault of anything: they are fitted beside the numbers of the plant and have no
name.
"""

import numpy as np

from gsfdi.fit import SHIFT, Fitted, Knob, Started, turned
from gsfdi.model import JointModel
from gsfdi.reconcile.hand import Round, around, likelier, regressed, settle
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.types import Array

NAMES = {"early": "actuation_delay", "old": "velocity_lag"}
"""What either shift is called where it is longer."""
PART = 0.15
"""Share of a tick up to which a shift is how samples are taken, held and acted on."""
LATE = 0.1
"""The same of an effort that acts late: few ways of stepping do that, and drives do."""
FULL = 0.95
"""Share of these from which a fitted shift is taken to be a longer one that was cut off."""
FIRST = 0.02
"""Ticks of a shift that matters."""
LEAST = 8.0
"""Log-likelihood that shifts must gain: less than a name must, for what else lags would be given what they do."""
REST = 0.05
"""Share of the drive's torque, per tick of a shift, that fitting it leaves: it is drawn straight between samples."""

READ = 0.005
"""Standard deviation, in ticks, of what simulators differ by in when samples are read and efforts act."""


def shifts_of(model: JointModel) -> tuple[float, float]:
    """How long before its stamp an effort acts, and by how much a speed is older than its stamp [s]."""
    return (model.early, model.old) if isinstance(model, Started) else (0.0, 0.0)


def shift_knobs(fitted: Fitted) -> list[Knob]:
    """Knobs of the shifts that are fitted."""
    return [knob for knob in fitted.knobs if knob.place == SHIFT]


def left_by_shifts(fitted: Fitted, period: float) -> float:
    """Share of the drive's torque that shifts of time leave behind."""
    return REST * max(map(abs, shifts_of(fitted.model))) / period


def shifted(hand: Round, floor: Array) -> Round:
    """Fit shifts of time beside the model in hand, both or one, where these make it likelier.

    Parameters
    ----------
    hand : Round
    floor : (k,) array
        Torque noise that is known to be there [N m].
    """
    if shift_knobs(hand.fitted):
        return hand
    stand, there = hand.stand, {use.term for use in hand.fitted.model.physics}
    step, most, late = (share * stand.scales.period for share in (FIRST, PART, LATE))
    names = [name for name in (NAMES if 1 in stand.system.rows else ("early",)) if NAMES[name] not in there]
    knobs = [Knob(SHIFT, name, step, -late if name == "early" else -most, most, is_size=False) for name in names]
    if not knobs:
        return hand
    moved = hand.misfit([knob.turn(hand.fitted.model, step) for knob in knobs]) - hand.fitted.residual
    scores, information = regressed(hand, moved)
    able = [knob for knob, gain in zip(knobs, 0.5 * scores**2 / information, strict=True) if gain > LEAST]
    for trial in (knobs, *([knob] for knob in able if len(knobs) > 1)) if able else ():
        found = settle(stand, hand.fitted.model, [*hand.fitted.knobs, *trial], floor)
        whole = all(FULL * knob.low < knob.read(found.fitted.model) < FULL * knob.high for knob in trial)
        if whole and likelier(found, hand) > LEAST and unshifted(found) is found:
            return found
    return hand


def unshifted(hand: Round) -> Round:
    """Take out shifts that terms which came later have made needless."""
    knobs = shift_knobs(hand.fitted)
    if not knobs:
        return hand
    rest = [knob for knob in hand.fitted.knobs if knob.place != SHIFT]
    fitted = fit_knobs(hand.misfit, turned(hand.fitted.model, knobs, np.zeros(len(knobs))), rest, 6)
    return around(hand, fitted) if fitted.cost - hand.fitted.cost < LEAST else hand


def named_by_shifts(fitted: Fitted) -> set[str]:
    """Terms that are longer shifts than those that are fitted, and have no place beside them."""
    return {NAMES[knob.name] for knob in shift_knobs(fitted)}


def is_clock(winner: Round) -> bool:
    """Whether the last term of a model is a shift of time that has a name."""
    return winner.fitted.model.physics[-1].term in NAMES.values()


def shifted_as(hand: Round, other: Round, floor: Array) -> Round:
    """Give `other` the shifts of time that the model in hand has."""
    knobs = shift_knobs(hand.fitted)
    model = turned(other.fitted.model, knobs, np.array([knob.read(hand.fitted.model) for knob in knobs]))
    return settle(other.stand, model, [*other.fitted.knobs, *knobs], floor)
