"""What a finalist of a round must pass: the bar of chance, its own shadow, and a size worth a name."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gsfdi.fit import Fitted, Knob, turned
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.calibrate import bar, inflations
from gsfdi.reconcile.drifting import position_of
from gsfdi.reconcile.hand import Round, is_sensor, leaves_nothing, likelier, settle, with_term
from gsfdi.reconcile.offering import MATERIAL, SIMULATED
from gsfdi.reconcile.parameters import ended
from gsfdi.reconcile.remainder import torque_between
from gsfdi.reconcile.screen import (
    EARLIEST,
    LEAST,
    ONSETS,
    Entry,
    Screening,
    likeliest,
    onset_cost,
    refined_onset,
    stand_times,
)
from gsfdi.reconcile.ticks import left_by_shift
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.registry import shelf
from gsfdi.scales import Scales
from gsfdi.types import Array

FINALISTS = 8
"""Entries that are refitted, besides those that only come before another form of their term."""
KNOB_COST = 4.0
"""Log-likelihood that each number of a term must earn: half the logarithm of the number of samples, nearly."""
CHANCE = 0.005
"""Probability that chance alone makes one of all offers a winner."""
NET = 3.5e-4
"""Torque, as a share of the drive's, that only a model with the term has, whatever its other numbers.

