"""Everything that the answer for one joint is told from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from gsfdi.fit import Started
from gsfdi.model import JointModel, TermUse
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.contest import Contest
from gsfdi.reconcile.contract import Settled
from gsfdi.reconcile.driving import levels
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.judge import Name
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.sheet import LawFinding
from gsfdi.reconcile.surplus import merged
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
        return self.settled.findings

    @property
    def noise_share(self) -> float:
        """Share of the parameters-only residual that noise alone makes up."""
        first, floor = float(np.sum(self.first.torque**2)), float(np.sum(self.floor**2))
        return min(1.0, floor / first) if first > 0 else 1.0

    @property
    def updated(self) -> JointModel:
        """The model with everything that was found in it, as a plain model file holds it."""
        return self.modelled(self.hand, self.findings)

    @property
    def refitted(self) -> JointModel:
        """The model with its parameters fitted, and no term that competed."""
        return self.modelled(self.first, ())

    def modelled(self, hand: Round, findings: Sequence[LawFinding]) -> JointModel:
        """Give the model of a round, with those findings in it that were put right in the records instead."""
        source: JointModel = hand.fitted.model
        if isinstance(source, Started):
            source = JointModel(**{f.name: getattr(source, f.name) for f in fields(JointModel)})
        given = len(self.settled.model.physics)
        if self.settled.level > 0:  # the constant of a recomputed effort belongs to the recording, not to the joint
            own = given - len(levels(self.settled.stand))
            source = replace(source, physics=(*source.physics[:own], *source.physics[given:]))
        apart = ("timestamp_latency", "quantisation")
        extra = [TermUse(f.term, dict(f.values), None, f.onset) for f in findings if f.term in apart]
        return merged(replace(source, sensors=self.nominal.sensors, physics=(*source.physics, *extra)))
