"""The controller's law where it tells the speed: what may be wrong of it, held against all that physics could do.

Whatever is suspected of the law is put right on trial, the speed told anew, and the parameters fitted. It is believed
if the recordings are likelier then than with the best of all terms; where both are as likely, the law comes first.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.compete import opening, rewritten
from gsfdi.reconcile.contract import Settled, read_log, settled_by
from gsfdi.reconcile.doubted import estimated
from gsfdi.reconcile.hand import Round, leaves_nothing, likelier, settle
from gsfdi.reconcile.law import SURE
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.offering import all_offers, possible
from gsfdi.reconcile.screen import Entry, refit, screen
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.reconcile.suspects import CLOCKS, gain_by, is_usable, suspects
from gsfdi.reconcile.twin import is_feigned
from gsfdi.types import JointRecord

ALIKE = 0.98
"""Share of what the best term gains from which what is wrong of the law could be it as well, and comes first."""
WORTH = 0.2
"""Share of what regression promises the best term that a suspicion must promise to be tried."""
RARER = float(np.log(0.3))
"""Prior odds that the scale of a sensor is off, against a gain of the law."""
MOST, FINER = 2, 3
"""Numbers of the law that may be wrong at once, and how often each is made more exact."""


@dataclass(frozen=True, slots=True)
class Opened:
    """Records and model with the contract put right, and the parameters fitted to them.

    Parameters
    ----------
    settled : Settled
    model : JointModel
        The settled one, with numbers that it doubts as the recordings have them.
    first : Round
        Parameters only.
    beyond : tuple of LawFinding
        What is wrong of the law besides what its own check found.
    """

    settled: Settled
    model: JointModel
    first: Round
    beyond: tuple[LawFinding, ...] = ()


Opener = Callable[[tuple[LawFinding, ...]], Opened]


def settle_law(
    records: Sequence[JointRecord], model: JointModel, terms: Mapping[str, PhysicsTerm], without: Sequence[str]
) -> Opened:
    """Settle the contract, and what only a told speed shows of the law, and open with the model that this gives."""
    read = read_log(records, model, without)

    def opened(beyond: tuple[LawFinding, ...]) -> Opened:
        settled = settled_by(read, beyond)
        begun = estimated(settled.stand, settled.model, effort_floor(settled.stand))
        return Opened(settled, begun, opening(settled.stand, begun, settled.level), beyond)

    found = opened(())
    for _ in range(MOST):
        better = max(better_ones(found, opened, terms, without), key=lambda pair: pair[0], default=None)
        if better is None:
            break
        found = better[1]
        if leaves_nothing(found.first, effort_floor(found.first.stand)):
            break  # a trifle more would be put in the place of what explains it all
    return replace(found, settled=fitted_gains(found.settled, found.first))


def better_ones(
    found: Opened, opened: Opener, terms: Mapping[str, PhysicsTerm], without: Sequence[str]
) -> Iterator[tuple[float, Opened]]:
    """Try what is suspected of the law, and give what is likelier than any term, with the log-likelihood it gains."""
    suspected, given = suspects(found.first), len(found.settled.model.physics)
    rival = best_term(found.first, terms, given) if suspected else None
    least = WORTH * rival.linear if rival is not None and is_usable(found.first) else 0.0
    for finding in suspected:
        if finding.term in without or finding.gain < least:
            continue
        # a clock comes alone: gains stood in for it
        anew = finding.term in CLOCKS and finding.term not in {f.term for f in found.beyond}
        if anew and found.beyond and finding.values["delay_s"] < 0:
            continue  # no speed is younger than now: that only mends the law that the others are wrong of
        other = opened((finding,) if anew else (*found.beyond, finding))
        for _ in range(FINER):
            again = [f for f in suspects(other.first, finding.term) if f.term == finding.term]
            if not again:
                break
            other = opened((*other.beyond, *again))
        gain = likelier_law(finding, other.first, found.first)
        better = is_better(gain, other.first, found.first, rival)
        if better and is_so_anyhow(finding, other.first, found.first, given) and not is_noise(finding, found):
            yield gain, other
            if "position_gain" not in without and (scale := scale_like(finding, other)) is not None:
                twin = opened((*found.beyond, scale))
                yield gain + RARER + twin.first.fitted.belief - other.first.fitted.belief, twin
            if leaves_nothing(other.first, effort_floor(other.first.stand)):
                return  # nothing is left to explain


def is_noise(finding: LawFinding, found: Opened) -> bool:
    """Whether a faint finding may be the work of noise."""
    plant, gain_of = found.first.fitted.model.plant, partial(gain_by, term=finding.term)
    return found.first.stand.lever > 0 and is_feigned(finding.gain, found.first, found.settled, plant, gain_of)


def scale_like(finding: LawFinding, found: Opened) -> LawFinding | None:
    """Give the scale of the positions that looks like a gain of the speed, where none is seen nor asked for.

    All that parts them is what is believed of the joint: its inertia, too, seems to be off by that scale.
    """
    law = found.model.controller
    if finding.term != "controller_derivative" or law is None or law.rate_feedforward != 0:
        return None
    ratio = np.prod([f.values["ratio"] for f in found.beyond if f.term == finding.term])
    return replace(finding, term="position_gain", values={"ratio": float(1 / ratio)})


def fitted_gains(settled: Settled, first: Round) -> Settled:
    """Read off the fit what it made of a gain that is in the model, too."""
    if settled.law is None or settled.stand.lever == 0:
        return settled
    fitted = {use.term: use.values for use in first.fitted.model.physics}
    findings = tuple(replace(f, values=fitted.get(f.term, f.values)) for f in settled.law.findings)
    return replace(settled, law=replace(settled.law, findings=findings))


def best_term(first: Round, terms: Mapping[str, PhysicsTerm], given: int) -> Entry | None:
    """Find the term that would account for most."""
    return next(iter(screen(first, all_offers(first, possible(first.stand, terms, 0.0), given)).entries), None)


def likelier_law(finding: LawFinding, other: Round, first: Round) -> float:
    """Log-likelihood that the opening gains by what a finding makes of it."""
    if other.stand.lever == 0:  # the data are no longer the same
        return finding.gain
    first = over_the_same(first, other)
    return likelier(other, first) + 0.5 * first.stand.told * float(np.log(other.stand.lever / first.stand.lever))


def over_the_same(first: Round, other: Round) -> Round:
    """Give the round in which no samples count but those that do in another, which may have left some out."""
    stand, rows = first.stand, len(first.stand.system.rows)
    used = [r.t[other.stand.awake(i)[::rows] > 0] for i, r in enumerate(other.stand.records)]
    counts = tuple(
        stand.awake(i) * np.repeat(np.isin(r.t, np.concatenate(used)), rows) for i, r in enumerate(stand.records)
    )
    return replace(first, stand=replace(stand, counts=counts))


def is_so_anyhow(finding: LawFinding, other: Round, first: Round, given: int) -> bool:
    """Whether a law is likelier also where the terms that the model came with are written as suits the recordings best.

    A friction that turned round over 5e-4 rad/s, and in the model at once, made a current's gain of 1.01 gain 158; with
    the friction so written there were 433 without it. All of 25 such gains that sound joints had been given went so.
    """
    restated = rewritten(first, given, effort_floor(first.stand))
    if restated is first:
        return True
    if other.stand.lever == 0:
        return finding.gain > likelier(restated, first)
    return likelier_law(finding, rewritten(other, given, effort_floor(other.stand)), restated) > SURE


def is_better(gain: float, other: Round, first: Round, rival: Entry | None) -> bool:
    """Whether a law that gains so much is likelier than what the best term makes of the opening, or as likely."""
    floor = effort_floor(first.stand)
    if gain < SURE or rival is None:
        return gain >= SURE
    if other.stand.lever == 0 or (gain > rival.linear and leaves_nothing(other, floor)):
        return gain > rival.linear
    fitted = refit(first, rival).fitted
    if fitted is None:
        return gain > rival.linear
    settled = settle(first.stand, fitted.model, fitted.knobs, floor)
    return gain > ALIKE * likelier(over_the_same(settled, other), over_the_same(first, other))
