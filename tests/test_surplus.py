"""A nominal model that holds too much of a friction."""

from dataclasses import replace
from pathlib import Path

import pytest
from rigid import JOINT

from gsfdi.model import TermUse
from gsfdi.modelfile import dump, load_models
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.surplus import merged
from gsfdi.simulate import simulate_record


def viscous(value: float) -> TermUse:
    return TermUse("viscous_friction", {"coefficient_nms_rad": value})


def test_less_friction_than_the_model_holds_is_named_and_written_back(tmp_path: Path) -> None:
    records = [simulate_record(replace(JOINT, physics=(viscous(1.0),)), seed=s, duration=30.0) for s in (1, 2)]
    answer = reconcile(records, replace(JOINT, physics=(viscous(1.6),)))
    (entry,) = answer.omitted_physics
    assert entry["term"] == "viscous_friction"
    assert entry["parameters"]["coefficient_nms_rad"]["value"] == pytest.approx(-0.6, abs=0.15)
    assert "less than the model holds" in entry["says"]
    assert answer.updated_model is not None
    dump(answer.updated_model, tmp_path / "model.toml")  # a model file holds no negative friction
    (use,) = load_models(tmp_path / "model.toml").for_joint("J").physics
    assert use.values["coefficient_nms_rad"] == pytest.approx(1.0, rel=0.02)


def test_what_is_too_much_comes_off_the_terms_and_then_off_the_damping() -> None:
    damped = replace(JOINT, plant=replace(JOINT.plant, damping=0.5), physics=(viscous(0.4), viscous(-0.7)))
    put_right = merged(damped)
    assert put_right.physics == (viscous(0.0),)
    assert put_right.plant.damping == pytest.approx(0.2)
