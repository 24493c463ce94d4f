"""Small recordings made on the spot: the bytes that ROS 2, Protobuf and JSON recorders write."""

import json
import struct
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import CompressionType, Writer

from gsfdi.types import Array

T0 = 1_700_000_000_000_000_000
NAMES = ("shoulder", "elbow", "wrist")
COMPRESSIONS = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}

HEADER = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
JOINT_STATE = (
    "# a comment\nstd_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    + HEADER
)
JOINT_STATE_IDL = """
================================================================================
IDL: sensor_msgs/msg/JointState
// generated
#include "std_msgs/msg/Header.idl"
module sensor_msgs {
  module msg {
    @verbatim (language="comment", text="a state; of joints")
    struct JointState {
      std_msgs::msg::Header header;
      sequence<string> name;
      sequence<double> position;
      sequence<double> velocity;
      sequence<double> effort;
    };
  };
};
================================================================================
IDL: std_msgs/msg/Header
module std_msgs { module msg { struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; }; };
================================================================================
IDL: builtin_interfaces/msg/Time
module builtin_interfaces { module msg { struct Time { int32 sec; uint32 nanosec; }; }; };
"""
_POINT = """
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
"""


def controller_state(wanted: str, sensed: str) -> str:
    """Schema of control_msgs/JointTrajectoryControllerState with the field names of one era."""
    points = "".join(f"trajectory_msgs/JointTrajectoryPoint {name}\n" for name in (wanted, sensed, "error"))
    return "std_msgs/Header header\nstring[] joint_names\n" + points + _POINT + HEADER