Two simulators of one joint differ by up to 2.7e-4 where it reverses often and fast; the faintest effects that are seen
in their own right make 8e-4.
"""
PLAIN = 100.0
"""Merit beyond which a finalist is no faint one."""
BURST, LOUD = 10, 3.0
"""Samples of a burst, and its power over that of all that is left, beside which a term may have set in."""
NEARBY = np.linspace(-3.0, 3.0, 25)
"""Samples by which an onset may be off that was looked for by shares of the recording."""
UNPROMISED = 2.0
"""How many times what the regression promised a faint finalist may gain."""
SLIP, SEEN, SLOW = 10.0, 2.0, 1.0
"""Times the noise of the position by which a joint may slip without that being seen, and where its speed is logged;
there, a slip that takes so long [s] may hide in the noise of the speed."""
AGAINST = 4.0
"""Log-likelihood that a step of the position may lose, by chance, at the sample that shows it first."""
LINEAR = {
    *("output_inertia_change", "motor_inertia_change", "stiffness_change", "torque_constant_change"),
    *("viscous_friction", "gearbox_damping", "gearbox_hysteresis", "structural_mode", "actuation_delay"),
}
"""What makes another linear joint, or nearly one: noise that goes round a loop looks like it."""
ENDS = {
    ("gearbox_hysteresis", "width_rad"): ("high",),
    ("position_dependent_friction", "width_rad"): ("low", "high"),
    ("presliding_friction", "stiffness_nm_rad"): ("low",),
    ("shear_thinning_friction", "velocity_rad_s"): ("low",),
    ("stribeck_friction", "velocity_rad_s"): ("high",),
    ("structural_mode", "damping_ratio"): ("high",),
    ("structural_mode", "frequency_hz"): ("high",),
}
"""Ends of a number at which a term has another name: a bristle that never slips, a spot that is as wide as the way or
passed in a moment, drag that is there at once, an excess that never fades, a mode that does not ring, or faster than
the log could show."""
TURNED = 5.0
"""Times the speed of a smooth friction within which its laws differ."""
TURNED_BY = 0.1
"""Share of that friction by which they do: beyond three times that speed an arctangent is a tenth below a tanh."""


def distinct(entries: Sequence[Entry], most: int, onsets: bool = True) -> list[Entry]:
    """The best entry of each term and side; with `onsets` of those that set in apart from those that do not."""
    seen: dict[tuple[str, str | None, bool], Entry] = {}
    for entry in entries:
        seen.setdefault((entry.offer.term, entry.offer.side, onsets and entry.onset is None), entry)
    return list(seen.values())[:most]


def finalists_of(entries: Sequence[Entry]) -> list[Entry]:
    """The best `FINALISTS` entries, and before each that sets in the same term from the start, however far behind.

    By regression a term from the start may trail all its forms that set in, and lead once both are refitted.
    """
    every = distinct(entries, len(entries))
    always = {(e.offer.term, e.offer.side): e for e in every if e.onset is None}
    found: list[Entry] = []
    for entry in every[:FINALISTS]:
        for one in (always.get((entry.offer.term, entry.offer.side), entry), entry):
            if not any(one is other for other in found):
                found.append(one)
    return found


def beside_ends(entries: Sequence[Entry], hand: Round, floor: Array) -> list[Entry]:
    """Lay out the changes of those numbers of the plant that are as far off in `hand` as they are believed to be.

    A number that may go no further lets the noise grow to suit it, under which its change seems to gain next to
    nothing: an inertia off by 8.9 %, which 8 % were to stand for, was promised 15 and gained 70 in the end.
    """
    if leaves_nothing(hand, floor):
        return []
    ends = ended(hand.fitted)
    return [entry for entry in entries if entry.offer.term in ends and entry.onset is None]


def credible(hand: Round, screening: Screening, finalists: Sequence[Entry]) -> list[Entry]:
    """Finalists with their bars, best first, without a sensor's error that leads them all and yet may be chance.

    Where what is left is no white noise, a scale of the position detunes the observer to suit it. The bars of all the
    others would be those of what it leaves.
    """
    ranked = calibrated(hand, screening, sorted(finalists, key=merit, reverse=True))
    if len(ranked) < 2 or not is_chance(ranked[0]):
        return ranked
    return credible(hand, screening, [e for e in finalists if e.offer.term != ranked[0].offer.term])


def is_chance(entry: Entry) -> bool:
    """Whether a finalist is an error of a sensor that gains no more than chance may."""
    return is_sensor(entry.offer.term) and entry.gain < entry.bar


def calibrated(hand: Round, screening: Screening, ranked: Sequence[Entry]) -> list[Entry]:
    """Give each finalist the bar that it must pass, under what the best of them leaves."""
    if not ranked or ranked[0].fitted is None:
        return []
    times = inflations(screening.bare, screening.information, ranked[0].fitted.residual, hand.stand.blocks())
    found = []
    for entry in ranked:
        own = float(np.max(times[slice(*entry.rows)], initial=1.0))
        found.append(replace(entry, inflation=own, bar=_bar(entry, own, len(times))))
    return found


def fairly(hand: Round, entry: Entry, shelf_terms: Mapping[str, PhysicsTerm]) -> Entry:
    """Take off a finalist what its term gains by being written into the model, were it nothing.

    A model with a spring or a delay that is no plain number is stepped otherwise than one without. Where the effort is
    known exactly that alone, with the numbers in hand fitted anew, may suit a recording better by tens. So may numbers
    gone far along a direction in which nothing is felt, through the moments at which a joint sticks and slips; the
    regression had promised none of it.
    """
    fitted = entry.fitted
    if fitted is None or merit(entry) > PLAIN:
        return entry
    entry = replace(entry, gain=min(entry.gain, UNPROMISED * entry.linear))
    use = idle(fitted.model.physics[-1], shelf_terms)
    if use is None or merit(entry) < LEAST:
        return entry
    start = turned(hand.fitted.model, hand.fitted.knobs, fitted.values[: len(hand.fitted.knobs)])
    written = fit_knobs(hand.misfit, with_term(start, use), hand.fitted.knobs, 3, hand.fitted.jacobian)
    return replace(entry, gain=entry.gain - max(hand.fitted.cost - written.cost, 0.0))


def idle(use: TermUse, shelf_terms: Mapping[str, PhysicsTerm]) -> TermUse | None:
    """Give a term with the number that sizes it at nothing."""
    size = shelf_terms[use.term].params[0]
    return None if size.neutral is None else replace(use, values={**use.values, size.name: size.neutral})


def needed(ranked: Sequence[Entry]) -> list[Entry]:
    """Finalists without those that set in to no purpose: the same term from the start has as much merit."""
    always = {(e.offer.term, e.offer.side): merit(e) for e in ranked if e.onset is None}
    return [e for e in ranked if e.onset is None or merit(e) > always.get((e.offer.term, e.offer.side), -np.inf)]


def matters(hand: Round, entry: Entry) -> bool:
    """Whether a fitted term is large enough for a name: a torque must be, an error of what is seen need only be sure.

    An error of the current is as good as a torque; a step of the position that noise hides, as good as a slip. A drift
    must come to more than what simulating leaves in the number that drifts. And a torque must be more than the effort
    may be off by where an unknown law was learnt for it, or its noise goes round a loop that nobody knows.
    """
    if entry.fitted is None:
        return False
    values = entry.fitted.model.physics[-1].values
    if entry.offer.term == "position_bias":
        return abs(values["bias_rad"]) > unslipped(hand.stand, entry.onset)
    if entry.offer.term == "torque_constant_drift":
        drifts_for = hand.stand.scales.seconds - max(values["onset_s"], entry.onset or 0.0)
        if abs(values["rate_per_s"]) * drifts_for < SIMULATED:
            return False
    if is_sensor(entry.offer.term) and not entry.offer.term.startswith("current_"):
        return True
    model = entry.fitted.model  # the term by itself: beside it, numbers of the plant may have moved by much more
    alone = torque_between(hand.stand, replace(model, physics=model.physics[:-1]), model)[0]
    doubt = hand.stand.learnt + (hand.stand.looped if entry.offer.term in LINEAR else 0.0)
    least = NET + left_by_shift(entry.fitted, hand.stand.scales.period) + doubt
    return bool(alone > MATERIAL + doubt) and size_of(hand, entry.fitted) > least


def unslipped(stand: Bench, onset: float | None) -> float:
    """Step of the position [rad] from which on it is none of a joint that slips, which no model foresees."""
    most, noise = SLIP * stand.scales.noise, SEEN * stand.scales.noise
    if travels(stand, onset):
        return noise
    if not stand.sees_speed:
        return most
    row = list(stand.system.rows).index(1)
    speed = np.sqrt(stand.system.R[row] * stand.scales.period * SLOW) / np.max(np.abs(stand.system.C[row]))
    return min(most, max(noise, SEEN * float(speed)))


def travels(stand: Bench, onset: float | None) -> bool:
    """Whether the joint moves just before and just after `onset` [s], as none does that slips: it must have stuck."""
    if onset is None:
        return False
    for record in stand.records:
        position, k = position_of(record), int(np.searchsorted(record.t, onset))
        before, after = position[max(k - BURST, 0) : k], position[k : k + BURST]
        if min(len(before), len(after)) == BURST:
            return bool(min(np.ptp(before), np.ptp(after)) > SLIP * stand.scales.noise)
    return False


def shows_at_once(settled: Round) -> bool:
    """Whether the first sample that is seen after a step of the position does not speak against it.

    A joint turned round in a row that was lost, and stuck elsewhere than the model did: a step of the position came to
    stand for it, which gained 38 over the half second after, and lost 16 where it set in.
    """
    model = settled.fitted.model
    if model.physics[-1].term != "position_bias" or model.physics[-1].onset is None:
        return True
    bare = settled.misfit([replace(model, physics=model.physics[:-1])])[0]
    since = stand_times(settled.stand) >= model.physics[-1].onset
    first = np.flatnonzero(since & ((bare != 0) | (settled.fitted.residual != 0)))[: len(settled.stand.system.rows)]
    lost = 0.5 * float(np.sum(settled.fitted.residual[first] ** 2 - bare[first] ** 2))
    return lost < AGAINST


def is_at_bound(fitted: Fitted, shelf_terms: Mapping[str, PhysicsTerm]) -> bool:
    """Whether the last term would be more than is plausible, or stretches a detail of another term as far as may be.

    So stretched a detail stands for what has a name of its own.
    """
    return is_stretched(fitted) or has_ended(fitted, shelf_terms, len(fitted.model.physics) - 1)


def has_ended(fitted: Fitted, shelf_terms: Mapping[str, PhysicsTerm], place: int) -> bool:
    """Whether the size of the term at `place`, or what it slips over, may go no farther."""
    term = fitted.model.physics[place].term
    size = shelf_terms[term].params[0]

    def ends(knob: Knob) -> list[float]:
        if knob.name == size.name:
            return [end for end in (knob.low, knob.high) if end != size.neutral]
        return [getattr(knob, end) for end in ENDS.get((term, knob.name), ())]

    return any(
        knob.place == place and any(knob.is_at(end, value) for end in ends(knob))
        for knob, value in zip(fitted.knobs, fitted.values, strict=True)
    )


def never_slips(use: TermUse, scales: Scales) -> bool:
    """Whether a bristle bends the whole way of the joint without ever letting go, and so is a spring."""
    if use.term != "presliding_friction":
        return False
    return use.values["torque_nm"] > 2.0 * scales.reach * use.values["stiffness_nm_rad"]


def only_turns(model: JointModel, at_once: float = 0.0) -> bool:
    """Whether the last term only mends how a friction turns round, which simulators do in several ways.

    It is small beside that friction and changes within the speeds over which that turns, or nearly. One that turns
    round at once does so within a step of its simulator, over the speed that the joint gains `at_once` [rad/s].
    """
    use, terms = model.physics[-1], shelf("gsfdi.terms", PhysicsTerm)
    if "velocity_rad_s" not in use.values:
        return False
    size = max(abs(value) for name, value in use.values.items() if name.endswith("_nm"))
    return any(
        use.values["velocity_rad_s"] < max(TURNED * other.values.get("smooth_rad_s", 0.0), at_once)
        and size < TURNED_BY * abs(other.values.get("torque_nm", 0.0))
        for other in model.physics[:-1]
        if terms[other.term].place == "dry"
    )


def is_stretched(fitted: Fitted) -> bool:
    """Whether a detail has gone as far as is plausible."""
    return bool(stretched_knobs(fitted))


def stretched_knobs(fitted: Fitted) -> list[Knob]:
    """Details that have gone as far as is plausible."""
    terms = shelf("gsfdi.terms", PhysicsTerm)
    return [
        knob
        for knob, value in zip(fitted.knobs, fitted.values, strict=True)
        if knob.place >= 0
        and terms[fitted.model.physics[knob.place].term].param(knob.name).kind == "detail"
        and knob.is_at(knob.high, value)
    ]


def size_of(hand: Round, fitted: Fitted) -> float:
    """Torque that a fitted model has and the one in hand lacks, root mean square, as a share of the drive's."""
    return float(torque_between(hand.stand, hand.fitted.model, fitted.model)[0])


