"""The controller's law, recomputed from the log: whether the recorded effort is what the recorded errors ask for.

The law involves no mechanics. What it cannot account for lies in the controller's gains, in the effort's own sensor or
limit, or in the clock between effort and measurement, and is settled before any physics is blamed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.model import Controller, JointModel
from gsfdi.reconcile.blind import BETWEEN, WHOLE, blind, instrumental
from gsfdi.reconcile.lagging import LAG, with_positions
from gsfdi.reconcile.sensing import believed_noise, effort_noise, logs_speed, sensor_variances
from gsfdi.reconcile.sheet import (
    BEGUN,
    NEARLY,
    Held,
    LawFinding,
    Log,
    Sheet,
    Windup,
    against,
    beside,
    centred,
    columns_of,
    hiss,
    level,
    likeliest,
    misfits,
    scaled,
    waiting,
    younger,
)
from gsfdi.types import Array, JointRecord, Mask

COARSE = 0.003
"""Share of the effort below which a misfit of the law is how it was sampled and held rather than what it is."""
ROUNDED = 1.5e-4
"""Distance from 1 up to which a ratio is arithmetic, however plain, and no gain that anybody has set.

Where rows are lost and the setpoint's rate is told by its slope, gains of sound loops came out off by 2e-5 and 1e-4.
"""


@dataclass(frozen=True, slots=True)
class LawCheck:
    """How the law held: misfit before and after [effort's unit], relative to the effort, and what was found."""

    before: float
    after: float
    effort: float
    noise: float
    findings: tuple[LawFinding, ...]
    derivative_delay: float = 0.0
    """Age of the speed that the controller must have had [s], where it is not logged; below 0 the logged one lags."""
    integral_rule: float = 0.5
    samples: int = 0

    @property
    def holds(self) -> bool:
        """Whether what is left is noise, or too small to matter."""
        return bool(self.after < max(1.5 * self.noise, 2 * COARSE * self.effort))

    @property
    def is_exact(self) -> bool:
        """Whether noise is all that is left of a law that was fed with what is logged."""
        return self.derivative_delay == 0.0 and self.after < EXACT * self.noise

    def likelier(self, other: "LawCheck") -> float:
        """Log-likelihood by which this law suits the recording better than another, each finding paid for."""
        gain = self.samples * float(np.log(other.after / max(self.after, 1e-12 * other.after)))
        return gain - SURE * (len(self.findings) - len(other.findings))


def check_law(records: Sequence[JointRecord], model: JointModel, most: int = 2) -> LawCheck | None:
    """Hold the recorded effort against the model's controller; None where either is missing.

    By which rule a controller sums its integral is nobody's fault, and no model says it: the likeliest is taken, where
    a law leaves nothing but noise.
    """
    found = checked(records, model, most)
    law = model.controller
    if found is None or law is None or law.integral == 0.0:
        return found
    others = (
        replace(model, controller=replace(law, integral_rule=rule)) for rule in RULES if rule != law.integral_rule
    )
    most = most if found.findings else 0  # by whatever rule, nothing is found where the model's own lacks nothing
    checks = [check for other in others if (check := checked(records, other, most)) is not None and check.is_exact]
    best = max(checks, key=lambda check: check.likelier(found), default=found)
    return best if best.likelier(found) > HARDLY else found


def checked(records: Sequence[JointRecord], model: JointModel, most: int) -> LawCheck | None:
    """Hold the recorded effort against the very law of the model; for the rest see `check_law`."""
    law = model.controller
    if law is None or not all("setpoint" in r for r in records):
        return None
    measured = logs_speed(records, model)
    pair = None if measured else blind(records, model)
    log = pair.log if pair is not None else Log(records, model)
    held = Held(log, law)
    if not held.sheets or not 0.5 < law.sample_rate * np.median(np.diff(held.sheets[0].t)) < 1.5:
        return None
    if not measured and law.derivative_delay == 0.0 and (age := speed_age(log, law)) > 0.0:
        law = replace(law, derivative_delay=age)
        held = Held(log, law)
    noise = effort_noise(model)
    noise = noise if noise > 0 and measured else max(noise, held.hiss)
    size = float(np.sqrt(np.mean(np.concatenate([s.effort for s in held.sheets]) ** 2)))
    before = held.left
    while len(held.findings) < most and not is_led_astray(held):
        trials = instrumental(held, pair.shown, COARSE * size) if pair is not None else []
        trials = [f for f in trials if f.gain > SURE]
        trials = trials or material(_believable(held, noise, measured), size, held, measured)
        trials = with_positions(trials, records, model)
        if not trials:
            break
        held = replace(held, findings=(*held.findings, likeliest(trials)))
    findings = tuple(f for f in held.findings if f.term != LAG)
    clocked = len(findings) < len(held.findings) or held.late > 0  # the noise of another moment hisses, too
    if measured and not clocked:
        noise = believed_noise(noise, hiss(held.shown))
    delay = held.aged.derivative_delay
    return LawCheck(before, held.left, size, noise, findings, delay, law.integral_rule, held.samples)


RULES = (0.0, 0.5, 1.0)
"""Shares of the newest error that integrals have counted: rectangles forward, trapezoids, rectangles backward."""

SURE = 25.0
"""Log-likelihood that a finding must gain."""
PLAINLY = 100.0
"""Log-likelihood from which a finding is sure however little of the misfit it is."""
HARDLY = 10.0
"""Log-likelihood by which another rule of the integral must suit a log better, and a less tightly drawn plateau."""
FLAT = 3.0
"""Spread of the effort at a limit, and its distance from it, over the law's misfit, up to which it is a plateau."""
WIDE = 0.3
"""The same as a share of the limit, however little the law can be told in noise."""
HIGH, ABOVE = 0.9, 5.0
"""Share of the efforts at a limit that lie above it by no more than so many times their sensor's noise."""
RULES_AT_A_LIMIT: tuple[Windup, ...] = ("rests", "unwinds", "goes_on")
"""What integrals do at a limit, in the order in which they are believed where all suit a log alike."""
DEPTHS = (0.998, 0.995, 0.98, 0.95)
"""Shares of the highest effort from which others are taken to lie at the same limit."""
SURPLUS = 5.0
"""Standard deviations by which the highest efforts are asked to be higher yet, where each is known to no better."""
HELD, STAY, PINNED = 4.0, 5, 50
"""Noises below a limit from which efforts are at it, samples in a row that are a stay, and all that are needed."""
OWN = 1e-3
"""Share of a limit by which it must lie below the law's own."""
MEDIAN = 1.2533
"""Standard deviations that a median of normal values has, over the root of their number."""
CLOSE = 2.2
"""Widths of their densest half within which nearly all normal values lie: three of their standard deviations."""
EXACT = 1.3
"""Misfit of a law, over the effort's noise, up to which the law is exact: one that is white is nothing else."""
WALKS = 3.0
"""Times what an integral strays in the end, one standard deviation, up to which a law may be off by that alone."""
WAITED = 0.03
"""Share by which an integral may seem off beside a limit: how long it waited there is known to a sample each time."""
SOON = 0.005
"""Ticks below which a delay is how samples were read and held."""
LEFT = 0.7
"""Ratio below which a part of the law that was scaled in noise is not believed."""
AGES = (0.0, 0.5, 1.0, 1.5, 2.0)
"""Ages of a speed that is taken from differences of positions, in ticks."""


def speed_age(log: Log, law: Controller) -> float:
    """Find the age of the speed [s] under which the law holds far better than under the speed of the moment, or 0."""

    def left(ticks: float) -> float:
        return Held(log, replace(law, derivative_delay=ticks / law.sample_rate)).left

    left_by = {ticks: left(ticks) for ticks in AGES}
    best = min(left_by, key=lambda ticks: left_by[ticks])
    return best / law.sample_rate if left_by[best] < 0.5 * left_by[0.0] else 0.0


def is_found(held: Held, term: str) -> bool:
    """Whether a term is among what was found of a law already."""
    return any(f.term == term for f in held.findings)


def material(found: Sequence[LawFinding], size: float, held: Held, measured: bool) -> list[LawFinding]:
    """Findings that matter; what a clock would explain better, however little it is off, is no gain of the law."""
    best = max(found, key=lambda f: f.gain, default=None)
    timely = measured and best is not None and not is_found(held, LAG) and not {"delay_s", "lag_s"} & best.values.keys()
    return [f for f in found if _matters(f, size, held, timely)]


def _matters(finding: LawFinding, size: float, held: Held, timely: bool) -> bool:
    """Whether a finding is larger than what sampling and holding may differ by, or plain all the same.

    A gain that is off by less has no name, but leaves a misfit for which physics would be blamed. Where a speed is
    logged, no right law of 68 joints gained 8 by any change, so that what is sure is so however small.
    """
    values = finding.values
    if "ratio" in values:
        waits = finding.term == "controller_integral" and is_found(held, "current_limit")
        least = WAITED if waits else COARSE if finding.gain < PLAINLY and not timely else ROUNDED
        return abs(values["ratio"] - 1) > max(least, 4 * finding.spread)
    if times := {"delay_s", "lag_s"} & values.keys():
        return values[times.pop()] * held.law.sample_rate > SOON
    return abs(values.get("bias_a", np.inf)) > COARSE * size


def _believable(held: Held, noise: float, measured: bool) -> list[LawFinding]:
    """Findings that account for most of the misfit, or for all of it that is no noise.

    Where the speed was differentiated from positions only the plainest are believed; so are limits beside a logged one
    that lags. One of 8 ms, read between samples, left a misfit by which a limit that two samples met gained 31. A limit
    to which efforts are pinned is believed however little it explains; so is what is sure beside a speed that is
    logged as it was, where the law leaves only noise.
    """
    found = [f for f in _hypotheses(held, measured) if f.gain > SURE]
    pinned = [f for f in found if f.term == "current_limit" and is_pinned(held, f)]
    plain = plainest(found, pinned)
    if not measured:
        found = plain
    elif is_found(held, LAG):
        found = [f for f in found if f in plain or f.term != "current_limit"]

    def least(finding: LawFinding) -> float:
        if held.left**2 * (1 - finding.share) >= (EXACT * noise) ** 2:
            return 0.5
        # a limit that is met for a few samples shows in nothing else
        sure = not is_found(held, LAG) or finding.term == "current_limit" or finding.gain > PLAINLY
        return 0.0 if sure else 0.05

    return [f for f in found if f.share > least(f) or f in pinned]


def plainest(found: Sequence[LawFinding], pinned: Sequence[LawFinding] = ()) -> list[LawFinding]:
    """Findings that the noise of slopes does not make.

    It draws what is scaled to nothing, which then seems to explain all. An integral that waits at a limit looks like a
    bias that sets in, and the other way round. What clips the highest efforts may be a speed that no model tells,
    unless they are `pinned` to the limit.
    """
    step = max((f.gain for f in found if f.onset is not None), default=0.0)
    waits = [f for f in found if f.term == "current_limit" and f.windup != "goes_on" and f.gain > step + HARDLY]
    plain = [f for f in found if f.share > 0.5 or f in waits or f in pinned]
    return [f for f in plain if not is_drawn(f)]


def is_drawn(finding: LawFinding) -> bool:
    """Whether a finding may be a part of the law that the noise of slopes drew to nothing.

    There is hardly any in a sum of errors. One that is worth half is believed where it explains nearly all; one of less
    than nothing, with 0.73 of the misfit, was a late stamp.
    """
    ratio = finding.values.get("ratio", 1.0)
    if finding.term == "controller_integral" and ratio > 0 and finding.share > WHOLE:
        return False
    return finding.term == "controller_derivative" or ratio <= LEFT


def _hypotheses(held: Held, measured: bool) -> list[LawFinding]:
    """Everything that the law could lack, with what each would gain; `measured` says whether the speed is logged."""
    if held.energy == 0.0:  # a twin whose sensors have no noise is the law to the last digit
        return []
    taken = {f.term for f in held.findings}
    found = []
    for term, parts in columns_of(held.sheets, held.findings).items():
        if term in taken or (measured and term == "position_gain"):
            continue
        bare = [centred(part, rows) for part, rows in zip(parts, held.free, strict=True)]
        info = float(sum(b @ b for b in bare))
        if info <= 0:
            continue
        slope = float(sum(b @ m for b, m in zip(bare, held.off, strict=True))) / info
        rest = held.energy - slope**2 * info
        spread = float(np.sqrt(max(rest, 0.0) / held.samples / info))
        found.append(scaled(term, slope, held.gain(rest), 1 - rest / held.energy, spread))
    steps = _steps(held)
    if not taken & {"current_bias", "current_limit"} and len({(r.source, r.t0_ns) for r in held.log.records}) == 1:
        found += steps
    if "timestamp_latency" not in taken:
        found.append(_clock(held, "timestamp_latency", "delay_s", lambda late: held.log.sheets(held.aged, late)))
    if measured and LAG not in taken:
        found.append(_clock(held, LAG, "lag_s", lambda lag: held.log.sheets(younger(held.aged, lag), held.late)))
    if "current_limit" not in taken:
        found += _limit(held, max((f.gain for f in steps), default=0.0))
    return found


def _steps(held: Held) -> list[LawFinding]:
    """A bias of the effort's sensor that sets in, by stretch of the recording: each begins at a level of its own."""
    found = []
    for sheet, off, rows in zip(held.sheets, held.off, held.free, strict=True):
        t, misfit = sheet.t[rows], off[rows]
        total = np.cumsum(misfit)
        n = len(misfit)
        k = np.arange(20, n - 20)
        if len(k) == 0:
            continue
        size = (total[-1] - total[k]) / (n - 1 - k) - total[k] / (k + 1)
        info = (k + 1) * (n - 1 - k) / n
        best = int(np.argmax(size**2 * info))
        rest = held.energy - float(size[best] ** 2 * info[best])
        onset = 0.5 * float(t[k[best]] + t[k[best] + 1])
        spread = float(np.sqrt(rest / held.samples / info[best]))
        gain = held.gain(rest) - float(np.log(held.samples))
        found.append(
            LawFinding("current_bias", {"bias_a": float(size[best])}, onset, gain, 1 - rest / held.energy, spread)
        )
    return found


def is_led_astray(held: Held) -> bool:
    """Whether what the law leaves is no more than its integral may be off where rows were lost.

    In it was the noise of each position that nobody logged, and to its walk any column that is slow is alike. Of sound
    joints that lost a twentieth of noisy rows one had a bias that set in, four of eight an integral gain of 0.1 to 0.6.
    """
    law = held.law
    steps = (np.round(np.diff(sheet.t) * law.sample_rate) for sheet in held.sheets)
    lost = max((float(np.maximum(step - 1.0, 0.0).sum()) for step in steps), default=0.0)
    if lost == 0.0 or law.integral == 0.0:
        return False
    noise = float(np.sqrt(sensor_variances(held.log.records, held.log.model)[0]))
    return held.left < WALKS * law.integral * noise / law.sample_rate * float(np.sqrt(lost))


def _clock(held: Held, term: str, name: str, sheets: Callable[[float], list[Sheet]]) -> LawFinding:
    """Measurements that came late into the log: the law holds between effort and what will be logged a little later."""
    period = 1.0 / held.law.sample_rate

    def rest(late: float) -> float:
        return float(sum(m @ m for m in misfits(sheets(late), held.findings)))

    best = min(np.array([0.01, 0.03, 0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0]) * period, key=rest)
    for width in (0.3, 0.1, 0.03, 0.01, 0.003):
        near = (best + step * width * min(period, best) for step in (-2, -1, 0, 1, 2))
        best = min((late for late in near if late > 0), key=rest)
    least = rest(best)
    bend = (rest(best * 1.05) + rest(best * 0.95) - 2 * least) / (0.05 * best) ** 2
    read = BETWEEN * min(period, best)
    spread = float(np.hypot(np.sqrt(2 * least / held.samples / bend), read)) if bend > 0 else best
    share = 1 - least / held.energy
    return LawFinding(term, {name: float(best)}, None, held.gain(least) - 3, share, spread)


def _limit(held: Held, step: float) -> list[LawFinding]:
    """A limit that the drive keeps although the law asks for more; for `step` see `_plateau`."""
    rules = RULES_AT_A_LIMIT if held.law.integral else RULES_AT_A_LIMIT[-1:]  # what sums nothing waits for nothing
    trials = (_plateau(held, depth, step, rule) for rule in rules for depth in DEPTHS)
    found = [f for f in trials if f is not None]
    most = max((f.gain for f in found), default=0.0)
    return next(([f] for f in found if f.gain > most - HARDLY), [])


def _plateau(held: Held, depth: float, step: float, windup: Windup) -> LawFinding | None:
    """A limit near which lie the efforts of more than `depth` times the highest; None where there is none.

    One that is hardly met shows in the integral that waits there (see `windup`), and in that only: a bias that sets in
    then must gain no more (`step`).
    """
    begun = np.concatenate([np.arange(len(s.t)) >= BEGUN for s in held.sheets])  # not where a gap may still be felt
    effort = np.concatenate([s.size for s in held.sheets]) * begun
    near = effort > depth * float(np.sort(effort)[-3])
    limit = float(np.median(effort[near]))
    over = _asked(held, limit, windup) > limit  # noise lifts the highest efforts above it, not those asked to be higher
    hardly = bool(np.mean(over[near]) < 0.3)
    if near.sum() < 3 or (hardly and (step < SURE or windup == "goes_on")):
        return None
    plain, at_it, width = over.sum() > 10, effort[near], max(float(np.std(effort[near])), 1e-9 * limit)
    if plain:
        at_it = effort[over]
        limit, width = densest(at_it), width / float(np.sqrt(near.sum()))
    limit, rest = _to_the_sample(held, limit, width, windup)
    beyond, errs, gain = _asked(held, limit, windup) - limit, float(np.sqrt(rest / held.samples)), held.gain(rest) + 2.0
    scatter = float(np.std(at_it)) if plain else max(width, errs)  # the highest few scatter less than their noise
    spread = MEDIAN * scatter / float(np.sqrt(len(at_it)))
    met = begun & ((beyond > 0) | _waits(held, limit, windup))
    missed = is_missed(effort[begun] - limit, beyond[begun], errs)
    if missed or not met.any() or is_no_plateau(effort[met], limit, errs, effort_noise(held.log.model)):
        return None
    hardly |= bool(np.median(beyond[met]) < errs and np.mean(beyond[near]) < SURPLUS * errs / np.sqrt(near.sum()))
    if hardly and not gain > step > SURE:  # what is asked for exceeds it by what the law errs, if at all
        return None
    if limit > held.sheets[0].limit - max(SURPLUS * spread, OWN * limit):
        return None
    share = float(1 - rest / held.energy)
    return LawFinding("current_limit", {"limit_a": limit}, None, gain, share, spread, windup)


def is_missed(off: Array, beyond: Array, errs: float) -> bool:
    """Whether most efforts are off a limit where the law asks surely for more, be it one of `errs`.

    A step of the position asks for far more, as a speed; whatever the effort was then had been a limit.
    """
    surely = np.abs(off)[beyond > SURPLUS * errs]
    return len(surely) > 0 and float(np.median(surely)) > FLAT * errs


def is_no_plateau(effort: Array, limit: float, errs: float, noise: float = 0.0) -> bool:
    """Whether efforts that should be at a limit scatter, or lie elsewhere, by more than the law's error or by much.

    Those that the law asked for less may lie below. None lies above it by more than its sensor's `noise`, where that
    is stated: at a bump of friction that no slope of noisy positions shows the highest efforts had seemed clipped.
    """
    off = max(float(np.std(effort)), abs(float(np.median(effort)) - limit))
    above = float(np.quantile(effort, HIGH)) - limit
    return off > min(FLAT * errs, WIDE * limit) or (noise > 0 and above > ABOVE * noise)


def is_pinned(held: Held, finding: LawFinding) -> bool:
    """Whether efforts stay at a limit with nothing but their sensor's noise, though the loop's own is larger elsewhere.

    What a speed that no model tells makes of a peak is not so flat: of 67 joints without a limit eleven stayed near
    their highest efforts for ten samples and more, which scattered by 1.2 to 1.7 times that noise; ten that met a limit
    for fifty and more, by 0.9 to 1.07.
    """
    noise, limit, at_it = effort_noise(held.log.model), finding.values["limit_a"], []
    for sheet in held.sheets:
        there = np.sign(sheet.effort) * (sheet.size > limit - HELD * noise)
        stays = np.split(np.arange(len(there)), np.flatnonzero(np.diff(there)) + 1)
        at_it += [sheet.size[stay[1:-1]] for stay in stays if there[stay[0]] and len(stay) >= STAY]
    values = np.concatenate([*at_it, np.zeros(0)])
    loud = hiss([sheet.effort for sheet in held.sheets]) > EXACT * noise > 0
    return loud and len(values) >= PINNED and float(np.std(values)) < (1.0 + 2.0 / np.sqrt(2.0 * len(values))) * noise


def densest(values: Array) -> float:
    """Middle of where values lie close: of those asked to be over a limit, the law's errors bring some from below."""
    values, half = np.sort(values), (len(values) + 1) // 2
    widths = values[half - 1 :] - values[: len(values) - half + 1]
    first = int(np.argmin(widths))
    close = np.abs(values - np.median(values[first : first + half])) <= CLOSE * widths[first]
    return float(np.median(values[close]))


def _asked(held: Held, limit: float, windup: Windup) -> Array:
    """Size of what the law asks for, sample by sample, beside a limit."""
    return np.abs(np.concatenate(_wanted(held, limit, windup)))


def _wanted(held: Held, limit: float, windup: Windup) -> list[Array]:
    """What the law asks for, by sheet, beside a limit."""
    pairs = [(s, against(s, _limited(held, limit, windup))) for s in held.sheets]
    return [np.asarray(s.effort - off + level(off, free)) for s, (off, free) in pairs]


def _waits(held: Held, limit: float, windup: Windup) -> Mask:
    """Samples at which the integral waits: it would have asked for more than a limit that what is left of it keeps."""
    if windup == "goes_on":
        return np.zeros(sum(len(s.t) for s in held.sheets), dtype=bool)
    added = [np.diff(waiting(s, limit, windup), prepend=np.nan) for s in held.sheets]
    return np.concatenate([(one == 0.0) & (s.growth != 0.0) for one, s in zip(added, held.sheets, strict=True)])


def _limited(held: Held, limit: float, windup: Windup) -> tuple[LawFinding, ...]:
    """Everything that was found of the law, and a limit beside it."""
    return (*held.findings, LawFinding("current_limit", {"limit_a": limit}, None, 0.0, 0.0, 0.0, windup))


def _to_the_sample(held: Held, limit: float, width: float, windup: Windup) -> tuple[float, float]:
    """Find the limit, within noise of `limit`, under which the integral waits at the right samples; and the misfit.

    One too few shifts all that the law asks for later. Samples at the limit cannot be held against a law that waits
    there, and count as the others do on average. Beside one that goes on they can, and are all that a limit shows in.
    """

    def left(trial: float) -> float:
        if windup == "goes_on":
            given = [np.clip(asked, -trial, trial) for asked in _wanted(held, trial, windup)]
            both = zip(held.sheets, given, strict=True)
            return float(sum(np.sum((sheet.effort - gets)[~sheet.unheld] ** 2) for sheet, gets in both))
        pairs = [against(sheet, _limited(held, trial, windup)) for sheet in held.sheets]
        off = [centred(*pair) for pair in pairs]
        return float(sum(m @ m for m in off)) * held.samples / max(sum(int(free.sum()) for _, free in pairs), 1)

    def likelihood(trial: float) -> float:
        return held.gain(left(trial)) - 0.5 * ((trial - limit) / width) ** 2

    best = limit
    for reach in (3.0, 0.25):
        best = float(max(best + reach * width * np.linspace(-1.0, 1.0, 25), key=likelihood))
    return best, left(best) if windup == "goes_on" else _rest(held, best, windup)


def _rest(held: Held, limit: float, windup: Windup) -> float:
    """Misfit beside a limit at which the integral waits; see `_to_the_sample`.

    Samples that only their sensor's noise lifts to the limit count, too. Left out, they took much noise with them: in
    300 sound joints one met a limit for that.
    """
    rest, count = 0.0, 0
    for sheet, asked in zip(held.sheets, _wanted(held, limit, windup), strict=True):
        _, free = against(sheet, _limited(held, limit, windup))
        counts = free | ~(sheet.unheld | beside(np.abs(asked) >= NEARLY * limit))
        rest += float(np.sum((sheet.effort - asked)[counts] ** 2))
        count += int(counts.sum())
    return rest * held.samples / max(count, 1)