class Cdr:
    """Writes little-endian or big-endian CDR."""

    def __init__(self, big: bool = False) -> None:
        self.order = ">" if big else "<"
        self.data = bytearray(b"\0\0\0\0" if big else b"\0\1\0\0")

    def put(self, code: str, *values: Any) -> "Cdr":
        size = struct.calcsize(code)
        for value in values:
            self.data += b"\xa5" * (-(len(self.data) - 4) % size)  # padding is rubbish in real files too
            self.data += struct.pack(self.order + code, value)
        return self

    def text(self, *texts: str) -> "Cdr":
        for text in texts:
            raw = text.encode() + b"\0"
            self.put("I", len(raw))
            self.data += raw
        return self

    def texts(self, values: Sequence[str]) -> "Cdr":
        return self.put("I", len(values)).text(*values)

    def doubles(self, values: Iterable[float]) -> "Cdr":
        listed = list(values)
        return self.put("I", len(listed)).put("d", *listed)

    def stamp(self, ns: int, frame: str = "base") -> "Cdr":
        return self.put("i", ns // 10**9).put("I", ns % 10**9).text(frame)


def joint_state(
    ns: int,
    names: Sequence[str],
    position: Iterable[float],
    velocity: Iterable[float] = (),
    effort: Iterable[float] = (),
    big: bool = False,
) -> bytes:
    """A sensor_msgs/JointState."""
    return bytes(Cdr(big).stamp(ns).texts(names).doubles(position).doubles(velocity).doubles(effort).data)


def trajectory_state(ns: int, names: Sequence[str], wanted: Array, sensed: Array) -> bytes:
    """A control_msgs/JointTrajectoryControllerState."""
    cdr = Cdr().stamp(ns).texts(names)
    for values in (wanted, sensed, wanted - sensed):
        cdr.doubles(values).doubles(0.1 * values).doubles([]).doubles([]).put("i", 0).put("I", 0)
    return bytes(cdr.data)


def motion(n: int, joints: int, seed: int = 0) -> tuple[Array, Array, Array]:
    """Positions, speeds and torques of some joints, (n, joints) each."""
    rng = np.random.default_rng(seed)
    t = np.arange(n)[:, None] * 0.01
    phase = t * np.linspace(0.5, 2.0, joints)
    position = np.sin(phase) + 1e-4 * rng.standard_normal((n, joints))
    return position, np.cos(phase) + 1e-3 * rng.standard_normal((n, joints)), 0.1 * position + 1.0


Entry = tuple[str, str, str, str, bytes, Iterable[tuple[int, bytes]]]
"""Topic, message encoding, schema's name and encoding, schema, and messages by log time."""


def write_mcap(path: Path, entries: Sequence[Entry], compression: str = "zstd", **options: Any) -> Path:
    """Write an MCAP file; messages of all topics in order of log time."""
    with path.open("wb") as file:
        writer = Writer(file, compression=COMPRESSIONS[compression], **options)
        writer.start("ros2", "test")
        every = []
        for topic, encoding, name, schema_encoding, schema, messages in entries:
            known = writer.register_schema(name, schema_encoding, schema) if name else 0
            channel = writer.register_channel(topic, encoding, known)
            every += [(stamp, i, channel, data) for i, (stamp, data) in enumerate(messages)]
        for stamp, i, channel, data in sorted(every, key=lambda each: each[0]):
            writer.add_message(channel, stamp, data, stamp, i)
        writer.finish()
    return path


def joint_states(
    path: Path, n: int = 200, names: Sequence[str] = NAMES, compression: str = "zstd", **options: Any
) -> Path:
    """A recording of one arm's JointState at 100 Hz."""
    position, velocity, effort = motion(n, len(names))
    stamps = [T0 + i * 10_000_000 for i in range(n)]
    messages = [
        (stamp, joint_state(stamp, names, position[i], velocity[i], effort[i])) for i, stamp in enumerate(stamps)
    ]
    entry = ("/joint_states", "cdr", "sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode(), messages)
    return write_mcap(path, [entry], compression, **options)


def protobuf_joints(package: str = "arm") -> tuple[str, bytes, Any]:
    """A message of joints with name, position and velocity, stamped: its name, descriptors and class."""
    file = descriptor_pb2.FileDescriptorProto(name=f"{package}.proto", package=package, syntax="proto3")
    label, kinds = descriptor_pb2.FieldDescriptorProto, descriptor_pb2.FieldDescriptorProto
    stamp = file.message_type.add(name="Stamp")
    stamp.field.add(name="seconds", number=1, label=label.LABEL_OPTIONAL, type=kinds.TYPE_INT64)
    stamp.field.add(name="nanos", number=2, label=label.LABEL_OPTIONAL, type=kinds.TYPE_INT32)
    joint = file.message_type.add(name="Joint")
    joint.field.add(name="name", number=1, label=label.LABEL_OPTIONAL, type=kinds.TYPE_STRING)
    for number, name in enumerate(("position", "velocity", "effort"), start=2):
        joint.field.add(name=name, number=number, label=label.LABEL_OPTIONAL, type=kinds.TYPE_DOUBLE)
    whole = file.message_type.add(name="Joints")
    whole.field.add(
        name="timestamp", number=1, label=label.LABEL_OPTIONAL, type=kinds.TYPE_MESSAGE, type_name=f".{package}.Stamp"
    )
    whole.field.add(
        name="joints", number=2, label=label.LABEL_REPEATED, type=kinds.TYPE_MESSAGE, type_name=f".{package}.Joint"
    )
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{package}.Joints"))
    return f"{package}.Joints", descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString(), made


def protobuf_recording(path: Path, n: int = 200, names: Sequence[str] = NAMES, **options: Any) -> Path:
    """A recording of one arm in Protobuf."""
    name, schema, message = protobuf_joints()
    position, velocity, _ = motion(n, len(names))
    messages = []
    for i in range(n):
        stamp = T0 + i * 10_000_000
        whole = message()
        whole.timestamp.seconds, whole.timestamp.nanos = stamp // 10**9, stamp % 10**9
        for j, joint in enumerate(names):
            whole.joints.add(name=joint, position=position[i, j], velocity=velocity[i, j])
        messages.append((stamp, whole.SerializeToString()))
    return write_mcap(path, [("/arm/joints", "protobuf", name, "protobuf", schema, messages)], **options)


def json_recording(path: Path, n: int = 200, names: Sequence[str] = NAMES, schema: bool = True, **options: Any) -> Path:
    """A recording of one arm in JSON, laid out as JointState."""
    position, velocity, _ = motion(n, len(names))
    messages = []
    for i in range(n):
        stamp = T0 + i * 10_000_000
        content = {
            "header": {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": ""},
            "name": list(names),
            "position": position[i].tolist(),
            "velocity": velocity[i].tolist(),
        }
        messages.append((stamp, json.dumps(content).encode()))
    kind = ("JointState", "jsonschema", b"{}") if schema else ("", "", b"")
    return write_mcap(path, [("/arm/joint_states", "json", *kind, messages)], **options)
