"""Every offer against what is left: by linear regression for all of them, by replay for the best."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.signal import fftconvolve

from gsfdi.fit import Fitted, Knob, turned
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import Round, orthonormal, regressed, sticks, with_term
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.reconcile.offer import Offer
from gsfdi.reconcile.stops import pressed
from gsfdi.reconcile.turning import fit_knobs
from gsfdi.registry import shelf
from gsfdi.types import Array
from gsfdi.whiten import respond

Ints = npt.NDArray[np.int64]

LEAST = 20.0
"""Log-likelihood that a winner must gain in any case: two simulators differ by some on data without any noise."""
SHORT = 0.5
"""Share of the gain that theory promised short of which a refit is gone on with."""
FAR = 0.1
"""Share of the best gain up to which a finalist is not worth a better onset."""
PARTS = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Parts of what regression promised at which a refit that went astray begins anew."""
ONSETS = 40
EARLIEST = 0.03
"""Share of the recording before which nothing sets in that was not there all along, nor after it from the end."""
ONCE = 0.5
"""Share of what the largest step explains that one at another moment may explain."""
RARE, SET_IN, PLAINLY = 1.05, 1.25, 100.0
"""To have set in although it rarely does, a term must gain so many times the best of what is usual, so many times what
it would gain had it been there from the start, and so much log-likelihood."""
ONSET_COST = 5.0
"""Log-likelihood that an onset must gain beyond the same term from the start."""


@dataclass(frozen=True, slots=True)
class Entry:
    """How one offer did in one round.

    `gain` is what it adds to the log-likelihood: `linear` by regression, then by replay if it came to that. `rows` are
    those of its signatures, `inflation` and `bar` what chance would give it (see `calibrate`).
    """

    offer: Offer
    onset: float | None
    coefficients: Array
    linear: float
    rows: tuple[int, int] = (0, 0)
    gain: float = float("nan")
    fitted: Fitted | None = None
    inflation: float = 1.0
    bar: float = float("inf")


@dataclass(frozen=True, slots=True)
class Screening:
    """One round's entries, best first, and the signatures they were read from."""

    entries: tuple[Entry, ...]
    bare: Array
    """(columns, rows) signatures less what the knobs in hand could take over."""
    information: Array
    offers: tuple[tuple[Offer, slice], ...]
    """Everything that was tried, with the rows of its signatures."""


def screen(hand: Round, candidates: Sequence[Offer]) -> Screening:
    """Regress what is left on every offer's signature, from the start and from every onset.

    Where dry friction holds the joint, a load makes it slip that the same load the other way only holds the harder:
    what turned out to act against its trial is tried the other way round. (A weight had half the gain of a load.)
    """
    first = np.cumsum([0, *(len(offer.columns) for offer in candidates)])
    offers = tuple((offer, slice(*ends)) for offer, ends in zip(candidates, itertools.pairwise(first), strict=True))
    signatures = signed(hand, [offer.use(values) for offer in candidates for values in offer.columns])
    J = orthonormal(hand)
    entries = entries_of(hand, offers, signatures, J)
    anew = against(offers, entries) if sticks(hand.fitted.model) else {}
    if anew:
        signatures[list(anew)] = -signed(hand, list(anew.values()))
        touched = [(offer, rows) for offer, rows in offers if not anew.keys().isdisjoint(range(rows.start, rows.stop))]
        done = {(rows.start, rows.stop) for _, rows in touched}
        entries = [*(e for e in entries if e.rows not in done), *entries_of(hand, touched, signatures, J)]
    bare = signatures - (signatures @ J) @ J.T
    ranked = sorted(usual(entries), key=lambda e: -e.linear + onset_cost(e))
    return Screening(tuple(ranked), bare, np.sum(bare**2, axis=1), offers)


def signed(hand: Round, uses: Sequence[TermUse]) -> Array:
    """White signatures of terms on trial, with the sign with which they stand in the model; none of what runs away."""
    moved = hand.stand.innovations([with_term(hand.fitted.model, use) for use in uses])
    signatures = hand.stand.white([m - e for m, e in zip(moved, hand.innovations, strict=True)], hand.tools)
    signatures[~(np.abs(signatures).max(axis=1) < 1e6)] = 0.0
    return signatures


