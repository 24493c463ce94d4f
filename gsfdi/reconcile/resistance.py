"""What may resist a motion that hardly accelerates, each law linear in its coefficients."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gsfdi.model import TermUse
from gsfdi.reconcile.crawl import Crawl
from gsfdi.types import Array


def _any(_: Array) -> bool:
    return True


def _within_one(x: Array) -> bool:
    return bool(np.hypot(*x) < 1.0)


@dataclass(frozen=True, slots=True)
class Law:
    """One way to resist.

    Parameters
    ----------
    term : str
    columns : callable
        Motion -> torque ``(n, k)`` [N m] per unit of each coefficient.
    values : callable
        Coefficients ``(k,)`` -> numbers of the term.
    possible : callable
        Whether the term may have such coefficients.
    order : int
        Of its wave over a turn of the motor; 0 where it is none.
    """

    term: str
    columns: Callable[[Crawl], Array]
    values: Callable[[Array], Mapping[str, float]]
    possible: Callable[[Array], bool] = _any
    order: int = 0

    def use(self, coefficients: Array) -> TermUse:
        """Write the term as a model holds it."""
        return TermUse(self.term, self.values(coefficients), None, None)


def laws(orders: Sequence[int], amplifier: float | None, spare: Mapping[str, float]) -> list[Law]:
    """Lay out what may resist; of laws that are one on some motion the likelier comes first.

    Parameters
    ----------
    orders : sequence of int
        Of waves over a turn of the motor.
    amplifier : float or None
        Torque per unit of a measured current [N m/A]; None where torque is measured.
    spare : mapping of str to float
        How much of a term the model holds that may be too much.
    """

    def above(term: str) -> Callable[[Array], bool]:
        return lambda x: bool(x[0] > -spare.get(term, 0.0))

    steady = [_amount("constant_load", "torque_nm", lambda c: np.ones(len(c.turn)))]
    if amplifier is not None:
        steady.append(_amount("current_bias", "bias_a", lambda c: np.full(len(c.turn), amplifier)))
    return [
        _amount("coulomb_friction", "torque_nm", lambda c: c.way, above("coulomb_friction")),
        _amount("viscous_friction", "coefficient_nms_rad", lambda c: c.pace, above("viscous_friction")),
        *steady,
        Law("gravity_unbalance", lambda c: _waves(c.angle, 1), _weight),
        *(_wave("cogging", order, lambda c: np.ones(len(c.turn))) for order in orders),
        *(_wave("torque_ripple", order, lambda c: -c.drive, _within_one) for order in orders),
    ]


def _amount(term: str, number: str, column: Callable[[Crawl], Array], possible: Callable[[Array], bool] = _any) -> Law:
    return Law(term, lambda c: column(c)[:, None], lambda x: {number: float(x[0])}, possible)


def _wave(term: str, order: int, size: Callable[[Crawl], Array], possible: Callable[[Array], bool] = _any) -> Law:
    amplitude = "amplitude_nm" if term == "cogging" else "amplitude_ratio"

    def values(x: Array) -> Mapping[str, float]:
        return {amplitude: float(np.hypot(*x)), "order": float(order), "phase_rad": float(np.arctan2(x[1], x[0]))}

    return Law(term, lambda c: size(c)[:, None] * _waves(c.turn, order), values, possible, order)


def _waves(angle: Array, order: int) -> Array:
    """Sine and cosine ``(n, 2)``."""
    return np.column_stack([np.sin(order * angle), np.cos(order * angle)])


def _weight(x: Array) -> Mapping[str, float]:
    return {"torque_nm": float(np.hypot(*x)), "angle_rad": float(np.arctan2(-x[1], x[0]))}
