"""Canonical telemetry as MCAP: one topic per joint, JSON messages whose fields are the contract's columns."""

import heapq
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from gsfdi.atomic import aside
from gsfdi.canonical import SCHEMA
from gsfdi.channels import CHANNELS
from gsfdi.types import JointRecord

MESSAGE = "gsfdi.Telemetry"


def write_mcap(path: Path, records: Sequence[JointRecord]) -> None:
    """Write records of one robot as canonical telemetry, whole or not at all.

    Parameters
    ----------
    path : Path
        The file to be.
    records : sequence of JointRecord
        One or more joints; messages of all are in order of time.
    """
    with aside(path) as part, part.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="gsfdi")
        writer.add_metadata("gsfdi", {"schema": SCHEMA, "robot": records[0].robot if records else ""})
        topics = {}
        for record in records:
            if record.joint not in topics:
                schema = writer.register_schema(MESSAGE, "jsonschema", json.dumps(schema_of(record)).encode())
                topics[record.joint] = writer.register_channel(f"/gsfdi/telemetry/{record.joint}", "json", schema)
        counts = dict.fromkeys(topics, 0)
        for stamp, joint, message in heapq.merge(*(_messages(record) for record in records), key=lambda one: one[0]):
            content = json.dumps(message, separators=(",", ":")).encode()
            writer.add_message(topics[joint], stamp, content, stamp, counts[joint])
            counts[joint] += 1
        writer.finish()


def schema_of(record: JointRecord) -> dict[str, object]:
    """JSON Schema of a joint's messages, with unit and meaning of every column.

    Parameters
    ----------
    record : JointRecord
        Telemetry of the joint.
    """
    properties: dict[str, Mapping[str, str]] = {
        "timestamp": {"type": "integer", "description": "time of sampling, ns since 1970-01-01, UTC"},
        "joint": {"type": "string", "description": "name of the joint"},
    }
    for name in record.channels:
        channel = CHANNELS[name]
        unit = channel.unit(record.axis)
        properties[channel.column(record.axis)] = {"type": "number", "unit": unit, "description": channel.meaning}
    return {"title": MESSAGE, "type": "object", "properties": properties, "required": ["timestamp", "joint"]}


def _messages(record: JointRecord) -> Iterator[tuple[int, str, dict[str, object]]]:
    """Stamp, joint and fields of each sample; what is not a number is left out."""
    stamps = (record.t0_ns + np.round(record.t * 1e9).astype(np.int64)).tolist()
    columns = {CHANNELS[name].column(record.axis): values.tolist() for name, values in record.channels.items()}
    for i, stamp in enumerate(stamps):
        known = {column: values[i] for column, values in columns.items() if values[i] == values[i]}
        yield stamp, record.joint, {"timestamp": stamp, "joint": record.joint, **known}
