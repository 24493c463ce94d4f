"""Bristles: both laws rise alike from rest, and part in what they remember of a reversal."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
from joints import MODEL, record, torn
from numpy.testing import assert_allclose

from gsfdi import motion
from gsfdi.model import TermUse
from gsfdi.motion import Law
from gsfdi.packed import compiled
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.knobs import term_knobs
from gsfdi.terms.gearbox_hysteresis import TERM as HYSTERESIS
from gsfdi.terms.presliding_friction import TERM as PRESLIDING
from gsfdi.types import Array

FORGETS, REMEMBERS = 0.0, 1.0


def torques(law: Law, places: Array, *values: float, begun: float = 0.0) -> Array:
    """Torque of a bristle with these values, along a path of whatever stretches it, from rest or already stretched."""
    m, p, s = np.zeros(motion.QUANTITIES), np.array(values), np.full(motion.STATES, np.nan)
    m[motion.BEGUN] = begun
    found = []
    for place in places:
        m[[motion.WINDUP, motion.ANGLE]] = place
        found.append(law(m, p, s))
    return np.array(found)


def stretches(places: Array, memory: float) -> Array:
    """Stretch of a bristle of torque 1 and width 1 along a path from rest."""
    return torques(HYSTERESIS.law, places, 1.0, 1.0, memory)


def elements(places: Array, count: int = 3000) -> Array:
    """The same of many springs that slip, each at its own stretch: what Masing's rules sum up."""
    slips = -np.log(1.0 - (np.arange(count) + 0.5) / count)
    stretch, found = np.zeros(count), []
    for move in np.diff(places, prepend=0.0):
        stretch = np.clip(stretch + move, -slips, slips)
        found.append(stretch.mean())
    return np.array(found)


@pytest.mark.parametrize("memory", [FORGETS, REMEMBERS])
def test_either_rises_from_rest_as_one_less_an_exponential(memory: float) -> None:
    places = np.linspace(0.0, 4.0, 30)
    assert_allclose(stretches(places, memory), 1.0 - np.exp(-places), atol=1e-12)


@pytest.mark.parametrize("memory", [FORGETS, REMEMBERS])
def test_one_that_begins_stretched_goes_on_as_if_it_had_come_there_from_rest(memory: float) -> None:
    places = np.concatenate([np.linspace(-1.0, 2.0, 40), np.linspace(2.0, 0.2, 20)])
    whole = stretches(places, memory)
    later = torques(HYSTERESIS.law, places[20:], 1.0, 1.0, memory, begun=whole[20])
    assert whole[20] > 0.4
    assert_allclose(later, whole[20:], atol=1e-12)


def test_one_that_remembers_is_many_springs_that_slip() -> None:
    rng = np.random.default_rng(5)
    places = np.concatenate([[0.0], np.cumsum(rng.normal(0.0, 0.3, 2000))])
    assert_allclose(stretches(places, REMEMBERS), elements(places), atol=3e-3)
    assert np.abs(stretches(places, FORGETS) - elements(places)).max() > 0.1


def test_a_small_loop_closes_for_one_that_remembers_and_drifts_for_one_that_forgets() -> None:
    loop = np.array([0.0, 1.0, 0.6, 1.0, 0.6, 1.0])
    closed, drifting = stretches(loop, REMEMBERS), stretches(loop, FORGETS)
    assert_allclose(closed[[3, 5]], closed[1], atol=1e-12)
    assert drifting[5] < drifting[3] < drifting[1] - 0.05


def test_more_reversals_than_it_can_hold_are_forgotten_from_within() -> None:
    shrinking = np.array([0.0, *(2.0 * 0.93**k * (-1) ** k for k in range(200))])
    assert_allclose(stretches(shrinking, REMEMBERS), elements(shrinking), atol=5e-3)


@pytest.mark.parametrize("memory", [FORGETS, REMEMBERS])
def test_stiffness_is_torque_over_width(memory: float) -> None:
    places = np.array([0.0, 0.3, 0.1, 0.5, -0.2])
    found = torques(PRESLIDING.law, places, 3.0, 6.0, memory)
    assert_allclose(found, 3.0 * stretches(places / 0.5, memory), atol=1e-12)


def test_the_compiled_law_is_the_same() -> None:
    pointer = ctypes.POINTER(ctypes.c_double)
    law = ctypes.CFUNCTYPE(ctypes.c_double, pointer, pointer, pointer)(compiled(HYSTERESIS.law).address)
    places = np.array([0.0, 1.0, 0.4, 0.9, 0.2, 1.5, -3.0])
    found = torques(lambda *arrays: law(*(a.ctypes.data_as(pointer) for a in arrays)), places, 1.0, 1.0, REMEMBERS)
    assert_allclose(found, stretches(places, REMEMBERS), atol=1e-12)


def test_a_bristle_stretched_by_what_a_gap_hides_is_no_other_physics() -> None:
    whole = record("presliding_friction=3,stiffness_nm_rad=300")
    (entry,) = reconcile([torn(whole, 8.0, 9.6)], MODEL).omitted_physics
    assert entry["term"] == "presliding_friction"
    assert entry["parameters"]["stiffness_nm_rad"]["value"] == pytest.approx(300.0, rel=0.03)


@pytest.mark.parametrize(
    "fault", ["presliding_friction=1.5,stiffness_nm_rad=5000", "gearbox_hysteresis=1.5,width_rad=2e-5"]
)
def test_reconcile_tells_what_the_bristles_remember(fault: str) -> None:
    (entry,) = reconcile([record(f"{fault},nonlocal_memory=1")], MODEL).omitted_physics
    assert f"{entry['term']}=1.5" == fault.split(",")[0]
    assert entry["parameters"]["torque_nm"]["value"] == pytest.approx(1.5, rel=0.02)
    assert entry["parameters"]["nonlocal_memory"] == {"value": 1.0, "ci95": [1.0, 1.0]}


@pytest.mark.parametrize("share", [1.0, 1e-3])
def test_a_faint_bristle_may_be_as_soft_as_a_strong_one(share: float) -> None:
    stand = bench([record()], MODEL)
    torque, stretch = share * stand.scales.torque, 0.3 * stand.scales.reach
    use = TermUse("presliding_friction", {"torque_nm": torque, "stiffness_nm_rad": torque / stretch})
    knobs = {knob.name: knob for knob in term_knobs(stand, replace(MODEL, physics=(use,)), 0)}
    assert knobs["stiffness_nm_rad"].low < torque / stretch