def entries_of(hand: Round, offers: Sequence[tuple[Offer, slice]], signatures: Array, J: Array) -> list[Entry]:
    """Regress what is left on the signatures of some offers, which stand in these rows; `J` spans the knobs in hand."""
    stand = hand.stand
    late = np.linspace(EARLIEST, 1 - EARLIEST, ONSETS) * stand.scales.seconds if stand.count == 1 else np.zeros(0)
    onsets = np.concatenate([[0.0], late])
    own = np.concatenate([signatures[rows] for _, rows in offers])
    sums = tails(own, J, hand.fitted.residual, np.searchsorted(stand_times(stand), onsets))
    entries: list[Entry | None] = []
    first = 0
    for offer, rows in offers:
        mine = slice(first, first := first + len(offer.columns))
        if may_always_be(offer):
            entries.append(best_entry(offer, rows, [None], *(part[:1, mine] for part in sums)))
        if may_set_in(offer):
            entries.append(best_entry(offer, rows, late.tolist(), *(part[1:, mine] for part in sums)))
        if offer.term == "position_bias" and stand.count == 1:
            entries.append(stepped(hand, offer))
    return [entry for entry in entries if entry is not None]


def against(offers: Sequence[tuple[Offer, slice]], entries: Sequence[Entry]) -> dict[int, TermUse]:
    """Trials the other way round of the columns that their offer's best entry takes a negative part of, by row."""
    best: dict[tuple[int, int], Entry] = {}
    for entry in sorted(entries, key=lambda e: e.linear):
        best[entry.rows] = entry
    return {
        rows.start + i: offer.use(values)
        for offer, rows in offers
        if (rows.start, rows.stop) in best
        for i, c in enumerate(best[rows.start, rows.stop].coefficients)
        if c < 0 and (values := offer.opposite(i)) is not None
    }


def usual(entries: Sequence[Entry]) -> list[Entry]:
    """Leave out what would have set in although it rarely does, unless it plainly did.

    It must explain more than all that is usual, and far more than it would had it been there from the start: of a fit
    that leaves out the first moments this cannot be said.
    """
    common = [e for e in entries if e.onset is None or e.offer.sets_in != "rarely"]
    rare = [e for e in entries if e.onset is not None and e.offer.sets_in == "rarely"]
    least = max(RARE * max((e.linear for e in common), default=0.0), PLAINLY)

    def always(entry: Entry) -> float:
        own = (entry.offer.term, entry.offer.side)
        return max((e.linear for e in common if e.onset is None and (e.offer.term, e.offer.side) == own), default=0.0)

    return [*common, *(e for e in rare if e.linear > least and e.linear > SET_IN * always(e))]


def onset_cost(entry: Entry) -> float:
    """Log-likelihood that an entry owes for setting in."""
    return ONSET_COST if entry.onset is not None else 0.0


def tails(signatures: Array, J: Array, residual: Array, begins: Sequence[int] | Ints) -> tuple[Array, Array, Array]:
    """Sums over everything from each of `begins` on, in one pass.

    Returns
    -------
    (b, m, 2) array
        By beginning, products of each signature with itself and the next.
    (b, m, k) array
        Projections of each on the orthonormal `J`.
    (b, m) array
        Its score against the residual less what the knobs in hand take over.
    """
    edges = [*begins, signatures.shape[1]]
    own, cross, raw = [], [], []
    for low, high in itertools.pairwise(edges):
        part = signatures[:, low:high]
        beside = np.einsum("ij,ij->i", part[:-1], part[1:])
        own.append(np.column_stack([np.einsum("ij,ij->i", part, part), np.append(beside, 0.0)]))
        cross.append(part @ J[low:high])
        raw.append(part @ residual[low:high])
    left = J.T @ residual
    products, projections, scores = (np.cumsum(x[::-1], axis=0)[::-1] for x in (own, cross, raw))
    return products, projections, scores - projections @ left


