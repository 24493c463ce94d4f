"""From a model file to the joints that it describes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from gsfdi.channels import Axis
from gsfdi.errors import UnusableInputError, nearest
from gsfdi.model import Bus, Controller, Effort, JointModel, Plant, Sensors, Side, Structure, TermUse
from gsfdi.modelfile.keys import GAINS, KEYS, SCHEMA, KeyOf, spelling, terms
from gsfdi.motion import linear_name
from gsfdi.toml_lines import Place, read

TOP = ("schema", "name", "structure", "axis", "plant", "controller", "sensors", "bus", "trust", "physics", "joints")
JOINT = ("structure", "axis", "plant", "controller", "sensors", "bus", "trust", "physics")


@dataclass(frozen=True, slots=True)
class Models:
    """The joints that a model file describes.

    `default` serves any joint where the file names none.
    """

    path: Path
    default: JointModel | None
    joints: Mapping[str, JointModel] = field(default_factory=dict)

    def for_joint(self, name: str) -> JointModel:
        """Find the model of the joint called `name`, under that name."""
        if name in self.joints:
            return self.joints[name]
        if self.default is None:
            raise UnusableInputError(self.path, f"describes no joint {name!r}", nearest(name, self.joints))
        return replace(self.default, name=name)

    def __iter__(self) -> Iterator[JointModel]:
        """Give every joint of an arm, or the one joint of the file."""
        return iter(self.joints.values() if self.default is None else [self.default])


def load_models(path: Path | str) -> Models:
    """Read a model file.

    Raises
    ------
    UnusableInputError
        With file, line, key and the nearest valid name.
    """
    path = Path(path)
    document, lines = read(path)
    top = Place(path, document, lines)
    top.known(TOP)
    if document.get("schema") != SCHEMA:
        raise top.error("schema", f"{document.get('schema')!r} is not a model", f'write schema = "{SCHEMA}"')
    if "joints" not in document:
        name = document.get("name", path.stem)
        if not isinstance(name, str):
            raise top.error("name", f"{name!r} is not text", "write it in quotes")
        return Models(path, joint_of(top, None, name))
    joints = top.inside("joints")
    return Models(path, None, {name: joint_of(top, joints.inside(name), name) for name in joints.table})


def joint_of(top: Place, own: Place | None, name: str) -> JointModel:
    """Read one joint from the top of the file, overridden by its own tables."""
    places = [top] if own is None else [top, own]
    if own is not None:
        own.known(JOINT)
    speaks = next((p for p in reversed(places) if "structure" in p.table), top)
    structure: Structure = speaks.choice("structure", ("flexible", "rigid"), "flexible")  # type: ignore[assignment]
    speaks = next((p for p in reversed(places) if "axis" in p.table), top)
    axis: Axis = speaks.choice("axis", ("rotary", "linear"), "rotary")  # type: ignore[assignment]
    controller = controller_of(places, axis)
    plant, effort = plant_of(places, axis, structure, controller)
    return JointModel(
        name=name,
        structure=structure,
        plant=plant,
        axis=axis,
        controller=controller,
        sensors=Sensors(**values_of(places, "sensors", KEYS["sensors"], axis)),
        physics=tuple(use_of(entry, axis, structure) for p in places for entry in p.entries("physics")),
        bus=Bus(**values_of(places, "bus", KEYS["bus"], axis)),
        trust=values_of(places, "trust", KEYS["trust"], axis),
        effort=effort,
    )


def values_of(places: list[Place], table: str, keys: tuple[KeyOf, ...], axis: Axis) -> dict[str, float]:
    """Read a table of numbers by field, the joint's own over those at the top."""
    found = {}
    names = {spelling(key, axis): key for key in keys}
    for place in (p.inside(table) for p in places if table in p.table):
        place.known([*names, "type"] if table == "controller" else [*names])
        for name, key in names.items():
            if name in place.table:
                found[key.field] = place.number(name, key.low, key.high, above=key.above)
    return found


def controller_of(places: list[Place], axis: Axis) -> Controller | None:
    """Read the controller; the unit of its gains says what its effort is."""
    tables = [p.inside("controller") for p in places if "controller" in p.table]
    if not tables:
        return None
    own = tables[-1]
    own.choice("type", ("pid",), "pid")
    torque = {spelling(key, axis) for key in GAINS["drive_torque"]} - {
        spelling(k, axis) for k in GAINS["motor_current"]
    }
    effort: Effort = "drive_torque" if any(torque & t.table.keys() for t in tables) else "motor_current"
    values = values_of(places, "controller", GAINS[effort], axis)
    for key in GAINS[effort]:
        if key.field not in values and key.field in ("proportional", "derivative", "sample_rate"):
            raise own.error(None, f"{spelling(key, axis)} is missing", f"add it: {key.meaning}")
    return Controller(**{"integral": 0.0} | values, effort=effort)


def plant_of(
    places: list[Place], axis: Axis, structure: Structure, controller: Controller | None
) -> tuple[Plant, Effort]:
    """Read the plant, and say whether its effort is a current or a torque."""
    values = values_of(places, "plant", KEYS["plant"], axis)
    own = next((p for p in reversed(places) if "plant" in p.table), places[-1]).inside("plant")
    needs = ["output_inertia"] + (["motor_inertia", "gear_ratio", "stiffness"] if structure == "flexible" else [])
    effort: Effort = "motor_current" if "torque_constant" in values else "drive_torque"
    if controller is not None and controller.effort != effort:
        if effort == "drive_torque":
            needs.append("torque_constant")
        else:
            raise own.error(
                None,
                "a torque constant, but the controller's gains are in torque",
                "leave it out, or give gains in amperes",
            )
    for key in KEYS["plant"]:
        if key.field in needs and not values.get(key.field):
            raise own.error(None, f"{spelling(key, axis)} is missing", f"add it: {key.meaning}")
    if structure == "rigid" and "stiffness" in values:
        raise own.error(None, "a rigid joint has no gearbox spring", 'leave it out, or write structure = "flexible"')
    values.setdefault("torque_constant", 1.0 / values.get("gear_ratio", 1.0))
    return Plant(**values), effort


def use_of(entry: Place, axis: Axis, structure: Structure) -> TermUse:
    """Read one entry of ``[[physics]]``."""
    name = entry.choice("term", tuple(terms()))
    term = terms()[name]
    if structure not in term.structures:
        raise entry.error("term", f"a {structure} joint has no {name}", "leave it out, or give a flexible joint")
    spelled = {(linear_name(p.name) if axis == "linear" else p.name): p for p in term.params}
    if axis == "linear":  # a phase is an angle on either axis; both spellings are understood
        spelled |= {"phase_m": term.param("phase_rad")} if "phase_m" in entry.table and "phase_rad" in spelled else {}
    own = {"onset_s"} - set(spelled)
    entry.known(["term", "side", *spelled, *own])
    values = {p.name: p.start for p in term.numbers}  # a number that is left out has one for a fit to begin with
    values |= {p.name: entry.number(key, p.low, p.high) for key, p in spelled.items() if key in entry.table}
    side: Side | None = None
    if "side" in entry.table:
        if not term.sides:
            raise entry.error("side", f"{name} sits in one place only", "leave it out")
        side = entry.choice("side", term.sides)  # type: ignore[assignment]
    onset = entry.number("onset_s", 0.0, 1e9) if own & entry.table.keys() else None
    return TermUse(name, values, side, onset)
