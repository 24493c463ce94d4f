"""What the nominal model holds too much of: a friction that it has may be less, down to nearly nothing.

Friction falls by a third when grease warms. A model that holds more of it than the recording shows lacks no physics,
and yet no positive term puts it right; so a term of one number may go below zero by as much as the model holds of it.
"""

from collections.abc import Sequence
from dataclasses import replace

from gsfdi.model import JointModel, Side, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.packed import side_of, term_of
from gsfdi.reconcile.offer import Offer, Values
from gsfdi.types import Array

MOST = 0.9
"""Share of what the model holds that may be too much, its own belief taking the rest."""


def surplus(model: JointModel, term: PhysicsTerm, side: Side | None) -> float:
    """How much of what `model` holds of a term of one number, on a side, a recording may do without."""
    size = term.params[0]
    if len(term.numbers) != 1 or not size.linear or size.low != 0.0:
        return 0.0
    place = side_of(TermUse(term.name, {}, side), model.structure)
    there = sum(
        use.values.get(size.name, size.start)
        for use in model.physics
        if use.term == term.name and use.onset is None and side_of(use, model.structure) == place
    )
    if term.name == "viscous_friction" and place == "output":
        there += model.plant.damping
    return MOST * float(there)


def lowered(offer: Offer, model: JointModel, term: PhysicsTerm, held: Sequence[TermUse]) -> Offer:
    """Let an offer go below zero by as much as `model` holds of its term, by the law by which it is `held` now."""
    spare = surplus(model, term, offer.side)
    if spare == 0.0:
        return offer
    ((name, trial),) = offer.columns[0].items()
    details = _details(offer, model, held)

    def mix(c: Array) -> Values | None:
        value = float(c[0]) * trial
        mixed = {name: value} if -spare <= value < 0.0 else offer.mix(c)
        return None if mixed is None else {**mixed, **details}

    return replace(offer, columns=({name: trial, **details},), mix=mix, least=-spare)


def _details(offer: Offer, model: JointModel, held: Sequence[TermUse]) -> Values:
    """Find the details of the law by which an offer's term is held."""
    place = side_of(TermUse(offer.term, {}, offer.side), model.structure)
    for use in held:
        if use.term == offer.term and use.onset is None and side_of(use, model.structure) == place:
            details = [param.name for param in term_of(use).params if param.kind == "detail"]
            return {name: use.values[name] for name in details if name in use.values}
    return {}


def merged(model: JointModel) -> JointModel:
    """Take what is below zero off what the model holds of it, as a plain model file must have it."""
    kept = list(model.physics)
    plant = model.plant
    for less in [use for use in kept if len(term_of(use).numbers) == 1 and min(use.values.values(), default=0.0) < 0.0]:
        term = term_of(less)
        name, short = term.params[0].name, -less.values[term.params[0].name]
        if term.params[0].low < 0.0:
            continue
        kept.remove(less)
        place = side_of(less, model.structure)
        for i, use in enumerate(kept):
            if use.term == less.term and use.onset is None and side_of(use, model.structure) == place:
                left = use.values.get(name, term.params[0].start) - short
                kept[i], short = replace(use, values={**use.values, name: max(left, 0.0)}), max(-left, 0.0)
        if less.term == "viscous_friction" and place == "output":
            plant = replace(plant, damping=max(plant.damping - short, 0.0))
    return replace(model, physics=tuple(kept), plant=plant)