def merit(entry: Entry) -> float:
    """Gain in log-likelihood less what its numbers cost."""
    return entry.gain - cost_of(entry) if np.isfinite(entry.gain) else -np.inf


def cost_of(entry: Entry) -> float:
    """Log-likelihood that the numbers of an entry must earn."""
    return KNOB_COST * (len(entry.offer.columns[0]) + (2 if entry.onset is not None else 0))


def settled_onset(hand: Round, place: int, floor: Array) -> Round:
    """Move the onset of the term at `place` under the noise that now suits it, a wrong one being noise itself.

    One near the beginning is dropped where that is likelier: what is wrong before it is much where else all is right.
    """
    use = hand.fitted.model.physics[place]
    if use.onset is None:
        return hand
    if use.onset < EARLIEST * hand.stand.scales.seconds:
        model = hand.fitted.model.with_use(place, replace(use, onset=None))
        always = settle(hand.stand, model, hand.fitted.knobs, floor)
        if likelier(always, hand) > 0:
            return always
    begun = begun_elsewhere(hand, place)
    fitted = refined_onset(hand, begun, place, hand.stand.scales.seconds / ONSETS, rounds=4)
    fitted = to_the_moment(hand, fitted, place)
    if fitted.cost > hand.fitted.cost - KNOB_COST:
        return hand
    return settle(hand.stand, fitted.model, fitted.knobs, floor)


