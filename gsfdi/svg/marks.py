"""What can be drawn over common axes."""

from dataclasses import dataclass
from typing import Literal

import numpy.typing as npt

Tone = Literal["measured", "command", "before", "after", "alarm", "quiet"]


@dataclass(frozen=True, slots=True)
class Line:
    """A curve through samples; NaN breaks it."""

    x: npt.ArrayLike
    y: npt.ArrayLike
    label: str
    tone: Tone = "measured"


@dataclass(frozen=True, slots=True)
class Points:
    """Single samples, not joined."""

    x: npt.ArrayLike
    y: npt.ArrayLike
    label: str
    tone: Tone = "measured"


@dataclass(frozen=True, slots=True)
class Ribbon:
    """The room between two curves, for instance an interval."""

    x: npt.ArrayLike
    low: npt.ArrayLike
    high: npt.ArrayLike
    label: str
    tone: Tone = "quiet"


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of the horizontal axis, shaded."""

    start: float
    end: float
    label: str


@dataclass(frozen=True, slots=True)
class Level:
    """A threshold: a horizontal line with its name."""

    y: float
    label: str


@dataclass(frozen=True, slots=True)
class Instant:
    """A vertical line with its name, for instance an onset."""

    x: float
    label: str


Mark = Line | Points | Ribbon | Span | Level | Instant
