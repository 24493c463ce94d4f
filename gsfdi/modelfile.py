"""Reads and writes model files: TOML in and out, refused with the line and the nearest valid name where it is wrong.

One table (`KEYS`) holds every key with its unit and what it may be; the JSON Schema, the reader and the writer all come
from it. A file describes one joint, or an arm: then what stands at the top holds for every joint, and
``[joints.NAME.plant]`` (or ``.controller``, ``.sensors``, ``.bus``, ``.trust``) overrides it key by key, while
``[[joints.NAME.physics]]`` adds terms to those at the top.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from gsfdi.atomic import write_text
from gsfdi.channels import Axis
from gsfdi.errors import UnusableInputError, nearest
from gsfdi.model import Bus, Controller, Effort, JointModel, Plant, Sensors, Side, Structure, TermUse
from gsfdi.motion import PhysicsTerm, linear_name
from gsfdi.registry import shelf
from gsfdi.toml_lines import Place, read

SCHEMA = "gsfdi/model/1"
TOP = ("schema", "name", "structure", "axis", "plant", "controller", "sensors", "bus", "trust", "physics", "joints")
JOINT = ("structure", "axis", "plant", "controller", "sensors", "bus", "trust", "physics")


class KeyOf(NamedTuple):
    """A key of a model file: the field it sets, its rotary and linear spelling, and what it may be."""

    field: str
    rotary: str
    linear: str
    meaning: str
    low: float = 0.0
    high: float = 1e15
    above: bool = False
    """Whether `low` itself is refused."""


def _key(name: str, rotary: str, meaning: str, linear: str = "", **limits: Any) -> KeyOf:
    return KeyOf(name, rotary, linear or linear_name(rotary), meaning, **limits)


KEYS: dict[str, tuple[KeyOf, ...]] = {
    "plant": (
        _key(
            "output_inertia",
            "output_inertia_kg_m2",
            "inertia (mass) of the output side; of everything that moves in a rigid joint",
            "moving_mass_kg",
            above=True,
        ),
        _key("motor_inertia", "motor_inertia_kg_m2", "inertia of the motor, on its own axis", "motor_inertia_kg_m2"),
        _key("gear_ratio", "gear_ratio", "motor turns per output turn; rad/m in a linear drive", above=True),
        _key("stiffness", "gearbox_stiffness_nm_rad", "gearbox spring, at the output", above=True),
        _key("damping", "viscous_damping_nms_rad", "viscous damping on the output axis"),
        _key("torque_constant", "torque_constant_nm_a", "motor torque per ampere", above=True),
    ),
    "sensors": (
        _key("position_resolution", "position_resolution_rad", "smallest step of the position sensor"),
        _key("position_noise", "position_noise_rad", "standard deviation of the measured position"),
        _key("motor_velocity_resolution", "motor_velocity_resolution_rad_s", "smallest step of the speed sensor"),
        _key("motor_velocity_noise", "motor_velocity_noise_rad_s", "standard deviation of the measured speed"),
        _key("effort_resolution", "motor_current_resolution_a", "smallest step of the measured current"),
        _key("effort_noise", "motor_current_noise_a", "standard deviation of the measured current"),
        _key(
            "effort_resolution", "drive_torque_resolution_nm", "smallest step of the effort", "drive_force_resolution_n"
        ),
        _key("effort_noise", "drive_torque_noise_nm", "standard deviation of the effort", "drive_force_noise_n"),
    ),
    "bus": (
        _key("latency", "latency_s", "delay from sampling to stamping, the same for every frame", high=10.0),
        _key("jitter", "jitter_s", "standard deviation of that delay", high=10.0),
        _key("lost", "lost_ratio", "share of frames that never arrive", high=0.9),
        _key("repeated", "repeated_ratio", "share of frames that arrive twice", high=0.9),
    ),
    "trust": tuple(
        _key(name, name, f"relative standard deviation of {name.replace('_', ' ')}", name, above=True, high=100.0)
        for name in (item.name for item in fields(Plant))
    ),
}


def _gains(unit: str, linear_unit: str) -> tuple[KeyOf, ...]:
    """Keys of a controller whose effort is in `unit`."""
    lengths = "m_s" if linear_unit == "a" else "ms"
    return (
        _key("proportional", f"proportional_{unit}_rad", "gain on position", f"proportional_{linear_unit}_m"),
        _key("integral", f"integral_{unit}_rad_s", "gain on its integral", f"integral_{linear_unit}_{lengths}"),
        _key("derivative", f"derivative_{unit}s_rad", "gain on speed", f"derivative_{linear_unit}s_m"),
        _key("sample_rate", "sample_rate_hz", "ticks per second", above=True, high=1e6),
        _key(
            "rate_feedforward",
            "rate_feedforward",
            "share of the setpoint's rate in the speed error",
            low=-1e3,
            high=1e3,
        ),
        _key("derivative_delay", "derivative_delay_s", "age of the speed that the derivative acts on", high=1.0),
        _key("limit", f"limit_{unit}", "greatest effort, with anti-windup", f"limit_{linear_unit}", above=True),
    )


GAINS: dict[Effort, tuple[KeyOf, ...]] = {"motor_current": _gains("a", "a"), "drive_torque": _gains("nm", "n")}


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


def terms() -> dict[str, PhysicsTerm]:
    """Every term of the shelf by its id."""
    return shelf("gsfdi.terms", PhysicsTerm)


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


def spelling(key: KeyOf, axis: Axis) -> str:
    """Spell `key` for the axis."""
    return key.rotary if axis == "rotary" else key.linear


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
    values = {p.name: entry.number(key, p.low, p.high) for key, p in spelled.items() if key in entry.table}
    side: Side | None = None
    if "side" in entry.table:
        if not term.sides:
            raise entry.error("side", f"{name} sits in one place only", "leave it out")
        side = entry.choice("side", term.sides)  # type: ignore[assignment]
    onset = entry.number("onset_s", 0.0, 1e9) if own & entry.table.keys() else None
    return TermUse(name, values, side, onset)


def document_of(model: JointModel) -> dict[str, Any]:
    """Lay a model out as its file holds it."""
    axis = model.axis
    document: dict[str, Any] = {"schema": SCHEMA, "name": model.name, "structure": model.structure, "axis": axis}
    plant = table_of(model.plant, KEYS["plant"], axis)
    if model.effort == "drive_torque":
        plant.pop(spelling(KEYS["plant"][-1], axis))
    document["plant"] = plant
    if model.controller is not None:
        document["controller"] = {"type": "pid"} | table_of(model.controller, GAINS[model.controller.effort], axis)
    in_torque = model.effort == "drive_torque"
    skip = ("motor_current" if in_torque else "drive_torque",)
    sensors = tuple(key for key in KEYS["sensors"] if not key.rotary.startswith(skip))
    for name, value, keys in (("sensors", model.sensors, sensors), ("bus", model.bus, KEYS["bus"])):
        if table := {k: v for k, v in table_of(value, keys, axis).items() if v}:
            document[name] = table
    if model.trust:
        document["trust"] = dict(model.trust)
    if model.physics:
        document["physics"] = [entry_of(use, axis) for use in model.physics]
    return document


def table_of(value: Plant | Controller | Sensors | Bus, keys: tuple[KeyOf, ...], axis: Axis) -> dict[str, float]:
    """Lay the fields of a record out by key, but for those that are infinite."""
    pairs = {spelling(key, axis): getattr(value, key.field) for key in keys}
    return {key: number for key, number in pairs.items() if math.isfinite(number)}


def entry_of(use: TermUse, axis: Axis) -> dict[str, Any]:
    """Lay one term out as an entry of ``[[physics]]``."""
    entry: dict[str, Any] = {"term": use.term}
    if use.side is not None:
        entry["side"] = use.side
    for name, value in use.values.items():
        entry[linear_name(name) if axis == "linear" else name] = float(value)
    if use.onset is not None:
        entry["onset_s"] = use.onset
    return entry


def dump(model: JointModel, path: Path | str) -> None:
    """Write `model` as a file that `load_models` reads back to the same model."""
    write_text(Path(path), tomli_w.dumps(document_of(model)))