def begun_elsewhere(hand: Round, place: int) -> Fitted:
    """Let the term at `place` set in where what is left nearby is loudest, or anywhere else, if it is likelier there.

    A spring that gives way sets the gearbox ringing: beginning half a swing later only makes it louder, and a moment at
    which the joint rests is better than all but the true one. One was 0.74 s late, for 470, and a step of the position
    stood where it was. A friction of three times the drive's torque was 23 s early, while the joint rested, for 1,350.
    """
    seconds = hand.stand.scales.seconds
    moments = np.concatenate([np.linspace(EARLIEST, 1 - EARLIEST, ONSETS) * seconds, loud_moments(hand, place)])
    return begun_at(hand, hand.fitted, place, moments)


def to_the_moment(hand: Round, fitted: Fitted, place: int) -> Fitted:
    """Move the onset of the term at `place` by parts of a sample to the likeliest nearby.

    Beside a friction of half the drive's torque that came 4 ms late, a stiffness that changed by 0.9 % gained 730.
    """
    onset = fitted.model.physics[place].onset
    assert onset is not None
    return begun_at(hand, fitted, place, onset + hand.stand.scales.period * NEARBY)


def begun_at(hand: Round, fitted: Fitted, place: int, moments: Array) -> Fitted:
    """Let the term at `place` set in at the likeliest of some moments [s], unless all are less likely than its own."""
    cost, model = likeliest(hand, fitted.model, place, "onset", moments.tolist())
    return fit_knobs(hand.misfit, model, fitted.knobs, 2) if cost < fitted.cost else fitted


