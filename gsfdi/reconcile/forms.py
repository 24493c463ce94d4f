"""The same term in another form: at another pitch, on another scale, by another law that goes by its name."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from gsfdi.fit import SWING, Knob
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import Param, PhysicsTerm
from gsfdi.reconcile.finalists import KNOB_COST, is_stretched
from gsfdi.reconcile.hand import Round, around, from_below, leaves_nothing, likelier, project, regressed, settle
from gsfdi.reconcile.knobs import plausible, swing_knobs, term_knobs
from gsfdi.reconcile.modes import worthy_frequencies
from gsfdi.reconcile.screen import LEAST, likeliest
from gsfdi.reconcile.stops import pressed
from gsfdi.reconcile.turning import fit_knobs, known_before
from gsfdi.registry import shelf
from gsfdi.types import Array

SHAPES = ("plain", "follower")
"""Kinds of numbers that shape a term: neither phases nor lever arms."""
FACTORS = (0.1, 0.3, 3.0, 10.0, 30.0)
"""Times its value at which a number that shapes a term is tried once the term is settled."""
WIDTHS = (0.5, 1.0, 2.0, 5.0, 12.0)
"""Times its value at which a number that shapes a term is tried by another law."""
BY_SPEED = ("coulomb_friction", "shear_thinning_friction", "stribeck_friction")
"""Frictions of which two at once look like a third, for all they depend on is the speed."""
TRIED = 2
"""Starts of another law that are fitted."""
PROMISED = 8.0
"""Twice the log-likelihood that regression must promise of a detail."""
FARTHEST = 1e3
"""Times a first guess that regression may ask for."""


def retuned(hand: Round, place: int, term: PhysicsTerm, floor: Array) -> Round:
    """Try the resonance of the term at `place` at the likeliest other pitches under the noise that now suits it.

    Under a larger one any mode that is faster than the motion is an inertia.
    """
    if term.frequency is None or leaves_nothing(hand, floor):
        return hand
    best, name, size = hand.fitted, term.frequency.name, term.params[0]
    model, use = best.model, best.model.physics[place]
    bare = _emptied(hand, place, size.name)
    for pitch in worthy_frequencies(bare)[term.name]:
        values = {**use.values, name: pitch, size.name: max(use.values[size.name], size.start)}
        moved = hand.misfit([model.with_use(place, replace(use, values=values))]) - bare.fitted.residual
        (score,), (information,) = regressed(bare, moved)
        share = -float(score / information)
        values[size.name] *= share if 0.0 < share < FARTHEST else 1.0
        trial = fit_knobs(hand.misfit, model.with_use(place, replace(use, values=values)), best.knobs, 3)
        best = min(best, trial, key=lambda one: one.cost)
    return hand if best.cost > hand.fitted.cost - KNOB_COST else settle(hand.stand, best.model, best.knobs, floor)


def swung(hand: Round, place: int, term: PhysicsTerm, floor: Array) -> Round:
    """Let the term at `place` swing already as stretches begin, if that earns its numbers.

    A mode of 2.9 Hz that began at rest after a gap of 6 s had a position gain and an inertia beside it that set in.
    """
    fitted = hand.fitted
    if term.frequency is None or any(knob.place == SWING for knob in fitted.knobs):
        return hand
    knobs = swing_knobs(hand.stand, fitted.model.physics[place].values[term.frequency.name])
    moved = hand.misfit([knob.turn(fitted.model, knob.scale) for knob in knobs]) - fitted.residual
    bare, residual = project(hand, moved)
    taken = np.linalg.lstsq(bare.T, residual, rcond=None)[0] @ bare
    least = KNOB_COST * len(knobs)
    if 0.5 * float(taken @ taken) < least:
        return hand
    settled = settle(hand.stand, fitted.model, [*fitted.knobs, *knobs], floor)
    return settled if likelier(settled, hand) > least else hand


def reordered(hand: Round, place: int, term: PhysicsTerm, floor: Array) -> Round:
    """Move the wave at `place` on to the next whole order while it has gone as far towards that as an order may be off.

    Slower waves than are sought at first are found so: a ripple of order 2 seemed one of 2.97 and one of 4.95.
    """
    if term.order is None or hand.stand.model.axis == "linear":
        return hand
    while (order := _beside(hand, place, term.order.name)) >= 1.0:
        model = hand.fitted.model
        use = model.physics[place]
        turns = 1.0 if term.place == "position_sensor" else hand.stand.model.plant.gear_ratio
        ahead = (use.values[term.order.name] - order) * turns * hand.stand.scales.centre
        values = {**use.values, term.order.name: order, "phase_rad": use.values["phase_rad"] + ahead}
        settled = in_place(hand, {place: replace(use, values=values)}, floor)
        if likelier(settled, hand) <= 0:
            return hand
        hand = settled
    return hand


def in_place(hand: Round, uses: Mapping[int, TermUse], floor: Array) -> Round:
    """Settle the model in hand with other terms, or other numbers, at some places; their knobs are laid out anew."""
    model = hand.fitted.model
    for place, use in uses.items():
        model = model.with_use(place, use)
    knobs = [knob for knob in hand.fitted.knobs if knob.place not in uses]
    knobs += [knob for place in uses for knob in term_knobs(hand.stand, model, place)]
    return settle(hand.stand, model, knobs, floor)


def _beside(hand: Round, place: int, name: str) -> float:
    """Whole order next to that at `place`, on the side to which it has gone as far as it may; 0 where it has not."""
    for knob, value in zip(hand.fitted.knobs, hand.fitted.values, strict=True):
        if (knob.place, knob.name) == (place, name):
            down, up = knob.is_at(knob.low, value), knob.is_at(knob.high, value)
            return float(np.round(value) + up - down) if up or down else 0.0
    return 0.0


def _emptied(hand: Round, place: int, size: str) -> Round:
    """Give the round with the term at `place` sized at nothing, and none of its knobs."""
    fitted = hand.fitted
    use = fitted.model.physics[place]
    model = fitted.model.with_use(place, replace(use, values={**use.values, size: 0.0}))
    rest = [i for i, knob in enumerate(fitted.knobs) if knob.place != place]
    knobs, values, slopes = tuple(fitted.knobs[i] for i in rest), fitted.values[rest], fitted.jacobian[:, rest]
    residual = hand.misfit([model])[0]
    return replace(
        hand, fitted=replace(fitted, model=model, knobs=knobs, values=values, jacobian=slopes, residual=residual)
    )


def reshaped(hand: Round, term: PhysicsTerm, floor: Array) -> Round:
    """Try the last term's shape at other scales under the noise that now suits it, which slopes do not reach."""
    if leaves_nothing(hand, floor):
        return hand
    model = pressed(hand, hand.fitted.model)
    if model is not hand.fitted.model:
        return settle(hand.stand, model, hand.fitted.knobs, floor)
    use, best = model.physics[-1], (hand.fitted.cost - KNOB_COST, model)
    for param in term.params:
        if param.trials is None or param.kind not in SHAPES or param.low < 0 or param in (term.order, term.params[0]):
            continue
        value = use.values[param.name]
        low, high = plausible(hand.stand, term, param, value)
        trials = [float(np.clip(value * factor, max(low, param.low), min(high, param.high))) for factor in FACTORS]
        best = min(best, likeliest(hand, model, len(model.physics) - 1, param.name, trials), key=lambda pair: pair[0])
    return hand if best[1] is model else settle(hand.stand, best[1], hand.fitted.knobs, floor)


