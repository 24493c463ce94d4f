"""The JSON Schema of model files, for editors and other programs; made from the tables that the reader goes by.

``python -m gsfdi.modelfile.schema > gsfdi/model.schema.json`` writes the published one; a test holds it to this.
"""

import json
from typing import Any

from gsfdi.channels import Axis
from gsfdi.modelfile.keys import GAINS, KEYS, SCHEMA, KeyOf, spelling, terms
from gsfdi.motion import Param, PhysicsTerm, linear_name

AXES: tuple[Axis, ...] = ("rotary", "linear")


def schema() -> dict[str, Any]:
    """Make the schema of a model file."""
    tables = {name: keyed(keys) for name, keys in KEYS.items()}
    tables["controller"] = keyed([key for keys in GAINS.values() for key in keys])
    tables["controller"]["properties"]["type"] = {"const": "pid"}
    shared: dict[str, Any] = {
        "structure": {"enum": ["flexible", "rigid"]},
        "axis": {"enum": list(AXES)},
        **tables,
        "physics": {"type": "array", "items": {"oneOf": [entry(term) for term in terms().values()]}},
    }
    joint = {"type": "object", "properties": shared, "additionalProperties": False}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "gsfdi joint model",
        "type": "object",
        "required": ["schema"],
        "properties": {
            "schema": {"const": SCHEMA},
            "name": {"type": "string"},
            **shared,
            "joints": {"type": "object", "additionalProperties": joint},
        },
        "additionalProperties": False,
    }


def keyed(keys: "tuple[KeyOf, ...] | list[KeyOf]") -> dict[str, Any]:
    """Make the schema of a table of numbers, in either axis's spelling."""
    numbers = {
        spelling(key, axis): {
            "type": "number",
            "exclusiveMinimum" if key.above else "minimum": key.low,
            "maximum": key.high,
            "description": key.meaning,
        }
        for key in keys
        for axis in AXES
    }
    return {"type": "object", "properties": numbers, "additionalProperties": False}


def entry(term: PhysicsTerm) -> dict[str, Any]:
    """Make the schema of one term's entry in ``[[physics]]``."""

    def number(param: Param) -> dict[str, Any]:
        meaning = f"{param.meaning} [{param.unit}]"
        return {"type": "number", "minimum": param.low, "maximum": param.high, "description": meaning}

    properties: dict[str, Any] = {"term": {"const": term.name}, "onset_s": {"type": "number", "minimum": 0}}
    properties |= {spelled: number(param) for param in term.params for spelled in (param.name, linear_name(param.name))}
    if term.sides:
        properties["side"] = {"enum": list(term.sides)}
    return {"properties": properties, "required": ["term"], "additionalProperties": False, "description": term.meaning}


if __name__ == "__main__":
    print(json.dumps(schema(), indent=1))  # noqa: T201