def loud_moments(hand: Round, place: int) -> Array:
    """Samples about the loudest of what is left near the onset of the term at `place`, if it is loud."""
    t, onset = stand_times(hand.stand), hand.fitted.model.physics[place].onset
    assert onset is not None
    rows = len(hand.stand.system.rows)
    power = np.convolve(hand.fitted.residual**2, np.ones(BURST * rows) / (BURST * rows), "same")
    within = np.abs(t / hand.stand.scales.seconds - 0.5) < 0.5 - EARLIEST
    near = within & (np.abs(t - onset) < 2 * hand.stand.scales.seconds / ONSETS)
    if not near.any() or np.max(power[near]) < LOUD * np.mean(power):
        return np.zeros(0)
    loudest = float(t[near][np.argmax(power[near])])
    return np.asarray(loudest + hand.stand.scales.period * (np.arange(-BURST, BURST + 1) + 0.5))


def settled_bar(settled: Round, entry: Entry, trials: int) -> float:
    """Bar that an entry must pass once it is settled.

    What acts in a few blocks of time only, as a stop does, leaves misfits there until its numbers are right, and these
    make chance seem able to do as much.
    """
    fitted = settled.fitted
    own = np.array([knob.place == len(fitted.model.physics) - 1 for knob in fitted.knobs])
    rest, columns = fitted.jacobian[:, ~own], fitted.jacobian[:, own]
    bare = columns - rest @ np.linalg.lstsq(rest, columns, rcond=1e-9)[0]
    times = inflations(bare.T, np.sum(bare**2, axis=0), fitted.residual, settled.stand.blocks())
    return _bar(entry, float(np.max(times, initial=1.0)), trials)


def _bar(entry: Entry, inflation: float, trials: int) -> float:
    return max(LEAST, bar(inflation, trials, CHANCE)) + onset_cost(entry)
