"""Everything that the answer for one joint is told from."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.compete import Contest
from gsfdi.reconcile.contract import Settled
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.judge import Name
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.types import Array


@dataclass(frozen=True, slots=True)
class Case:
    """A joint's recordings and model, and what came of them.

    Parameters
    ----------
    joint : str
    nominal : JointModel
        As it was given.
    settled : Settled
        Records and model with the contract put right.
    first, hand : Round
        Parameters only, and the model with every term that was found.
    contests : list of Contest
        How the terms were chosen.
    found : list of Name
        The terms.
    terms : mapping of str to PhysicsTerm
        The library.
    """

    joint: str
    nominal: JointModel
    settled: Settled
    first: Round
    hand: Round
    contests: list[Contest]
    found: list[Name]
    terms: Mapping[str, PhysicsTerm]

    @property
    def stand(self) -> Bench:
        """The recordings, put right, with the part that took no part in choosing and fitting."""
        return self.settled.stand.judged_in(self.hand.stand.window)

    @property
    def logged(self) -> Bench:
        """The recordings as they came, with the same part."""
        return self.settled.logged.judged_in(self.hand.stand.window)

    @property
    def floor(self) -> Array:
        """Torque noise that is known to be there [N m], by side."""
        return effort_floor(self.stand)

    @property
    def findings(self) -> list[LawFinding]:
        """What the law check and the values themselves told."""
        law = self.settled.law
        return [*(law.findings if law else ()), *self.settled.shown]

    @property
    def noise_share(self) -> float:
        """Share of the parameters-only residual that noise alone makes up."""
        first, floor = float(np.sum(self.first.torque**2)), float(np.sum(self.floor**2))
        return min(1.0, floor / first) if first > 0 else 1.0
