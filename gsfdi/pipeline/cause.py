"""Where no known fault explains an alarm: reconcile the batch with the joint as its baseline knows it, for a cause."""

import logging
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gsfdi.baseline import JointBaseline
from gsfdi.errors import GsfdiError
from gsfdi.model import JointModel, Side, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.types import JointRecord

LOG = logging.getLogger("gsfdi")
SIMPLE: Mapping[str, tuple[str, dict[str, float]]] = {
    "constant_load": ("torque_nm", {}),
    "coulomb_friction:motor": ("torque_nm", {}),
    "viscous_friction:motor": ("coefficient_nms_rad", {}),
    "asymmetric_friction": ("difference_nms_rad", {"difference_nm": 0.0}),
    "quadratic_friction": ("coefficient_nms2_rad2", {}),
    "load_dependent_friction": ("ratio", {}),
    "cable_harness": ("stiffness_nm_rad", {"rest_rad": 0.0}),
}
"""What a baseline learns under one coefficient: the parameter that it is, and those that it leaves at nothing."""


def cause(records: Sequence[JointRecord], baseline: JointBaseline, model: JointModel) -> Mapping[str, object] | None:
    """Name the physics by which a batch differs from its baseline.

    Parameters
    ----------
    records : sequence of JointRecord
        The batch, or the latest part of it.
    baseline : JointBaseline
        The fault-free joint.
    model : JointModel
        Its model file: controller, sensors, structure.

    Returns
    -------
    mapping or None
        The most probable entry of ``omitted_physics``; None where reconcile cannot tell either.
    """
    try:
        found = reconcile(records, healthy(records[0], baseline, model))
    except GsfdiError as error:
        LOG.info("%s: reconcile cannot help: %s", records[0].joint, error)
        return None
    return found.omitted_physics[0] if found.verdict == "explained" and found.omitted_physics else None


def healthy(record: JointRecord, baseline: JointBaseline, model: JointModel) -> JointModel:
    """The model file's joint with plant and terms as the baseline learnt them.

    Parameters
    ----------
    record : JointRecord
        Tells how fast the joint moves, on which a learnt Stribeck velocity depends.
    baseline : JointBaseline
        The fault-free joint.
    model : JointModel
        Its model file.
    """
    terms = [use for use in _uses(baseline.nominal.terms, _brisk(record)) if use.term not in _held(model)]
    return replace(model, plant=baseline.nominal.plant, physics=(*model.physics, *terms))


def _uses(learnt: Mapping[str, float], brisk: float) -> Iterator[TermUse]:
    for key, (parameter, others) in SIMPLE.items():
        if learnt.get(key):
            side: Side | None = "motor" if "friction" in key else None
            yield TermUse(key.partition(":")[0], {parameter: learnt[key], **others}, side)
    if learnt.get("stribeck_friction"):
        shape = {"excess_nm": learnt["stribeck_friction"], "velocity_rad_s": 0.2 * brisk}
        yield TermUse("stribeck_friction", shape, "motor")
    sine, cosine = learnt.get("gravity_unbalance:s", 0.0), learnt.get("gravity_unbalance:c", 0.0)
    if sine or cosine:
        # torque sin(y - angle) = sine sin y + cosine cos y
        yield TermUse(
            "gravity_unbalance", {"torque_nm": math.hypot(sine, cosine), "angle_rad": math.atan2(-cosine, sine)}
        )


def _held(model: JointModel) -> set[str]:
    return {use.term for use in model.physics}


def _brisk(record: JointRecord) -> float:
    step = np.diff(record.t)
    speed = np.diff(record["position"])[step > 0] / step[step > 0]
    return float(np.sqrt(np.nanmean(speed**2)))
