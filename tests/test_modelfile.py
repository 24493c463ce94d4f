import json
import tomllib
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gsfdi
from gsfdi.errors import UnusableInputError
from gsfdi.model import Bus, Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.modelfile import dump, load_models, terms
from gsfdi.modelfile.schema import schema
from gsfdi.modelfile.writing import document_of

ROOT = Path(gsfdi.__file__).parents[1]
CONFIGS = [ROOT / "configs" / f"{name}.toml" for name in ("era_joint", "emps_joint", "era_arm")]
SCHEMA = schema()
ERA = (ROOT / "configs" / "era_joint.toml").read_text()


def complaint(tmp_path: Path, text: str) -> str:
    path = tmp_path / "m.toml"
    path.write_text(text)
    with pytest.raises(UnusableInputError) as caught:
        list(load_models(path))
    return str(caught.value).replace(str(tmp_path), "")


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.name)
def test_configurations_read_and_fit_the_schema(path: Path) -> None:
    assert list(load_models(path))
    jsonschema.validate(tomllib.loads(path.read_text()), SCHEMA)


def test_the_papers_joint() -> None:
    model = load_models(ROOT / "configs" / "era_joint.toml").for_joint("SH1")
    assert model.name == "SH1"
    assert model.plant == Plant(400.0, 0.0011, 260.6, 130000.0, 0.4, 0.6)
    assert model.controller == Controller(28.0, 4.0, 17.0, 100.0)
    assert model.sensors == Sensors(
        position_resolution=1e-6, position_noise=4e-6, motor_velocity_noise=2e-3, effort_noise=2e-4
    )
    assert model.effort == "motor_current"


def test_a_rigid_linear_drive() -> None:
    model = load_models(ROOT / "configs" / "emps_joint.toml").for_joint("EMPS")
    assert (model.structure, model.axis, model.effort) == ("rigid", "linear", "drive_torque")
    assert model.plant == Plant(95.1)
    assert model.controller == Controller(1370728.5, 0.0, 8557.43, 1000.0, 0.0, effort="drive_torque")


def test_an_arm_overrides_what_stands_at_the_top() -> None:
    models = load_models(ROOT / "configs" / "era_arm.toml")
    assert list(models.joints) == ["SH1", "SH2", "EL", "WR1", "WR2", "WR3", "EE"]
    wrist = models.for_joint("WR1")
    assert wrist.plant.output_inertia == 60.0
    assert wrist.plant.stiffness == models.for_joint("SH2").plant.stiffness == 130000.0
    assert wrist.controller is not None
    assert (wrist.controller.proportional, wrist.controller.limit) == (7.9, 20.0)
    with pytest.raises(UnusableInputError, match="did you mean 'SH"):
        models.for_joint("SH9")


def test_the_published_schema_is_the_readers() -> None:
    assert json.loads((ROOT / "gsfdi" / "model.schema.json").read_text()) == json.loads(json.dumps(SCHEMA))


