from dataclasses import replace

import numpy as np
import pytest

from gsfdi.errors import UnusableInputError
from gsfdi.model import Controller, JointModel, Plant, TermUse
from gsfdi.modelfile import terms
from gsfdi.packed import compiled, era, longest_step, pack, plant_at, stack, values_of
from gsfdi.replay import layout

ERA = JointModel(
    "era", "flexible", Plant(400.0, 0.0011, 260.6, 130000.0, 0.4, 0.6), controller=Controller(28, 4, 17, 100)
)
GAP = TermUse("backlash", {"half_width_rad": 1e-3})
DRY = TermUse("coulomb_friction", {"torque_nm": 2.0}, "output")


def step(*uses: TermUse) -> float:
    model = replace(ERA, physics=uses)
    return longest_step(model, era(model, 0.0))


def test_a_packed_model_holds_its_terms_by_slot() -> None:
    packed = pack(replace(ERA, physics=(GAP, DRY, DRY)))
    first = packed[layout.FIRST : layout.FIRST + layout.SLOTS + 1]
    assert first[layout.OUTPUT_DRY + 1] - first[layout.OUTPUT_DRY] == 2
    assert first[layout.WINDUP + 1] - first[layout.WINDUP] == 1
    assert first[-1] == 3
    rows = packed[layout.ERA_ROWS + layout.ERA_WIDTH :].reshape(3, layout.TERM_WIDTH)
    np.testing.assert_array_equal(rows[:, layout.PARAMS], [2.0, 2.0, 1e-3])
    assert rows[2, layout.ADDRESS] == compiled(terms()["backlash"].law).address


def test_a_rigid_joint_has_one_side() -> None:
    packed = pack(JointModel("j", "rigid", Plant(2.0), physics=(DRY,)))
    assert packed[layout.FIRST + layout.MOTOR_DRY + 1] == 1
    with pytest.raises(UnusableInputError, match="it needs a flexible joint"):
        pack(JointModel("j", "rigid", Plant(2.0), physics=(GAP,)))


def test_changes_of_the_plant_make_eras() -> None:
    soft = TermUse("stiffness_change", {"ratio": 0.5}, onset=3.0)
    heavy = TermUse("output_inertia_change", {"ratio": 2.0})
    model = replace(ERA, physics=(soft, heavy))
    assert plant_at(model, 0.0) == replace(ERA.plant, output_inertia=800.0)
    assert plant_at(model, 3.0) == replace(ERA.plant, output_inertia=800.0, stiffness=65000.0)
    assert pack(model)[layout.ERAS] == 2


def test_the_step_resolves_what_acts() -> None:
    assert step() == pytest.approx(0.5 / (2 * np.pi * 7.23), rel=0.01)
    assert step(DRY) == pytest.approx(0.5 * step(), rel=1e-6)
    assert step(GAP) == pytest.approx(step(DRY), rel=1e-6)
    wave = TermUse("transmission_error", {"amplitude_rad": 1e-4, "order": 9.0})
    assert step(wave) == pytest.approx(step(GAP), rel=1e-6)
    stiff = TermUse("presliding_friction", {"torque_nm": 2.0, "stiffness_nm_rad": 1e7}, "motor")
    assert step(stiff) == pytest.approx(0.25 / np.sqrt(1e7 / 74.7), rel=0.02)


def test_what_a_use_leaves_out_stands_at_its_start() -> None:
    np.testing.assert_array_equal(values_of(TermUse("cogging", {"order": 24.0})), [2.0, 24.0, 0.0])


def test_models_of_any_size_stack() -> None:
    packed = [pack(ERA), pack(replace(ERA, physics=(GAP, DRY)))]
    both = stack(packed)
    assert both.shape == (2, packed[1].size)
    np.testing.assert_array_equal(both[0, : packed[0].size], packed[0])


def test_an_unknown_term_is_refused_by_its_nearest_name() -> None:
    with pytest.raises(UnusableInputError, match="did you mean 'backlash'"):
        pack(replace(ERA, physics=(TermUse("backlas"),)))
