"""Whether recordings can tell anything: a joint that stands still shows no physics, only its sensors."""

from collections.abc import Sequence

import numpy as np

from gsfdi.model import JointModel
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.reconciliation import Reconciliation
from gsfdi.reconcile.sensing import sensor_variances
from gsfdi.types import JointRecord

STILL = 20.0
"""Deviations of the position's noise within which half of the range of a joint lies that stands still."""
STEPS = 8
"""Values of the position that a joint takes at most that stands still, however finely they are stepped."""
BLUR = 0.3
"""Share of itself within which a recording must tell the joint's inertia, or it tells of nothing else."""


def hardly_moves(records: Sequence[JointRecord], model: JointModel) -> bool:
    """Whether no recording moves the joint by more than its position sensor's noise and steps."""
    known = [r for r in records if "position" in r and np.isfinite(r["position"]).sum() > 2]
    if not known:
        return False  # what is missing is told of elsewhere
    noise = float(np.sqrt(sensor_variances(known, model)[0]))
    ways = [r["position"][np.isfinite(r["position"])] for r in known]
    return all(0.5 * float(np.ptp(way)) <= STILL * noise or np.unique(way).size <= STEPS for way in ways)


def is_blind(hand: Round) -> bool:
    """Whether the recordings tell nothing: not even the inertia that the drive moves shows in them."""
    for knob, column, value in zip(hand.fitted.knobs, hand.fitted.jacobian.T, hand.fitted.values, strict=True):
        if knob.place == -1 and knob.name == "output_inertia":
            return bool(np.sqrt(column @ column) * BLUR * abs(value) / knob.scale < 1.0)
    return False


def nothing_told(joint: str, says: str) -> Reconciliation:
    """Give the answer for recordings that can tell nothing."""
    return Reconciliation(
        joint=joint,
        verdict="not_enough_data",
        mismatch={"detected": False, "p_value": 1.0, "effect": 0.0},
        location={"component": None, "signals": [], "where": [], "when": [], "bands_hz": []},
        omitted_physics=(),
        indistinguishable=(),
        parameters={},
        fit={},
        says=says,
    )