NAMES = sorted(terms())
NUMBERS = st.floats(0.01, 100.0)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(data=st.data())
def test_what_is_written_reads_back(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    structure, axis = (
        data.draw(st.sampled_from(["flexible", "rigid"])),
        data.draw(st.sampled_from(["rotary", "linear"])),
    )
    effort = data.draw(st.sampled_from(["motor_current", "drive_torque"]))
    numbers = [data.draw(NUMBERS) for _ in range(20)]
    gear = numbers[0]
    plant = Plant(numbers[1], gear_ratio=gear, damping=numbers[2], torque_constant=numbers[3])
    if structure == "flexible":
        plant = replace(plant, motor_inertia=numbers[4], stiffness=numbers[5])
    if effort == "drive_torque":
        plant = replace(plant, torque_constant=1 / gear)
    uses = []
    for name in data.draw(st.lists(st.sampled_from(NAMES), max_size=3)):
        term = terms()[name]
        if structure in term.structures:
            values = {param.name: data.draw(st.floats(param.low, min(param.high, 1e3))) for param in term.params}
            side = data.draw(st.sampled_from([None, *term.sides]))
            own_onset = any(param.name == "onset_s" for param in term.params)
            uses.append(TermUse(name, values, side, None if own_onset else data.draw(st.sampled_from([None, 7.5]))))
    model = JointModel(
        "J",
        structure,
        plant,
        axis,
        data.draw(st.sampled_from([None, Controller(*numbers[6:11], limit=numbers[11], effort=effort)])),
        Sensors(*numbers[12:18]),
        tuple(uses),
        Bus(0.01, 0.002, 0.1, 0.2),
        {"stiffness": 0.1},
        effort,
    )
    path = tmp_path_factory.mktemp("m") / "m.toml"
    dump(model, path)
    assert load_models(path).for_joint("J") == model
    jsonschema.validate(document_of(model), SCHEMA)


@pytest.mark.parametrize(
    ("old", "new", "line", "says"),
    [
        ("gearbox_stiffness_nm_rad", "gearbox_stiffness_nm_deg", 12, "did you mean 'gearbox_stiffness_nm_rad'"),
        ("gear_ratio = 260.6", "gear_ratio = -1", 10, "give a value above 0"),
        ("gear_ratio = 260.6", 'gear_ratio = "many"', 10, "'many' is not a number"),
        ("gear_ratio = 260.6", "gear_ratio = true", 10, "True is not a number"),
        ("gear_ratio = 260.6", "gear_ratio = nan", 10, "nan is impossible"),
        ("gear_ratio = 260.6\n", "", 8, "gear_ratio is missing"),
        ('structure = "flexible"', 'structure = "flexibel"', 6, "did you mean 'flexible'"),
        ('structure = "flexible"', 'structure = "rigid"', 8, "a rigid joint has no gearbox spring"),
        ('type = "pid"', 'type = "lqr"', 17, "'lqr' is not known"),
        ("torque_constant_nm_a = 0.6", "", 8, "torque_constant_nm_a is missing"),
        ("[controller]", "[controler]", 16, "did you mean 'controller'"),
        ("proportional_a_rad = 28.0", "proportional_a_deg = 28.0", 18, "did you mean 'proportional_a_rad'"),
        ("position_noise_rad = 4e-6", "position_noise_rad = -4e-6", 25, "at least 0"),
    ],
)
def test_complaints_name_line_and_mend(tmp_path: Path, old: str, new: str, line: int, says: str) -> None:
    assert old in ERA
    said = complaint(tmp_path, ERA.replace(old, new))
    assert said.startswith(f"/m.toml:{line}: ")
    assert says in said


@pytest.mark.parametrize(
    ("entry", "line", "says"),
    [
        ('term = "stribek_friction"', 2, "did you mean 'stribeck_friction'"),
        ('term = "backlash"\nhalf_width_deg = 1', 3, "did you mean 'half_width_rad'"),
        ('term = "backlash"\nhalf_width_rad = -1', 3, "-1 is impossible"),
        ('term = "backlash"\nside = "motor"', 3, "sits in one place only"),
        ('term = "coulomb_friction"\nside = "engine"', 3, "'engine' is not known"),
        ("torque_nm = 1", 1, "None is not known"),
    ],
)
def test_complaints_of_terms(tmp_path: Path, entry: str, line: int, says: str) -> None:
    said = complaint(tmp_path, f"{ERA}\n[[physics]]\n{entry}\n")
    assert said.startswith(f"/m.toml:{ERA.count(chr(10)) + 1 + line}: ")
    assert says in said


def test_complaints_of_files(tmp_path: Path) -> None:
    assert "at line 1" in complaint(tmp_path, "x = = 1")
    assert 'write schema = "gsfdi/model/1"' in complaint(tmp_path, 'name = "x"')
    assert "a rigid joint has no backlash" in complaint(
        tmp_path,
        'schema = "gsfdi/model/1"\nstructure = "rigid"\n'
        '[plant]\noutput_inertia_kg_m2 = 1\n[[physics]]\nterm = "backlash"',
    )
    with pytest.raises(UnusableInputError, match="No such file"):
        load_models(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(UnusableInputError, match="not a text file"):
        load_models(tmp_path / "bytes.toml")
    with pytest.raises(UnusableInputError):
        load_models(tmp_path)
