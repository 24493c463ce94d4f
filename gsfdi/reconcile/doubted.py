"""Numbers that the model itself doubts: estimated beside plain friction and load before any term competes.

Where nearly all of the drive's torque is missing, as on a bare model of an arm whose drive gain nobody knows, a free
torque constant would first go to where the current moves nothing, and every term would then be judged there. So the
doubted numbers are fitted beside viscous and Coulomb friction and a constant load, which are dropped again, and
believed like any other number while terms compete. In the end they are freed to what the model says of them, for the
intervals' sake: along the gauge of torque, friction is known no better than the numbers that give it its scale.
"""

from dataclasses import replace

from gsfdi.model import JointModel, Side, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.hand import Round, around, settle, with_term
from gsfdi.reconcile.knobs import plant_knobs, term_knobs
from gsfdi.reconcile.turning import DOUBT, fit_knobs
from gsfdi.registry import shelf
from gsfdi.types import Array

PLAIN = {"viscous_friction": "coefficient_nms_rad", "coulomb_friction": "torque_nm", "constant_load": "torque_nm"}
"""What nearly every drive has, by the number that sizes it."""


def estimated(stand: Bench, model: JointModel, floor: Array) -> JointModel:
    """Give `model` with the numbers that it doubts as the recordings have them, and doubts them no longer.

    Parameters
    ----------
    stand : Bench
        The recordings on their bench.
    model : JointModel
        Whose `trust` tells which numbers it doubts more than is usual.
    floor : (k,) array
        Torque noise that is known to be there [N m].
    """
    if all(share <= DOUBT for share in model.trust.values()):
        return model
    knobs = plant_knobs(model, stand.records[0].effort)
    side: Side | None = "motor" if model.structure == "flexible" else None
    beside = model
    sizes = {"coefficient_nms_rad": stand.scales.torque / stand.scales.speed, "torque_nm": stand.scales.torque}
    for term, name in PLAIN.items():
        own: Side | None = "output" if side and term == "constant_load" else side
        beside = with_term(beside, TermUse(term, {name: 0.1 * sizes[name]}, own))
        wide = term_knobs(stand, beside, len(beside.physics) - 1)
        knobs += [replace(knob, scale=0.1 * sizes[name]) for knob in wide]
    plant = settle(stand, beside, knobs, floor).fitted.model.plant
    return replace(model, plant=plant, trust={k: min(share, DOUBT) for k, share in model.trust.items()})


def moot_terms(model: JointModel) -> frozenset[str]:
    """Terms that say no more than that a doubted number of `model` is another.

    A rigid joint tells only torque over inertia: where one of them is doubted, a change of the other says nothing. And
    where nobody knows what torque an ampere makes, nobody can say that it makes less of it at times.
    """
    found = {f"{name}_change" for name, share in model.trust.items() if share > DOUBT}
    scale = {"torque_constant_change", "output_inertia_change"}
    if model.structure == "rigid" and found & scale:
        found |= scale
    if "torque_constant_change" in found:
        terms = shelf("gsfdi.terms", PhysicsTerm).values()
        found |= {"current_gain", *(term.name for term in terms if term.place == "torque_constant")}
    return frozenset(found)


def freed(hand: Round) -> Round:
    """Fit the model in hand once more, its doubted numbers believed no further than the model says."""
    if all(share <= DOUBT for share in hand.stand.model.trust.values()):
        return hand
    stated = {k.name: k for k in plant_knobs(hand.stand.model, hand.stand.records[0].effort) if k.place == -1}
    knobs = [stated.get(k.name, k) if k.place == -1 else k for k in hand.fitted.knobs]
    fitted = fit_knobs(hand.misfit, hand.fitted.model, knobs, 6)
    return around(hand, fitted)
