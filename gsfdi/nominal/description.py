"""What is known of the fault-free joint, in numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gsfdi.model import Plant


@dataclass(frozen=True, slots=True)
class Nominal:
    """The fault-free joint.

    Parameters
    ----------
    plant : Plant
    effort, velocity : str
        Channels of the drive's effort and of the speed; an empty velocity where none is measured.
    step : float
        Sampling period on which the observer runs [s].
    terms : mapping of str to float
        Coefficient of each learnt direction, by `Direction.key`.
    noise : tuple of float
        Standard deviation of position and velocity noise.
    unrest : float
        Standard deviation of what drives the joint beside its effort, in the effort's unit.
    held : float
        Share of the previous sample's effort in what acts over a step.
    slow : float
        Speed below which the sign of motion is not known.
    weight : tuple of tuple of float
        Inverse covariance of the innovations, learnt on fault-free batches.
    """

    plant: Plant
    effort: str
    velocity: str
    step: float
    terms: Mapping[str, float] = field(default_factory=dict)
    noise: tuple[float, ...] = (1e-5, 1e-2)
    unrest: float = 1e-3
    held: float = 0.0
    slow: float = 1e-3
    weight: tuple[tuple[float, ...], ...] = ()

    @property
    def flexible(self) -> bool:
        """Whether motor and link move apart."""
        return bool(np.isfinite(self.plant.stiffness))

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that the observer needs."""
        return ("position", self.effort) + ((self.velocity,) if self.velocity else ())

    @property
    def measured(self) -> int:
        """Number of measured outputs."""
        return 2 if self.velocity else 1
