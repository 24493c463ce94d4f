"""Where a stop lies that the joint hardly meets, found by replays rather than slopes.

How far the joint presses into it and how stiff it is are nearly one number then, the torque at the turn; and a stop
that begins a little off leaves the joint stuck where it slides, or the other way round. A fit by slopes gave one of
165 N m/rad a place 0.04° off and 230 N m/rad, and a weight that sets in at that moment came before it.
"""

import math
from dataclasses import replace

import numpy as np

from gsfdi.model import JointModel
from gsfdi.motion import Param, PhysicsTerm
from gsfdi.reconcile.hand import Round
from gsfdi.registry import shelf

DEPTHS = (0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)
"""Times the depth in hand that are tried."""
TORQUES = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)
"""Times the torque in hand at the greatest depth."""
FINER = (1.0, 0.25)
"""Powers of both, one after the other."""


def place_of(term: PhysicsTerm) -> Param | None:
    """Find the number of a term that is a place on the joint's way."""
    return next((p for p in term.params if p.kind == "angle" and p.trials is not None), None)


def pressed(hand: Round, model: JointModel) -> JointModel:
    """Give the last term of `model`, if it lies at a place, the depth and stiffness that fit best, all else as it is.

    Parameters
    ----------
    hand : Round
        Under whose noise.
    model : JointModel
    """
    use = model.physics[-1]
    term = shelf("gsfdi.terms", PhysicsTerm)[use.term]
    place = place_of(term)
    if place is None:
        return model
    for power in FINER:
        model = min(stops(hand, model, place.name, power), key=lambda pair: pair[0])[1]
    return model


def stops(hand: Round, model: JointModel, place: str, power: float) -> list[tuple[float, JointModel]]:
    """Cost of `model`, and of others whose last term lies elsewhere and is as much stiffer as that asks for."""
    scales, last, use = hand.stand.scales, len(model.physics) - 1, model.physics[-1]
    here, (size, stiffness) = use.values[place], next((n, v) for n, v in use.values.items() if n != place)
    edge = scales.centre + math.copysign(scales.reach, here - scales.centre)
    pairs = [(depth**power, torque**power) for depth in DEPTHS for torque in TORQUES]
    values = [{place: edge + depth * (here - edge), size: stiffness * torque / depth} for depth, torque in pairs]
    models = [model, *(model.with_use(last, replace(use, values=v)) for v in values)]
    costs = np.nan_to_num(np.sum(hand.misfit(models) ** 2, axis=1), nan=np.inf)
    return list(zip(costs.tolist(), models, strict=True))
