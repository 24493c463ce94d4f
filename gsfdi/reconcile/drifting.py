"""The way that a told speed would have covered, less that of the positions: a line, unless the law is wrong."""

import numpy as np
from scipy.integrate import cumulative_trapezoid

from gsfdi.drive import measured_velocity
from gsfdi.reconcile.hand import Round
from gsfdi.types import Array, JointRecord


def drift_of(record: JointRecord, first: Round) -> tuple[Array, Array]:
    """Time, and the way that the told speed would have covered less that of the positions."""
    position, speed = record["position"], measured_velocity(record, first.stand.model)
    good = np.isfinite(position) & np.isfinite(speed)
    t, speed = record.t[good], speed[good]
    return t, cumulative_trapezoid(speed, t, initial=0) / first.stand.scales.turns - position[good]


def line_over(t: Array) -> Array:
    """Orthonormal columns ``(n, 2)`` that span every straight line over time."""
    return np.asarray(np.linalg.qr(np.column_stack([np.ones(len(t)), t]))[0])


def beside(basis: Array, values: Array) -> Array:
    """Give values less what orthonormal columns can take over of them."""
    return np.asarray(values - basis @ (basis.T @ values))


def gained(share: float, samples: int) -> float:
    """Log-likelihood gained where a share of what is left over so many samples is explained."""
    return 0.5 * samples * float(np.log(1.0 / max(1.0 - share, 1e-12)))


def position_of(record: JointRecord) -> Array:
    """Recorded position, on lines where samples are lost."""
    present = np.isfinite(record["position"])
    return np.interp(record.t, record.t[present], record["position"][present])