def stepped(hand: Round, offer: Offer) -> Entry | None:
    """Find the moment at which a constant added to the position would explain most, by a matched filter.

    An observer soon follows a biased sensor, so that only the step shows, and it looks alike wherever it is. A bias
    steps once: what looks like a step at other moments as well is something else.
    """
    stand, width = hand.stand, len(hand.stand.system.rows)
    trial = offer.columns[0]["bias_rad"]
    best, start = None, 0
    for i, record in enumerate(stand.records):
        n = len(record.t)
        sensed = np.zeros((1, n, 2))
        sensed[0, n // 2 :, 0] = trial
        answer = respond(stand.system, stand.gain, np.zeros((1, n, stand.system.Bt.shape[1])), sensed, stand.steps[i])
        shape = hand.tools[i](answer)[0, width * (n // 2) :]
        residual = hand.fitted.residual[start : start + width * n]
        start += width * n
        found = matched(residual, shape, width, n)
        if found is None:
            continue
        k, size, gain = found
        onset = 0.5 * float(record.t[max(k - 1, 0)] + record.t[k])  # on the sample itself rounding would decide
        entry = Entry(offer, onset, np.array([size]), gain)
        if offer.mix(entry.coefficients) is not None and (best is None or entry.linear > best.linear):
            best = entry
    return best


def matched(residual: Array, shape: Array, width: int, n: int) -> tuple[int, float, float] | None:
    """Find where in `residual` the answer `shape` stands, how large it is, and what log-likelihood it gains.

    Both hold `width` innovations for each of the `n` samples. None where it stands elsewhere nearly as well.
    """
    score = beginning(residual, shape, width)
    shown = np.cumsum(shape**2)[np.minimum(width * np.arange(n, 0, -1), len(shape)) - 1]
    gains = 0.5 * score**2 / np.maximum(shown, 1e-300) * (shown > 0.5 * shown[0])  # at the end it hardly shows yet
    k, lasts = int(np.argmax(gains)), int(np.searchsorted(shown[::-1], 0.99 * shown[0]))
    elsewhere = np.concatenate([gains[: max(k - lasts, 0)], gains[k + lasts :]])
    if not gains[k] > 0 or np.max(elsewhere, initial=0.0) > ONCE * gains[k]:
        return None
    return k, float(score[k] / shown[k]), float(gains[k])


def beginning(residual: Array, shape: Array, width: int) -> Array:
    """Score ``(n,)`` of `shape` in `residual` where it begins at each sample; both hold `width` values a sample."""
    return np.asarray(fftconvolve(residual, shape[::-1]))[len(shape) - 1 :: width]


def may_set_in(offer: Offer) -> bool:
    """Whether the term may begin during a recording, and a part of its signature then shows it."""
    return offer.sets_in != "never" and offer.term != "position_bias"


def may_always_be(offer: Offer) -> bool:
    """Whether the term can be seen if it was there all along: a constant offset of the position cannot."""
    return offer.term != "position_bias"


def best_entry(
    offer: Offer, rows: slice, onsets: Sequence[float | None], own: Array, cross: Array, score: Array
) -> Entry | None:
    """Regress what is left on an offer from each of `onsets` on, and give what gains most; for the sums see `tails`."""
    info = -cross @ cross.swapaxes(1, 2)
    diagonal = np.einsum("bii->bi", info)
    diagonal += own[..., 0]
    if own.shape[1] == 2:
        info[:, [0, 1], [1, 0]] += own[:, :1, 1]
    shown = np.flatnonzero(np.all(diagonal >= 1e-6 * own[..., 0] + 1e-12, axis=1))
    if len(shown) == 0:
        return None
    diagonal *= 1 + 1e-9
    c = np.linalg.solve(info[shown], -score[shown][..., None])[..., 0]
    gains = -0.5 * np.sum(score[shown] * c, axis=1)
    if c.shape[1] == 2 and onsets == [None] and offer.mix(c[0]) is None:  # the knobs may take over what parts the two
        alone = -score[shown[0]] / diagonal[shown[0]]
        c, gains, shown = np.diag(alone), -0.5 * score[shown[0]] * alone, np.repeat(shown, 2)
    for k in np.argsort(-gains, kind="stable"):
        onset, values = onsets[shown[k]], offer.mix(c[k])
        if values is not None and (onset is None or not is_less(offer, values)):  # no file holds less from a time on
            return Entry(offer, onset, c[k], float(gains[k]), (rows.start, rows.stop))
    return None


def stand_times(stand: Bench) -> Array:
    """Time of every white innovation."""
    return np.concatenate([np.repeat(r.t, len(stand.system.rows)) for r in stand.records])


def refits(hand: Round, entries: Sequence[Entry]) -> list[Entry]:
    """Refit entries one after another, less carefully those far behind the best before them.

    None that sets in is refitted where the same term from the start gains what it promises.
    """
    found: list[Entry] = []
    for entry in entries:
        own = (entry.offer.term, entry.offer.side)
        always = [e for e in found if e.onset is None and (e.offer.term, e.offer.side) == own]
        if entry.onset is not None and any(e.gain >= entry.linear for e in always):
            continue
        found.append(refit(hand, entry, FAR * max((e.gain for e in found), default=0.0)))
    return found


def refit(hand: Round, entry: Entry, least: float = 0.0, rounds: int = 3) -> Entry:
    """Fit an entry's term by replay together with everything in hand, its onset where that gains more than `least`."""
    values = entry.offer.mix(entry.coefficients)
    if values is None:
        return entry
    values = tuned(hand, entry, allowed(entry.offer, values))
    model = pressed(hand, with_term(hand.fitted.model, entry.offer.use(values, entry.onset)))
    place = len(model.physics) - 1
    knobs = [*hand.fitted.knobs, *term_knobs(hand.stand, model, place)]
    fitted = fit_knobs(hand.misfit, model, knobs, rounds, hand.fitted.jacobian)
    if entry.onset is not None and max(entry.linear, hand.fitted.cost - fitted.cost) > least:
        fitted = refined_onset(hand, fitted, place, hand.stand.scales.seconds / ONSETS)
    if entry.linear > LEAST and hand.fitted.cost - fitted.cost < SHORT * entry.linear:
        fitted = fit_knobs(hand.misfit, fitted.model, knobs, 3 * rounds)
    if entry.linear > LEAST and hand.fitted.cost < fitted.cost:
        again = fit_knobs(hand.misfit, smaller(hand, model), knobs, 3 * rounds)
        fitted = min(fitted, again, key=lambda one: one.cost)
    return replace(entry, onset=fitted.model.physics[place].onset, fitted=fitted, gain=hand.fitted.cost - fitted.cost)


def smaller(hand: Round, model: JointModel) -> JointModel:
    """Shrink the last term of `model` to where it fits best: from far beyond, slopes lead nowhere."""
    use = model.physics[-1]
    size = shelf("gsfdi.terms", PhysicsTerm)[use.term].params[0]
    if size.neutral is None:
        return model
    sizes = [size.neutral + part * (use.values[size.name] - size.neutral) for part in PARTS]
    return likeliest(hand, model, len(model.physics) - 1, size.name, sizes)[1]


def likeliest(
    hand: Round, model: JointModel, place: int, name: str, values: Sequence[float]
) -> tuple[float, JointModel]:
    """Cost and model of the best of some values of one number of the term at `place`, all else as it is."""
    knob = Knob(place, name, 1.0)
    models = [turned(model, [knob], np.array([value])) for value in values]
    costs = 0.5 * np.sum(hand.misfit(models) ** 2, axis=1)
    best = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
    return float(costs[best]), models[best]


def tuned(hand: Round, entry: Entry, values: Mapping[str, float]) -> Mapping[str, float]:
    """Find a mode's frequency on an ever finer grid: a resonance is narrower than the one that offers stand on."""
    if "frequency_hz" not in values:
        return values
    ratio = 1.1
    for _ in range(2):
        span = values["frequency_hz"] * ratio ** np.linspace(-1, 1, 13)
        trials = [{**values, **within(entry.offer.term, {"frequency_hz": f})} for f in span]
        moved = hand.misfit([with_term(hand.fitted.model, entry.offer.use(v, entry.onset)) for v in trials])
        scores, information = regressed(hand, moved - hand.fitted.residual)
        best = int(np.nanargmax(np.where(scores < 0, scores**2 / information, 0.0)))
        c = float(-scores[best] / information[best])
        size = trials[best]["inertia_kg_m2"] * (c if 0 < c < 1e3 else 1.0)
        values = {**trials[best], **within(entry.offer.term, {"inertia_kg_m2": size})}
        ratio **= 1 / 4
    return values


def refined_onset(
    hand: Round, fitted: Fitted, place: int, width: float, known: Array | None = None, rounds: int = 3
) -> Fitted:
    """Move the onset of the term at `place` to where it fits best; slopes cannot, for it moves by whole samples.

    Parameters
    ----------
    hand : Round
        Whose noise decides.
    fitted : Fitted
        With an onset nearby.
    place : int
    width : float
        How far off it may be [s].
    known : (n, j) array, optional
        Slopes of the first j knobs; without it, those of `hand`.
    rounds : int
        Each looks a fourth as wide about the best of the last.
    """
    known = hand.fitted.jacobian if known is None else known
    seconds = hand.stand.scales.seconds
    knob = Knob(place, "onset", 1.0, 0.5 * EARLIEST * seconds, (1.0 - EARLIEST) * seconds)
    for _ in range(rounds):
        start = knob.read(fitted.model)
        models = [knob.turn(fitted.model, start + step * width) for step in np.linspace(-1, 1, 9)]
        costs = 0.5 * np.sum(hand.misfit(models) ** 2, axis=1)
        model = models[int(np.nanargmin(costs))]
        width /= 4.0
        fitted = fit_knobs(hand.misfit, model, fitted.knobs, 1, known)
    return fit_knobs(hand.misfit, fitted.model, fitted.knobs, 2, known)


def allowed(offer: Offer, values: Mapping[str, float]) -> Mapping[str, float]:
    """`values` of an offer brought within the shelf's bounds, or within what the model can spare of its term."""
    return values if is_less(offer, values) else within(offer.term, values)


def is_less(offer: Offer, values: Mapping[str, float]) -> bool:
    """Whether `values` take something off what the model holds of the offer's term."""
    return offer.least <= next(iter(values.values())) < 0.0


def within(term: str, values: Mapping[str, float]) -> dict[str, float]:
    """`values` brought within the shelf's bounds."""
    shape = shelf("gsfdi.terms", PhysicsTerm)[term]
    return {
        name: float(np.clip(value, shape.param(name).low, shape.param(name).high)) for name, value in values.items()
    }
