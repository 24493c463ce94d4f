"""A quick look at a stretch: how loud its innovations are, which is all that most of a long batch is asked."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gsfdi.directions import Direction
from gsfdi.nominal.description import Nominal
from gsfdi.nominal.observing import GATE, acting, age_of, learnt, roughly, speed_of
from gsfdi.observer import Filter, padded, powers
from gsfdi.stretches import Stretch
from gsfdi.types import Array


class Screen(NamedTuple):
    """The observer laid out for a quick look: model and gains, padded to four states and two outputs."""

    run: Filter
    A: Array
    B: Array
    C: Array
    L: Array
    W: Array


def screen(run: Filter) -> Screen:
    """Lay an observer out for `loudness`."""
    L = padded(run.Ad @ run.gains, len(run.gains), 4, 2)
    return Screen(run, padded(run.Ad, 4, 4), padded(run.Bu, 4), padded(run.C, 2, 4), L, padded(run.weight, 2, 2))


def loudness(
    nominal: Nominal,
    screen: Screen,
    stretch: Stretch,
    directions: Mapping[str, Direction],
    edges: Sequence[int],
) -> Array:
    """Mean weighted square of the innovations of each slab of a stretch, the observer starting anew in each.

    Infinite where a sample stands out, NaN where none counts.

    Parameters
    ----------
    nominal : Nominal
    screen : Screen
        Its observer, laid out for this.
    stretch : Stretch
    directions : mapping of str to Direction
        What the learnt terms are, by key.
    edges : sequence of int
        Where the slabs begin, and where the last one ends.
    """
    u = acting(nominal, stretch)
    first = stretch.values["position"]
    second = stretch.values[nominal.velocity] if nominal.velocity else np.zeros_like(first)
    push, age = np.zeros((1, 4)), np.arange(len(u))
    if any(nominal.terms.values()):
        torque, stuck = learnt(nominal, directions, roughly(nominal, stretch))
        later = np.concatenate([torque[1:], torque[-1:]])
        push = padded(torque @ screen.run.Bt0.T + later @ screen.run.Bt1.T, len(u), 4)
        age = age_of(~stuck)
    starts = np.array(edges[:-1])
    x = np.zeros((len(starts), 4))
    x[:, 0] = first[starts]
    x[:, 1] = np.median(speed_of(nominal, stretch)[starts[:, None] + np.arange(5)], axis=1)
    together = powers(
        *screen[1:], GATE, (first, second), u, push, stretch.trusted, age, x, np.array(edges), screen.run.settled
    )
    return np.asarray(together)
