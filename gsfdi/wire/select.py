"""Which leaves of a message are joint telemetry: by a mapping, or because the message is of a well-known shape."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence, Sized
from typing import NamedTuple

from gsfdi.channels import CHANNEL_OF_COLUMN, Axis
from gsfdi.mapping import Mapping as LogMapping
from gsfdi.mapping import Source
from gsfdi.wire import Key
from gsfdi.wire.leaves import Leaf, pattern

_JOINT_STATE = {"position": "position", "velocity": "joint_velocity", "effort": "drive_torque"}
_WANTED = {"positions": "setpoint", "velocities": "setpoint_rate"}
_SENSED = {"positions": "position", "velocities": "joint_velocity", "effort": "drive_torque"}

_SHAPES: tuple[tuple[str, dict[str, str], int], ...] = (
    # sensor_msgs/JointState, and anything laid out like it
    ("name[]", {f"{field}[]": channel for field, channel in _JOINT_STATE.items()}, 0),
    # a list of joints, each with its own fields: Foxglove's JointStates and its kin
    ("joints[].name", {f"joints[].{field}": channel for field, channel in _JOINT_STATE.items()}, 0),
    ("joint_states[].name", {f"joint_states[].{field}": channel for field, channel in _JOINT_STATE.items()}, 0),
    # control_msgs/JointTrajectoryControllerState, with the field names before and since 2023
    (
        "joint_names[]",
        {f"{part}.{field}[]": channel for part in ("desired", "reference") for field, channel in _WANTED.items()}
        | {f"{part}.{field}[]": channel for part in ("actual", "feedback") for field, channel in _SENSED.items()},
        1,
    ),
    # control_msgs/JointJog commands speeds
    ("joint_names[]", {"velocities[]": "setpoint_rate"}, 2),
    # control_msgs/MultiDOFStateStamped
    ("dof_states[].name", {"dof_states[].reference": "setpoint", "dof_states[].feedback": "position"}, 1),
)
"""Field of the joints' names, fields -> channels, and how far the source yields to others."""

_INTERFACES = {
    "position": "position",
    "velocity": "joint_velocity",
    "effort": "drive_torque",
    "current": "motor_current",
    "temperature": "temperature",
}
"""control_msgs/DynamicJointState names its interfaces in the message."""

_STAMPS = ("header.stamp", "timestamp", "stamp", "time", "header.timestamp")
_SECONDS, _NANOS = ("sec", "secs", "seconds"), ("nanosec", "nsec", "nsecs", "nanos", "nanoseconds")


class Pick(NamedTuple):
    """A leaf, whose channel it is, and what turns it into SI."""

    key: Key
    path: str
    factor: float = 1.0
    offset: float = 0.0


class Clock(NamedTuple):
    """Where a message's time stands: seconds and nanoseconds, one number of ticks, or (neither) the log's own time."""

    seconds: str = ""
    nanos: str = ""
    ticks: str = ""
    tick_ns: int = 1
    epoch_ns: int = 0
    published: bool = False


class Choice(NamedTuple):
    """What is read from messages of one layout.

    `names` are the leaves that name joints; `ragged` says that some array is longer or shorter than the names.
    """

    clock: Clock
    picks: tuple[Pick, ...]
    names: frozenset[str]
    joints: tuple[tuple[str, str], ...]
    ragged: bool


def choose(leaves: Sequence[Leaf], topic: str, robot: str, mappings: Sequence[LogMapping]) -> Choice:
    """Pick the joint telemetry of a message.

    Parameters
    ----------
    leaves : sequence of Leaf
        Of one message; others of its layout are read the same way.
    topic : str
    robot : str
        Whose joints they are, if no mapping says.
    mappings : sequence of Mapping
        Those that name the topic; if there is none, the well-known shapes are tried.
    """
    found: dict[str, list[tuple[tuple[int, ...], Leaf]]] = defaultdict(list)
    for leaf in leaves:
        plain, indices = pattern(leaf.path)
        found[plain].append((indices, leaf))
    clock = _clock(found, mappings[0] if mappings else None)
    if not mappings and _is_canonical(found) and "timestamp" in found:
        clock = Clock(ticks="timestamp")
    picks: list[Pick] = []
    names: set[str] = set()
    ragged: list[str] = []
    for mapping in mappings:
        for channel, source in mapping.sources.items():
            if source.topic == topic:
                picks += _mapped(found, channel, source, mapping, topic, names, ragged)
    if not mappings:
        picks += [
            *_well_known(found, robot, names, ragged),
            *_dynamic(found, robot, names),
            *_canonical(found, robot, names),
        ]
    joints = tuple(dict.fromkeys((pick.key.robot, pick.key.joint) for pick in picks))
    return Choice(clock, tuple(_once(picks)), frozenset(names), joints, bool(ragged))


_Found = Mapping[str, list[tuple[tuple[int, ...], Leaf]]]


