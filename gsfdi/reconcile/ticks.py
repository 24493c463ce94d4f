"""The shift of time that a simulator leaves in a log that it makes in steps, and of which no model says anything.

One that steps the speed and then the angle with it logs a speed that is old by half its step, and lets each effort act
as much too early; one that steps the angle first, as much too young and too late. Of forty joints simulated in such
steps of a hundredth of a tick ten were given a sensor's fault or a delay that they do not have, a fault-free one among
them. So the one number is fitted beside those of the plant and has no name.

Both shifts are one: of joints in steps of a fifth, a tenth and a twentieth of a tick they were fitted apart, and came
out within 2 % of each other where no friction was missing, of half a step. A speed alone that is old has a filter, an
effort alone that is late has a delay, however little; a tolerance for either apart, of a seventh of a tick, left all of
four joints whose speed lags by less than that without its name.
"""

from dataclasses import replace

from gsfdi.fit import SHIFT, Fitted, Knob, Started
from gsfdi.model import JointModel, TermUse
from gsfdi.reconcile.hand import Round, around, leaves_nothing, likelier, regressed, settle, with_term
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.types import Array

CLOCKS = {"actuation_delay", "velocity_lag"}
"""Terms that shift one signal alone in time."""
PART = 0.15
"""Ticks up to which a shift may be a simulator's; an arm of which it is 0.16 has a filter, whatever its efforts do."""
LATE = 0.1
"""The same of an effort that acts late where no speed is logged, so that it may as well be a delay."""
FULL = 0.95
"""Share of these from which a fitted shift is taken to be a longer one that was cut off."""
FIRST = 0.02
"""Ticks of a shift that matters."""
LEAST = 8.0
"""Log-likelihood that a shift must gain, and by which a lag or a delay must be likelier than neither."""
NEARLY = 0.9
"""Share of what a lag or a delay gains from which a shift is as good: the steps themselves are in neither."""
REST = 0.05
"""Share of the drive's torque, per tick of a shift, that fitting it leaves: it is drawn straight between samples."""

READ = 0.005
"""Standard deviation, in ticks, of what simulators differ by in when samples are read and efforts act."""


def shift_of(model: JointModel) -> float:
    """Time by which efforts act before their stamps and speeds are older than theirs [s]."""
    return model.shift if isinstance(model, Started) else 0.0


def left_by_shift(fitted: Fitted, period: float) -> float:
    """Share of the drive's torque that a shift of time leaves behind."""
    return REST * abs(shift_of(fitted.model)) / period


def shifted(hand: Round, floor: Array) -> Round:
    """Fit a shift of time beside the model in hand, where that makes it likelier and nothing shifts one signal alone.

    Parameters
    ----------
    hand : Round
    floor : (k,) array
        Torque noise that is known to be there [N m].
    """
    held = any(knob.place == SHIFT for knob in hand.fitted.knobs)
    if held or CLOCKS & {use.term for use in hand.fitted.model.physics}:
        return hand
    knob = shift_knob(hand)
    moved = hand.misfit([knob.turn(hand.fitted.model, knob.scale)]) - hand.fitted.residual
    scores, information = regressed(hand, moved)
    if 0.5 * scores[0] ** 2 / information[0] < LEAST:
        return hand
    found = settle(hand.stand, hand.fitted.model, [*hand.fitted.knobs, knob], floor)
    shift = knob.read(found.fitted.model)  # of nothing where only other numbers were settled anew
    whole = shift != 0.0 and FULL * knob.low < shift < FULL * knob.high
    return found if whole and likelier(found, hand) > LEAST and unshifted(found) is found else hand


def shift_knob(hand: Round) -> Knob:
    """Knob of the shift, in the bounds in which it is none of anything else."""
    low, high = (-PART if 1 in hand.stand.system.rows else -LATE, PART)
    period = hand.stand.scales.period
    return Knob(SHIFT, "shift", FIRST * period, low * period, high * period, is_size=False)


def unshifted(hand: Round) -> Round:
    """Take out a shift that terms which came later have made needless."""
    if not shift_of(hand.fitted.model):
        return hand
    (knob,) = (knob for knob in hand.fitted.knobs if knob.place == SHIFT)
    rest = [knob for knob in hand.fitted.knobs if knob.place != SHIFT]
    fitted = fit_knobs(hand.misfit, knob.turn(hand.fitted.model, 0.0), rest, 6)
    return around(hand, fitted) if fitted.cost - hand.fitted.cost < LEAST else hand


def moot_by_shift(fitted: Fitted) -> set[str]:
    """Terms that have no place beside a shift that is fitted."""
    return CLOCKS if shift_of(fitted.model) else set()


def is_as_likely(timed: Round, winner: Round, hand: Round, floor: Array) -> bool:
    """Whether a shift goes before the winner of a contest: it gains more, or nearly as much as one that is a clock."""
    if winner.fitted.model.physics[-1].term in CLOCKS:
        return likelier(timed, hand) > share_of(winner, timed, floor) * likelier(winner, hand)
    return likelier(timed, winner) > 0


def share_of(clock: Round, timed: Round, floor: Array) -> float:
    """Share of what a lag or a delay gains from which a shift is as good: all of it where only the former explains all.

    A lag of the speed of a sixteenth of a tick, no law given, was a shift by nine tenths and left nine times the noise.
    """
    return 1.0 if leaves_nothing(clock, floor) and not leaves_nothing(timed, floor) else NEARLY


def is_of_one_signal(hand: Round, floor: Array) -> bool:
    """Whether the shift of the model in hand is that of speeds alone, or of efforts alone."""
    stepped, shift = hand.fitted.model, shift_of(hand.fitted.model)
    if not isinstance(stepped, Started) or not shift:
        return False
    use = TermUse("velocity_lag", {"lag_s": shift}) if shift > 0 else TermUse("actuation_delay", {"delay_s": -shift})
    bare = replace(stepped, shift=0.0)
    model, rest = with_term(bare, use), [knob for knob in hand.fitted.knobs if knob.place != SHIFT]
    alone = settle(hand.stand, model, [*rest, *term_knobs(hand.stand, model, len(model.physics) - 1)], floor)
    neither = settle(hand.stand, bare, rest, floor)
    share = share_of(alone, hand, floor)
    return share * likelier(alone, neither) > max(likelier(hand, neither), LEAST)


def shifted_as(hand: Round, other: Round, floor: Array) -> Round:
    """Give `other` the shift of time that the model in hand has."""
    knob = shift_knob(hand)
    model = knob.turn(other.fitted.model, shift_of(hand.fitted.model))
    return settle(other.stand, model, [*other.fitted.knobs, knob], floor)
