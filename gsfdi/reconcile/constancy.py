"""Whether a size that was found is a constant: as large slow as fast, one way as the other, early as late.

What stands for something else suits one half of a recording better than the other. Where its slopes are split in two
by a condition, the half that the rest of the model cannot take over says how much larger it would be there. Of 50
terms that were rightly named no other size gained more than 8, but for a backlash: a linear observer of a gearbox that
plays makes noise of its own. Of two gearboxes that creep, told as a hysteresis, it gained 32 and 36, a twentieth and a
tenth off.
"""

from collections.abc import Mapping

import numpy as np

from gsfdi.channels import CHANNELS
from gsfdi.fit import Knob
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import Round, plays, regressed
from gsfdi.reconcile.locate import covariates
from gsfdi.types import Mask

SURE = 15.0
"""Log-likelihood that two sizes must gain upon one."""
APART = 0.03
"""Share of a size by which they must differ: a law may be written in more than one way."""
TOLD = 1e-6
"""Share of what a half tells that the rest of the model cannot take over, from which that is more than rounding."""
THIRDS = (1 / 3, 0.5, 2 / 3)
"""Shares of the samples below which a joint is slow."""


def inconstant(hand: Round, given: int, terms: Mapping[str, PhysicsTerm]) -> list[tuple[str, str]]:
    """Find terms beyond the first `given` whose size is another in one half of the samples than in the other.

    None where the gearbox plays.

    Parameters
    ----------
    hand : Round
        A model with its terms, fitted, with slopes.
    given : int
        Terms of the nominal model.
    terms : mapping of str to PhysicsTerm
        The library.

    Returns
    -------
    list of tuple
        Each such term, and where its size is another.
    """
    if plays(hand.fitted.model):
        return []
    fitted, found = hand.fitted, []
    where, halved = zip(*halves(hand.stand), strict=True)
    masks = np.repeat(np.array(halved, dtype=np.float64), len(hand.stand.system.rows), axis=1)
    for i, (knob, value) in enumerate(zip(fitted.knobs, fitted.values, strict=True)):
        size = found_size(knob, value, given, hand, terms)
        if size == 0.0:
            continue
        parts = fitted.jacobian[:, i] * masks
        score, information = regressed(hand, parts)
        gains, changes = 0.5 * score**2 / information, score / information * knob.scale / size
        told = (information > TOLD * np.sum(parts**2, axis=1)) & (np.abs(changes) > APART)
        most = int(np.argmax(np.where(told, gains, 0.0)))
        if told[most] and gains[most] > SURE:
            found.append((fitted.model.physics[knob.place].term, where[most]))
    return found


def found_size(knob: Knob, value: float, given: int, hand: Round, terms: Mapping[str, PhysicsTerm]) -> float:
    """Distance of a found term's size from where it does nothing; 0 for any other knob and for one at its end."""
    if knob.place < given or not knob.low < value < knob.high:
        return 0.0
    size = terms[hand.fitted.model.physics[knob.place].term].params[0]
    return float(value - (size.neutral or 0.0)) if knob.name == size.name else 0.0


def halves(stand: Bench) -> list[tuple[str, Mask]]:
    """Halves ``(n,)`` of all samples, with what they have in common; of slow ones a third and two thirds as well."""
    rows = covariates(stand)
    named = {name: np.concatenate([row[name] for row in rows]) for name in rows[0] if all(name in row for row in rows)}
    speed = named[CHANNELS["motor_velocity"].column(stand.model.axis)]
    others = {
        "where it moves back": speed,
        "in one half of its way": named[CHANNELS["position"].column(stand.model.axis)],
        "in the earlier half": np.arange(len(speed), dtype=np.float64),
    }
    if "temperature_c" in named:
        others["where it is cool"] = named["temperature_c"]
    slow = [("where the joint is slow", np.abs(speed) < np.quantile(np.abs(speed), share)) for share in THIRDS]
    return slow + [(name, other < np.nanmedian(other)) for name, other in others.items()]