def _mapped(
    found: _Found, channel: str, source: Source, mapping: LogMapping, topic: str, names: set[str], ragged: list[str]
) -> Iterable[Pick]:
    def pick(label: str, leaf: Leaf) -> Pick:
        key = Key(mapping.robot, source.rename.get(label, label), channel, mapping.axis)
        return Pick(key, leaf.path, source.factor, source.offset)

    for joint, field in source.columns.items():
        yield from (pick(joint, leaf) for leaf in _at(found, str(field)))
    if source.field and "[]" not in source.field:
        alone = next(
            (leaf.text for leaf in _at(found, source.names or "") if leaf.text), topic.strip("/").split("/")[-1]
        )
        names.update(leaf.path for leaf in _at(found, source.names or ""))
        yield from (pick(alone or topic, leaf) for leaf in _at(found, source.field) if leaf.kind != "text")
        return
    values = found.get(source.field or "", [])
    if source.names is None:
        labels = {indices: ".".join(map(str, indices)) for indices, _ in values}
    else:
        labels = _labels(found, source.names, names)
    if _pairs(values, labels, ragged):
        yield from (
            pick(labels[indices], leaf) for indices, leaf in values if indices in labels and leaf.kind != "text"
        )


def _at(found: _Found, path: str) -> list[Leaf]:
    """The leaf of exactly this path, ``position[3]`` say."""
    return [leaf for _, leaf in found.get(pattern(path)[0], []) if leaf.path == path]


def _pairs(values: list[tuple[tuple[int, ...], Leaf]], labels: Sized, ragged: list[str]) -> bool:
    """Whether there is a value for every name; of arrays of different lengths, which value is whose is not known."""
    if values and len(values) != len(labels):
        ragged.append(values[0][1].path)
    return len(values) == len(labels)


def _well_known(found: _Found, robot: str, names: set[str], ragged: list[str]) -> Iterable[Pick]:
    for name_field, fields, rank in _SHAPES:
        if name_field not in found or not any(field in found for field in fields):
            continue
        labels = _labels(found, name_field, names)
        for field, channel in fields.items():
            values = found.get(field, [])
            if _pairs(values, labels, ragged):
                for indices, leaf in values:
                    if indices in labels and leaf.kind != "text":
                        yield Pick(Key(robot, labels[indices], channel, "rotary", rank), leaf.path)


def _dynamic(found: _Found, robot: str, names: set[str]) -> Iterable[Pick]:
    if not {"joint_names[]", "interface_values[].interface_names[]", "interface_values[].values[]"} <= set(found):
        return
    joints = _labels(found, "joint_names[]", names)
    interfaces = _labels(found, "interface_values[].interface_names[]", names)
    for indices, leaf in found["interface_values[].values[]"]:
        channel = _INTERFACES.get(interfaces.get(indices, ""))
        if channel and indices[:1] in joints:
            yield Pick(Key(robot, joints[indices[:1]], channel, "rotary", 1), leaf.path)


def _canonical(found: _Found, robot: str, names: set[str]) -> Iterable[Pick]:
    """A message whose fields bear the canonical columns' names."""
    if not _is_canonical(found):
        return
    columns = [name for name in CHANNEL_OF_COLUMN if name in found]
    joint = _labels(found, "joint", names).get((), "")
    if not joint:
        return
    usual: Axis = "linear" if any(CHANNEL_OF_COLUMN[name][1] == "linear" for name in columns) else "rotary"
    if "robot" in found:
        robot = _labels(found, "robot", names).get((), "") or robot
    for column in columns:
        channel, axis = CHANNEL_OF_COLUMN[column]
        if found[column][0][1].kind != "text":
            yield Pick(Key(robot, joint, channel, axis or usual), column)


def _is_canonical(found: _Found) -> bool:
    return "joint" in found and any(name in found for name in CHANNEL_OF_COLUMN)


def _labels(found: _Found, field: str, names: set[str]) -> dict[tuple[int, ...], str]:
    labels = {indices: leaf.text for indices, leaf in found.get(field, []) if leaf.kind == "text"}
    names.update(leaf.path for _, leaf in found.get(field, []))
    return labels


def _once(picks: Iterable[Pick]) -> Iterable[Pick]:
    """Each channel of a joint once; a message that names a joint twice is believed the first time."""
    seen: set[tuple[str, str, str]] = set()
    for pick in picks:
        if pick.key[:3] not in seen:
            seen.add(pick.key[:3])
            yield pick


def _clock(found: _Found, mapping: LogMapping | None) -> Clock:
    wanted = mapping.time if mapping else None
    if wanted in ("log_time", "publish_time"):
        return Clock(published=wanted == "publish_time")
    for stamp in [str(wanted)] if wanted is not None else _STAMPS:
        seconds = next((f"{stamp}.{name}" for name in _SECONDS if f"{stamp}.{name}" in found), "")
        nanos = next((f"{stamp}.{name}" for name in _NANOS if f"{stamp}.{name}" in found), "")
        if seconds and nanos:
            return Clock(seconds=seconds, nanos=nanos)
    if mapping and wanted is not None and str(wanted) in found:
        return Clock(ticks=str(wanted), tick_ns=mapping.time_ns, epoch_ns=mapping.epoch_ns)
    return Clock()
