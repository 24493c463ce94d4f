"""Contracts over the shelf of detectors."""

import numpy as np
import pytest
from joints import gathered, learnt, record

from gsfdi.baseline import detectors
from gsfdi.detectors import innovations, smi
from gsfdi.directions import library
from gsfdi.types import Finding, JointRecord

NAMES = sorted(detectors())
RATE = 1e-4
SEEN_BY = {
    "signals": ("constant_load=20",),
    "parity": ("torque_constant_change=0.9",),
    "innovations": ("torque_constant_change=0.98",),
    "smi": ("torque_constant_change=0.3",),
}
"""A fault that each detector must see."""


def looked(name: str, batch: JointRecord) -> Finding | None:
    one, known = detectors()[name], learnt()
    return one.look(gathered(batch)[name], known.learnt[name], RATE, one.settings)


@pytest.mark.parametrize("name", NAMES)
def test_it_says_what_it_is(name: str) -> None:
    one = detectors()[name]
    assert one.method in ("signal", "parity", "smi")
    assert one.source
    assert 0 < one.false_alarm_rate <= 1
    assert name in SEEN_BY, "every detector names a fault that it must see"


@pytest.mark.parametrize("name", NAMES)
def test_healthy_batches_stay_quiet(name: str) -> None:
    for seed in range(50, 58):
        found = looked(name, record(seed=seed))
        assert found is None or not found.alarm, f"seed {seed}: {found.sentence}"


@pytest.mark.parametrize("name", NAMES)
def test_its_fault_is_seen(name: str) -> None:
    found = looked(name, record(*SEEN_BY[name], seed=60))
    assert found is not None
    assert found.alarm
    assert found.p_value < RATE


@pytest.mark.parametrize("name", NAMES)
def test_it_answers_alike_and_edits_nothing(name: str) -> None:
    one, known = detectors()[name], learnt()
    numbers = gathered(record(seed=61))
    before = {key: values.copy() for key, values in numbers[name].items()}
    first, second = (one.look(numbers[name], known.learnt[name], RATE, one.settings) for _ in range(2))
    assert first is not None
    assert second is not None
    assert (first.p_value, first.statistic, first.alarm) == (second.p_value, second.statistic, second.alarm)
    assert all(np.array_equal(before[key], numbers[name][key], equal_nan=True) for key in before)


@pytest.mark.parametrize("name", NAMES)
def test_pieces_give_what_the_whole_gives(name: str) -> None:
    """A day is judged in pieces; the seams may cost a little, never a verdict."""
    from gsfdi.baseline import part_of

    whole = record("torque_constant_change=0.9", seed=62)
    half = len(whole.t) // 2
    one, known = detectors()[name], learnt()
    answers = []
    for pieces in ([whole], [part_of(whole, 0, half), part_of(whole, half, len(whole.t))]):
        found = one.look(gathered(*pieces)[name], known.learnt[name], RATE, one.settings)
        assert found is not None
        answers.append(found)
    assert answers[0].alarm == answers[1].alarm
    assert answers[1].statistic == pytest.approx(answers[0].statistic, rel=0.5)


@pytest.mark.parametrize("alike", [0.0, 0.6, 0.8, 0.9])
def test_sine_and_cosine_keep_their_rate_however_alike_they_are(alike: float) -> None:
    """A small motion hardly tells them apart, and what a short baseline knows of them it knows of both at once."""
    directions = library(True, True, temperature=False)
    pair = [one.key for one in directions].index("gravity_unbalance:s") + np.arange(2)
    rng, info = np.random.default_rng(5), 100.0

    def batch(bins: int) -> dict[str, np.ndarray]:
        sums = {key: np.zeros((bins, len(directions))) for key in "ghx"}
        sums["g"][:, pair] = rng.multivariate_normal([0.0, 0.0], info * np.array([[1.0, alike], [alike, 1.0]]), bins)
        sums["h"][:, pair], sums["x"][:, pair] = info, alike * info
        energy = np.column_stack([np.full(bins, 50.0), np.full(bins, 25.0)])
        about = {"width": np.array([0.25]), "kind": np.array([1.0, 1.0, 0.0]), "terms": np.array([0.0])}
        return {**sums, "energy": energy, **about}

    largest = []
    for _ in range(40):
        known = innovations.learn([batch(100) for _ in range(4)], innovations.DETECTOR.settings)
        (lean,) = innovations.leans(batch(8000), known, directions)
        largest.append(lean.z)
    assert max(largest) < 3.3, "forty batches: one in a thousand each"
    assert np.median(largest) > 0.5, "nor is it blind"


def test_a_step_is_dated_to_where_it_was_first_seen() -> None:
    """Of a long batch most is screened only; between what was scored, every onset explains as much."""
    directions = library(True, True, temperature=False)
    j = [one.key for one in directions].index("viscous_friction:motor")
    sums = {key: np.zeros((1000, len(directions))) for key in "ghx"}
    scored = np.r_[0:100, 150:160, 600:700]
    rng = np.random.default_rng(8)
    sums["h"][scored, j] = 100.0
    sums["g"][scored, j] = 10.0 * rng.standard_normal(len(scored)) + 100.0 * (scored >= 600)
    energy = np.column_stack([2.0 * (sums["h"][:, j] > 0), sums["h"][:, j] > 0])
    batch = {**sums, "energy": energy, "width": np.array([2.0]), "kind": np.array([1.0, 1.0, 0.0])}
    none = np.zeros(len(directions))
    known = dict.fromkeys(("lean", "drift", "lean_var", "between", "swing", "shared"), none)
    (lean,) = innovations.leans(batch, {**known, "within": none + 1.0, "tolerance": np.zeros(1)}, directions)
    assert (lean.onset, lean.ramp) == (600, False)


@pytest.mark.parametrize(("scatter", "alarm"), [(0.9, True), (1.1, False)])
def test_a_drive_is_not_called_strong_where_healthy_blocks_do_not_agree_on_it(scatter: float, alarm: bool) -> None:
    one, known = detectors()["smi"], learnt().learnt["smi"]
    usual = np.array([-100.0, scatter * smi.AGREED, known["gain"][2]])
    found = one.look(gathered(record(seed=62))["smi"], {**known, "gain": usual}, RATE, one.settings)
    assert found is not None
    assert found.alarm == alarm
