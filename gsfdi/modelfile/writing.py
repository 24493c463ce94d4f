"""From a joint to the model file that describes it."""

import math
from pathlib import Path
from typing import Any

import tomli_w

from gsfdi.atomic import write_text
from gsfdi.channels import Axis
from gsfdi.model import Bus, Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.modelfile.keys import GAINS, KEYS, SCHEMA, KeyOf, spelling
from gsfdi.motion import linear_name


def dump(model: JointModel, path: Path | str) -> None:
    """Write `model` as a file that `load_models` reads back to the same model."""
    write_text(Path(path), tomli_w.dumps(document_of(model)))


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
