"""A baseline as it is kept: what the fault-free joints of a robot do, to plain numbers and back."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gsfdi.errors import BaselineError
from gsfdi.model import Plant
from gsfdi.nominal import Nominal
from gsfdi.types import Array, Problem

_PLANT = ("output_inertia", "motor_inertia", "gear_ratio", "stiffness", "damping", "torque_constant")


@dataclass(frozen=True, slots=True)
class JointBaseline:
    """What the fault-free joint does.

    Parameters
    ----------
    joint, robot : str
    nominal : Nominal
        Its model, terms and noise.
    learnt : mapping of str to mapping of str to array
        By detector, what it learnt.
    batches : int
        Fault-free pieces it was learnt from.
    span : float
        Their total length [s].
    sources : tuple of str
        SHA-256 of the files.
    ranges : mapping of str to (float, float)
        Least and greatest value of each channel.
    """

    joint: str
    robot: str
    nominal: Nominal
    learnt: Mapping[str, Mapping[str, Array]]
    batches: int
    span: float
    sources: tuple[str, ...] = ()
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Baseline:
    """Baselines of a robot's joints by name, and what could not be learnt and why."""

    joints: Mapping[str, JointBaseline]
    problems: tuple[Problem, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Plain numbers for a store."""
        return {
            "schema": "gsfdi/baseline/2",
            "joints": {name: _joint_to_dict(one) for name, one in self.joints.items()},
        }

    @classmethod
    def from_dict(cls, kept: Mapping[str, Any]) -> "Baseline":
        """Take back what :meth:`to_dict` gave."""
        if kept.get("schema") != "gsfdi/baseline/2":
            raise BaselineError("baseline", f"schema {kept.get('schema')!r} is not 'gsfdi/baseline/2'", "learn it anew")
        return cls({name: _joint_from_dict(name, one) for name, one in kept["joints"].items()})


def _joint_to_dict(one: JointBaseline) -> dict[str, object]:
    nominal = one.nominal
    plant = {name: getattr(nominal.plant, name) for name in _PLANT}
    if not nominal.flexible:
        plant.pop("stiffness")
    return {
        "robot": one.robot, "batches": one.batches, "span": one.span, "sources": list(one.sources),
        "ranges": {name: list(pair) for name, pair in one.ranges.items()},
        "learnt": {name: dict(numbers) for name, numbers in one.learnt.items()},
        "nominal": {
            "plant": plant, "effort": nominal.effort, "velocity": nominal.velocity, "step": nominal.step,
            "terms": dict(nominal.terms), "noise": list(nominal.noise), "unrest": nominal.unrest, "held": nominal.held,
            "slow": nominal.slow, "weight": [list(row) for row in nominal.weight],
        },
    }  # fmt: skip


def _joint_from_dict(name: str, kept: Mapping[str, Any]) -> JointBaseline:
    held = kept["nominal"]
    nominal = Nominal(
        Plant(**held["plant"]), held["effort"], held["velocity"], float(held["step"]), dict(held["terms"]),
        tuple(held["noise"]), float(held["unrest"]), float(held["held"]), float(held["slow"]),
        tuple(tuple(row) for row in held["weight"]),
    )  # fmt: skip
    learnt = {
        detector: {key: np.asarray(values, dtype=np.float64) for key, values in numbers.items()}
        for detector, numbers in kept["learnt"].items()
    }
    ranges = {channel: (float(low), float(high)) for channel, (low, high) in kept["ranges"].items()}
    return JointBaseline(
        name, kept["robot"], nominal, learnt, int(kept["batches"]), float(kept["span"]), tuple(kept["sources"]), ranges
    )
