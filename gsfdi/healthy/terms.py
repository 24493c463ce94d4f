"""Terms that a fault-free joint may be found to have, and which of them its motion can show."""

from collections.abc import Mapping, Sequence

import numpy as np

from gsfdi.directions import DIRECTIONS, Direction
from gsfdi.nominal import Nominal
from gsfdi.stretches import Stretch

BY_KEY: Mapping[str, Direction] = {one.key: one for one in DIRECTIONS}
LEARNT = (
    "constant_load", "coulomb_friction:motor", "viscous_friction:motor", "asymmetric_friction", "stribeck_friction",
    "gravity_unbalance:s", "gravity_unbalance:c", "cable_harness", "quadratic_friction", "load_dependent_friction",
    *(one.key for one in DIRECTIONS if one.fault in ("cogging", "torque_ripple")),
)  # fmt: skip
"""Terms that a fault-free joint may be found to have."""
SIMPLE = LEARNT[:4] + LEARNT[5:7]
"""Those of them that a first regression may find."""


def terms_shown(nominal: Nominal, parts: Sequence[Stretch]) -> tuple[str, ...]:
    """Terms to learn: those that this joint's motion can tell from nothing."""
    reach = float(np.ptp(np.concatenate([part.values["position"] for part in parts])))
    keys = [key for key in LEARNT if nominal.flexible or BY_KEY[key].rigid]
    if reach < 0.3:
        keys = [key for key in keys if not key.startswith("gravity")]
    turns = reach * nominal.plant.gear_ratio / (2.0 * np.pi)  # a wave that does not come round twice is a slope
    waves = {key for key in keys if BY_KEY[key].fault in ("cogging", "torque_ripple")}
    return tuple(key for key in keys if key not in waves or turns * _order(key) > 2.0)


def _order(key: str) -> int:
    return int(key.partition(":")[2][:-1])
