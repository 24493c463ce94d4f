"""Frozen records that pass between the stages.

Nothing downstream edits what it was given: arrays that somebody could still write to are copied in, the others are
taken as they are, since a day of telemetry handed on ten times is ten days of copying.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from gsfdi.channels import Axis

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

Level = Literal["normal", "warning", "distress", "critical", "not_assessed", "invalid_data", "stale"]
Action = Literal["none", "inspect", "plan_maintenance", "stop_using", "check_telemetry"]
Component = Literal["motor", "friction", "gearbox", "link", "sensor", "controller"]


UNNAMED = "robot"
"""What a robot is called by telemetry that does not name it."""


def frozen(values: npt.ArrayLike) -> Array:
    """Copy `values` into a read-only float64 array."""
    return sealed(np.array(values, dtype=np.float64))


def sealed(array: Array) -> Array:
    """Make an array that nobody else holds read-only, in place."""
    array.setflags(write=False)
    return array


def _kept(values: npt.ArrayLike, kind: type) -> npt.NDArray[Any]:
    """The array itself if it is of this kind and nobody can write to it, else a read-only copy."""
    if isinstance(values, np.ndarray) and values.dtype == kind and _unwritable(values):
        return values
    array: npt.NDArray[Any] = np.array(values, dtype=kind)
    array.setflags(write=False)
    return array


def _unwritable(array: npt.NDArray[Any]) -> bool:
    """Whether neither the array nor what it looks into can be written to."""
    base: object = array
    while isinstance(base, np.ndarray):
        if base.flags.writeable:
            return False
        base = base.base
    return True


@dataclass(frozen=True, slots=True)
class Problem:
    """Something that was damaged, cut short or left out, and what would mend it."""

    path: str
    what: str
    mend: str = ""
    kind: Literal["unusable", "damaged", "left_out", "note"] = "damaged"


@dataclass(frozen=True, slots=True)
class JointRecord:
    """The telemetry of one joint over one stretch of time.

    Parameters
    ----------
    robot, joint : str
        Names.
    t0_ns : int
        Epoch time of the first sample [ns, UTC]; float64 epoch seconds resolve only 0.24 µs.
    t : (n,) array
        Time from `t0_ns` [s], not decreasing.
    channels : mapping of str to (n,) array
        Values as read, by channel name (see `gsfdi.channels`), in SI units; NaN where the source has none.
    axis : {'rotary', 'linear'}
        Kind of joint.
    valid : mapping of str to (n,) bool array
        Where a channel may be believed (`gsfdi.quality`); without an entry, wherever it is finite.
    source, sha256 : str
        The file it came from, and that file's hash.
    quality : mapping of str to mapping of str to float
        Counts per channel and kind of defect; the key ``"time"`` holds what is wrong with the clock.
    """

    robot: str
    joint: str
    t0_ns: int
    t: Array
    channels: Mapping[str, Array]
    axis: Axis = "rotary"
    valid: Mapping[str, Mask] = field(default_factory=dict)
    source: str = ""
    sha256: str = ""
    quality: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Keep the arrays, copies of those that could be written to."""
        object.__setattr__(self, "t", _kept(self.t, np.float64))
        channels = {name: _kept(values, np.float64) for name, values in self.channels.items()}
        masks = {name: _kept(mask, np.bool_) for name, mask in self.valid.items()}
        object.__setattr__(self, "channels", MappingProxyType(channels))
        object.__setattr__(self, "valid", MappingProxyType(masks))

    def __reduce__(self) -> tuple[type["JointRecord"], tuple[object, ...]]:
        """Pickle with plain mappings, so that a record can go to a worker process."""
        plain = {name: getattr(self, name) for name in self.__dataclass_fields__}
        plain |= {"channels": dict(self.channels), "valid": dict(self.valid)}
        return type(self), tuple(plain.values())

    def __contains__(self, channel: str) -> bool:
        """Whether the record carries `channel`."""
        return channel in self.channels

    def __getitem__(self, channel: str) -> Array:
        """`channel` with NaN wherever it may not be believed."""
        values = self.channels[channel]
        mask = self.valid.get(channel)
        return values if mask is None or mask.all() else sealed(np.where(mask, values, np.nan))

    @property
    def effort(self) -> str:
        """The channel that says what drives the joint: ``motor_current``, else ``drive_torque``."""
        return "motor_current" if "motor_current" in self.channels else "drive_torque"


@dataclass(frozen=True, slots=True)
class Batch:
    """The records of one call, and everything that was left out of them and why."""

    records: tuple[JointRecord, ...]
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True)
class Finding:
    """What one detector saw on one joint.

    `evidence` holds what a page needs to draw it: arrays and numbers by name.
    """

    detector: str
    method: Literal["signal", "parity", "smi", "diagnosis", "quality"]
    joint: str
    alarm: bool
    p_value: float
    statistic: float
    threshold: float
    unit: str
    sentence: str
    onset_s: float | None = None
    evidence: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Due:
    """When maintenance is due, with a 90 % interval (ISO dates), and why."""

    when: str | None
    interval90: tuple[str, str] | None
    reason: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is to be done about one joint, and why; the fields are the contract's."""

    joint: str
    verdict: Level
    action: Action
    component: Component | None
    fault: str | None
    fault_probability: float | None
    alternatives: tuple[Mapping[str, object], ...]
    onset_s: float | None
    methods: Mapping[str, Mapping[str, object]]
    due: Due
    says: str
    findings: tuple[Finding, ...] = ()
