"""What was read of a file and not yet handed on."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

from gsfdi.assemble import Blocks, assemble
from gsfdi.ingest.summary import CLOCK, add_counts
from gsfdi.types import Array, JointRecord, Problem
from gsfdi.wire import Columns, Key

STRAY = 3
"""A joint with no more samples than this, where others have a hundred times as many, is a damaged name."""


class Held:
    """What was read of a file and not yet handed on, and what is to be told of it at its end."""

    def __init__(self, path: Path, sha256: str, joints: Sequence[str]) -> None:
        self.path, self.sha256, self.joints = path, sha256, joints
        self.blocks: dict[tuple[str, str], Blocks] = defaultdict(list)
        self.faults: dict[str, float] = {}
        self.size = 0
        self.ends: dict[tuple[str, str], int] = {}
        self.strays: dict[str, None] = {}
        self.lost: dict[str, float] = {}

    def add(self, item: Columns) -> None:
        """Take a block in."""
        by_joint: dict[tuple[str, str], dict[Key, Array]] = defaultdict(dict)
        for key, values in item.values.items():
            if not self.joints or key.joint in self.joints:
                by_joint[key.robot, key.joint][key] = values
                self.size += len(values)
        for joint, columns in by_joint.items():
            self.blocks[joint].append((item.origin, item.time_ns, columns))
        add_counts(self.faults, item.faults)

    def records(self) -> tuple[JointRecord, ...]:
        """Hand on what is held as records.

        A joint that turns up a few times where others do hundreds of times is one flipped bit in a name: left out.
        """
        source = (str(self.path), self.sha256)
        made = [
            record
            for (robot, joint), blocks in self.blocks.items()
            if (record := assemble(robot, joint, blocks, self.ends.get((robot, joint)), self.faults, *source))
        ]
        longest = max((len(record.t) for record in made), default=0)
        kept = []
        for record in made:
            name = (record.robot, record.joint)
            if name not in self.ends and len(record.t) <= min(STRAY, 0.01 * longest):
                self.strays[record.joint] = None
                continue
            self.ends[name] = record.t0_ns + round(float(record.t[-1]) * 1e9)
            kept.append(record)
        self._note(kept)
        self.blocks.clear()
        self.faults.clear()
        self.size = 0
        return tuple(kept)

    def _note(self, records: Sequence[JointRecord]) -> None:
        """Count what was left out of these records for its time or form, as the joint that lost most has it."""
        worst: dict[str, float] = {}
        for record in records:
            for kind, count in record.quality["time"].items():
                if kind not in (*CLOCK, "corrupt_row") and not kind.startswith("stale"):
                    worst[kind] = max(worst.get(kind, 0.0), count)
        add_counts(self.lost, worst)

    def problems(self) -> Iterator[Problem]:
        """What is to be told of the whole file."""
        source = str(self.path)
        if not self.ends:
            wanted = f" of {', '.join(self.joints)}" if self.joints else ""
            kind: Literal["note", "left_out"] = "note" if self.joints else "left_out"  # other files may hold them
            yield Problem(source, f"holds no joint telemetry{wanted}", "see what it holds with --dry-run", kind)
        for joint in self.strays:
            what = f"is damaged: it names a joint {joint!r} in {STRAY} messages at most; they were left out"
            yield Problem(source, what, "fetch the file again")
        if self.lost:
            told = ", ".join(f"{int(count)} {kind}" for kind, count in sorted(self.lost.items()))
            what = f"rows whose time or form cannot be believed were left out: {told}"
            yield Problem(source, what, "check the recorder's clock, or fetch the file again")