def relawed(hand: Round, place: int, term: PhysicsTerm, floor: Array) -> Round:
    """Try the term at `place` by the other laws that go by its name, or with a detail that it leaves out.

    What has been taken on may make another law the likelier one: all are tried again then.
    """
    size, before = term.params[0], hand
    for param in term.params:
        starts, knobs = other_forms(hand, place, term, param)
        fits = [fit_knobs(hand.misfit, start, knobs, 3, known_before(hand.fitted, place)) for start in starts]
        best = min(fits, key=lambda one: one.cost, default=hand.fitted)
        if best.cost >= hand.fitted.cost:
            continue
        fitted = fit_knobs(hand.misfit, best.model, knobs, 6)
        if is_stretched(fitted):
            continue
        settled = settle(hand.stand, fitted.model, fitted.knobs, floor)
        settled = from_below(settled, floor) if likelier(settled, hand) > 0 else settled
        idle = settled.fitted.model.physics[place].values.get(size.name, size.start) == size.neutral
        if likelier(settled, hand) > LEAST and not idle and not is_stretched(settled.fitted):
            hand = settled
    return hand if hand is before else relawed(hand, place, term, floor)


def shared_anew(hand: Round, given: int, shelf_terms: Mapping[str, PhysicsTerm], floor: Array) -> Round:
    """Put another friction in the place of a found one, where the last term, a friction too, does better beside it.

    The first of two that are missing is fitted to the sum of both. The drag of a grease was a Coulomb friction that
    turns round over a tenth of its speeds while a Stribeck friction was missing, too; and a Stribeck friction was a
    Coulomb friction, beside which the drag was left with a fifth of its own. Neither number leads there alone. Where
    only one of the two was there from the start, each may have the name of the other.
    """
    model, best = hand.fitted.model, hand
    end, found = len(model.physics) - 1, {use.term for use in model.physics[given:]}
    places = [place for place in range(given, end) if model.physics[place].term in BY_SPEED]
    if not places or model.physics[end].term not in BY_SPEED:
        return hand
    last, spare = model.physics[end], [name for name in BY_SPEED if name in shelf_terms and name not in found]
    for place in places:
        use = model.physics[place]
        pairs = [(name, last.term) for name in spare]
        if use.onset != last.onset:
            pairs.append((last.term, use.term))
        for name, beside in pairs:
            own = likes(last, shelf_terms[beside], shelf_terms, hand)
            own = [last, *own] if beside == last.term else own
            others = likes(use, shelf_terms[name], shelf_terms, hand)
            starts = [model.with_use(end, one).with_use(place, other) for one in own for other in others]
            start = nearest(hand, starts)[0]
            other = in_place(hand, {place: start.physics[place], end: start.physics[end]}, floor)
            best = other if likelier(other, best) > 0 else best
    return best


