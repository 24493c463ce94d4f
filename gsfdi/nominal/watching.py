"""A stretch as directions are evaluated on it: what the observer saw, and its states calmed."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gsfdi.directions import Direction, Moving
from gsfdi.nominal.calming import calm, ceiling_of
from gsfdi.nominal.description import Nominal
from gsfdi.nominal.observing import filtered
from gsfdi.observer import Filter
from gsfdi.stretches import Stretch
from gsfdi.types import Array, Mask


class Watched(NamedTuple):
    """A stretch as the observer saw it; `states` and `u` are calmed, for directions to be evaluated on.

    ``y (n, p)`` the outputs, ``acting (n,)`` the effort and ``torque (n, 3)`` the learnt terms in the model.
    """

    stretch: Stretch
    y: Array
    acting: Array
    torque: Array
    moving_freely: Mask
    age: npt.NDArray[np.int64]
    e: Array
    states: Array
    used: Array
    live: Array
    u: Array
    moving: Moving


def watch(nominal: Nominal, run: Filter, stretch: Stretch, directions: Mapping[str, Direction]) -> Watched:
    """Run the observer over a stretch, and prepare what directions are evaluated on."""
    seen = filtered(nominal, run, stretch, directions)
    # The noise of the measured effort reaches states and innovations alike; a regressor that held it would lean on a
    # healthy joint, so what the directions are evaluated on is kept below the frequency where the effort is noise.
    ceiling = ceiling_of(seen.u, stretch.step)
    calmed = calm(np.column_stack([seen.states, seen.u]), stretch.step, ceiling)
    states, u = np.ascontiguousarray(calmed[:, :-1]), np.ascontiguousarray(calmed[:, -1])
    rough = seen.rough._replace(drive=nominal.plant.gear_ratio * nominal.plant.torque_constant * u)
    return Watched(stretch, seen.y, seen.u, seen.torque, seen.free, seen.age, seen.e, states, seen.used, seen.live, u,
                   _observed(nominal, rough, states))  # fmt: skip


def _observed(nominal: Nominal, rough: Moving, states: Array) -> Moving:
    """Motion as the observer has it; wind-up and load where the joint is flexible."""
    plant = nominal.plant
    if not nominal.flexible:
        acceleration = np.gradient(states[:, 1], nominal.step)
        angle, speed = states.T
        return rough._replace(
            angle=angle, speed=speed, acceleration=acceleration, motor_angle=angle, motor_speed=speed,
            motor_acceleration=acceleration, load=rough.drive,
        )  # fmt: skip
    angle, speed, windup, rate = states.T
    load = -plant.stiffness * windup
    return rough._replace(
        angle=angle + windup, speed=speed + rate,
        acceleration=(load - plant.damping * (speed + rate)) / plant.output_inertia,
        motor_angle=angle, motor_speed=speed, windup=windup, windup_rate=rate, load=load,
        motor_acceleration=(rough.drive - load) / (plant.gear_ratio**2 * plant.motor_inertia),
    )  # fmt: skip
