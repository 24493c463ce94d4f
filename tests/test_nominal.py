"""The compiled observer against plain transcriptions."""

from dataclasses import replace
from itertools import pairwise

import naive
import numpy as np
import pytest
from joints import learnt, record

from gsfdi.baseline.gathering import parts_of
from gsfdi.directions import DIRECTIONS, library
from gsfdi.healthy import BY_KEY
from gsfdi.model import Plant
from gsfdi.nominal import Nominal, entries, filtered, loudness, observer, score, screen, watch
from gsfdi.nominal.observing import GATE
from gsfdi.observer import LANES, innovations

FRICTION = {"coulomb_friction:motor": 3.0, "viscous_friction:motor": 20.0}
NOMINALS = {
    "flexible": learnt().nominal,
    "with friction": replace(learnt().nominal, terms=FRICTION, held=0.3),
    "without a speed": replace(learnt().nominal, velocity="", weight=()),
    "rigid": replace(learnt().nominal, plant=Plant(474.7, 0.0, 260.6, damping=0.4, torque_constant=0.6), weight=()),
}


@pytest.fixture(params=NOMINALS)
def nominal(request: pytest.FixtureRequest) -> Nominal:
    return NOMINALS[request.param]


def test_directions_are_scored_as_one_by_one(nominal: Nominal) -> None:
    run = observer(nominal)
    slab = next(parts_of(record(duration=6.0), nominal, 0))
    seen = watch(nominal, run, slab, BY_KEY)
    seen = seen._replace(used=np.where(np.arange(len(seen.used)) % 97 == 50, 0.0, 1.0))
    directions = library(nominal.flexible, bool(nominal.velocity), temperature=False)
    entry = entries(nominal, run, directions)
    size = np.column_stack(
        [np.zeros(len(seen.u)) if one.shape is None else one.shape(seen.moving) for one in directions]
    )
    bins = np.arange(len(seen.u)) // 250
    fast = score(run, entry, seen, directions, bins, int(bins[-1]) + 1)
    g, h, H = naive.scored(run, entry, seen, size)
    scale = np.sqrt(np.maximum(h, 1e-9 * h.max()))  # a bias that the observer started from shows nothing
    assert fast.g.sum(axis=0) / scale == pytest.approx(g / scale, abs=1e-6)
    assert fast.h.sum(axis=0) == pytest.approx(h, rel=1e-6)
    assert fast.H / np.outer(scale, scale) == pytest.approx(H / np.outer(scale, scale), abs=1e-6)
    live = seen.live * seen.used
    assert fast.energy[:, 1] == pytest.approx(np.bincount(bins, live))


def test_every_direction_finds_a_lane() -> None:
    assert len(DIRECTIONS) <= LANES


def test_the_quick_look_is_as_loud_as_the_observer(nominal: Nominal) -> None:
    run = observer(nominal)
    slab = next(parts_of(record(seed=5), nominal, 0))
    seen = filtered(nominal, run, slab, BY_KEY)
    e = seen.e[seen.live * seen.used > 0]
    mean = np.einsum("ki,ij,kj->", e, run.weight, e) / len(e)
    quick = loudness(nominal, screen(run), slab, BY_KEY, [0, len(slab.trusted)])[0]
    # A joint that departs wildly is over the gate somewhere, and so is never passed over.
    assert quick == (pytest.approx(mean, rel=1e-9) if seen.used.all() and np.isfinite(quick) else np.inf)


def test_the_observer_forgets_what_a_stick_did_to_it() -> None:
    known, batch = learnt().nominal, record("coulomb_friction=3", seed=7)
    known = replace(known, terms={"coulomb_friction:motor": 3.0})
    run = observer(known)
    seen = filtered(known, run, next(parts_of(batch, known, 0)), BY_KEY)
    assert (seen.age[~seen.free] == 0).all()
    assert (seen.live[seen.age < run.settled] == 0).all()
    after, since = (seen.live > 0) & (seen.age < 2 * run.settled), np.arange(len(seen.u))
    start = np.array([seen.y[0, 0], np.median(seen.rough.speed[:5]), 0.0, 0.0])
    mindful, _, _ = innovations(*run[:-1], GATE, seen.y, seen.u, seen.torque, since, start)
    usual, forgot, kept = (
        np.einsum("ki,ij,kj->k", e[some], run.weight, e[some]).mean()
        for e, some in ((seen.e, seen.age > 300), (seen.e, after), (mindful, after))
    )
    assert forgot < 2.0 * usual
    assert kept > 4.0 * forgot  # or this test would show nothing


def test_what_a_friction_held_is_learnt_from_two_samples_however_small_the_noise() -> None:
    fine = Nominal(Plant(output_inertia=95.0), "drive_torque", "", 1e-3, noise=(1e-8, 1e-8), unrest=0.1)
    rough = replace(fine, terms={"coulomb_friction:motor": 20.0})
    assert observer(fine).gains[1, 1, 0] * fine.step < 0.7
    assert observer(rough).gains[1, 1, 0] * fine.step > 0.9


def test_a_lone_value_makes_a_slab_infinitely_loud() -> None:
    known = learnt().nominal
    slab = next(parts_of(record(seed=5), known, 0))
    values = {**slab.values, "position": slab.values["position"].copy()}
    values["position"][2000] += 1.0
    slab = slab._replace(values=values)
    quiet, loud = loudness(known, screen(observer(known)), slab, BY_KEY, [0, 1900, len(slab.trusted)])
    assert quiet < 3.0
    assert loud == np.inf


def test_slabs_are_as_loud_together_as_one_by_one(nominal: Nominal) -> None:
    run = screen(observer(nominal))
    part = next(parts_of(record(seed=5), nominal, 0))
    edges = [0, 1000, 2500, len(part.trusted)]
    together = loudness(nominal, run, part, BY_KEY, edges)
    alone = [
        loudness(nominal, run, part.between(low, high), BY_KEY, [0, high - low])[0] for low, high in pairwise(edges)
    ]
    assert together == pytest.approx(alone, rel=1e-2)