def likes(use: TermUse, term: PhysicsTerm, shelf_terms: Mapping[str, PhysicsTerm], hand: Round) -> list[TermUse]:
    """Give `term` in the place of a friction, with its torque, at every speed that is tried for it."""
    torque = use.values[shelf_terms[use.term].params[0].name]
    trials = {param.name: param.trials(hand.stand.scales) for param in term.numbers if param.trials is not None}
    shapes = (dict(zip(trials, point, strict=True)) for point in product(*trials.values()))
    return [replace(use, term=term.name, values={term.params[0].name: torque, **shape}) for shape in shapes]


def other_forms(hand: Round, place: int, term: PhysicsTerm, param: Param) -> tuple[list[JointModel], tuple[Knob, ...]]:
    """Models in which `param` makes another law of the term at `place`, and the knobs of a fit that begins with them.

    There are none where `param` does not choose a law, or is a detail that is there, or one that promises nothing.
    """
    model, knobs = hand.fitted.model, tuple(hand.fitted.knobs)
    use = model.physics[place]

    def written(changed: Mapping[str, float]) -> JointModel:
        return model.with_use(place, replace(use, values={**use.values, **changed}))

    if param.kind == "choice":
        shape = next(one for one in term.params if one.trials is not None)
        width = use.values.get(shape.name, shape.start)
        others = {float(law) for law in range(int(param.high) + 1)} - {use.values.get(param.name, param.start)}
        laws = ([written({param.name: law, shape.name: width * f}) for f in WIDTHS] for law in sorted(others))
        return [start for starts in laws for start in nearest(hand, starts)], knobs
    if param.kind != "detail" or param.name in use.values or param.trials is None:
        return [], knobs
    trials = param.trials(hand.stand.scales)
    models = [written({param.name: value}) for value in trials]
    low, high = plausible(hand.stand, term, param, trials[0])
    detail = Knob(place, param.name, trials[0], max(low, param.low), min(high, param.high))
    return towards(hand, models), (*knobs, detail)


def nearest(hand: Round, starts: Sequence[JointModel]) -> list[JointModel]:
    """Starts of another law that leave least, the knobs in hand following."""
    bare, _ = project(hand, hand.misfit(starts))
    return [starts[i] for i in np.argsort(np.sum(bare**2, axis=1))[:TRIED]]


def towards(hand: Round, starts: Sequence[JointModel]) -> list[JointModel]:
    """The nearest start with a detail, if a step towards it is promised a gain: a first guess may go far beyond it."""
    shown = hand.misfit(starts)
    closest = int(np.argmin(np.sum(shown**2, axis=1)))
    (score,), (information,) = regressed(hand, shown[[closest]] - hand.fitted.residual)
    return [starts[closest]] if score < 0 and score**2 / information > PROMISED else []


def unrefined(hand: Round) -> Round:
    """Take out details that the terms which came later have made needless, but those of the nominal model."""
    nominal, terms = hand.stand.model.physics, shelf("gsfdi.terms", PhysicsTerm)
    for place in range(len(hand.fitted.model.physics)):
        stated = nominal[place].values if place < len(nominal) else {}
        for param in terms[hand.fitted.model.physics[place].term].params:
            model = hand.fitted.model
            use = model.physics[place]
            if param.kind != "detail" or param.name not in use.values or param.name in stated:
                continue
            plain = replace(use, values={name: value for name, value in use.values.items() if name != param.name})
            knobs = [knob for knob in hand.fitted.knobs if (knob.place, knob.name) != (place, param.name)]
            fitted = fit_knobs(hand.misfit, model.with_use(place, plain), knobs, 6)
            if fitted.cost - hand.fitted.cost < LEAST:
                hand = around(hand, fitted)
    return hand


def plainer(hand: Round, floor: Array) -> Round:
    """Settle the model in hand without the details that what came since has made needless, if it is as likely then.

    A Coulomb friction that turned round over 7e-5 rad/s kept to the least that such a detail may be once a grease had
    joined it. Without it both gained 1,021, and no Stribeck friction came to mend them.
    """
    plain = unrefined(hand)
    if plain is hand:
        return hand
    settled = settle(hand.stand, plain.fitted.model, plain.fitted.knobs, floor)
    return settled if likelier(settled, hand) > -LEAST else hand
