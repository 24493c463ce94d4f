"""The joints of a batch, watched as it streams by: one pass over the files, one piece in memory."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from gsfdi import ingest as reading
from gsfdi.baseline import Baseline, JointBaseline, part_of
from gsfdi.diagnosis import Judging, Limits, unjudged
from gsfdi.heap import keep_freed
from gsfdi.mapping import Mapping as LogMapping
from gsfdi.modelfile import Models
from gsfdi.overview import Overview
from gsfdi.pipeline.outcome import key_of
from gsfdi.types import UNNAMED, JointRecord, Problem, Verdict

PIECE = 400_000
"""Values of all channels that are read at a time."""
RECENT = 20_000
"""Samples at least that reconcile is given of a long batch."""


@dataclass(frozen=True, slots=True)
class Share:
    """The part of an analysis that one process does.

    Parameters
    ----------
    paths : tuple of Path
        Files of the batch.
    mappings : tuple of Mapping
        How odd logs are read.
    joints : tuple of str
        Joints wanted; all if empty.
    number, of : int
        This share takes every `of`-th joint of the baseline, from `number`; the first also takes all unknown joints.
    baseline : Baseline
        What the joints are judged against.
    models : Models or None
        What the joints are built like, for reconcile to name a cause where no known fault does.
    now : datetime
        When the analysis is.
    stale_after_s : float or None
        Age from which telemetry is stale [s].
    """

    paths: tuple[Path, ...]
    mappings: tuple[LogMapping, ...]
    joints: tuple[str, ...]
    number: int
    of: int
    baseline: Baseline
    models: Models | None
    now: datetime
    stale_after_s: float | None


@dataclass(frozen=True, slots=True)
class Judged:
    """What came of one joint."""

    key: str
    verdict: Verdict
    record: JointRecord


def watch(share: Share) -> tuple[list[Judged], list[Problem], dict[str, str]]:
    """Stream the batch once and judge the joints of this share.

    Parameters
    ----------
    share : Share
        Files and joints.

    Returns
    -------
    list of Judged, list of Problem, dict of str to str
        A verdict and an overview of each joint, what went wrong, and the files' hashes.
    """
    keep_freed()
    problems: list[Problem] = []
    hashes: dict[str, str] = {}
    desks: dict[str, Desk] = {}
    for batch in reading.stream(share.paths, share.mappings, share.joints, PIECE):
        problems += batch.problems
        for record in batch.records:
            hashes[record.source] = record.sha256
            known = baseline_of(share.baseline, record)
            if _mine(share, known):
                key = desk_of(record, known)
                if key not in desks:
                    desks[key] = Desk(key, record.joint, known, share)
                desks[key].take(record)
    judged = [desks.pop(key).judged() for key in list(desks)]  # each desk is cleared before the next one is looked at
    return judged, problems, hashes


def _limits(share: Share) -> tuple[Limits, int | None]:
    """Where verdicts change, and the time by which telemetry can be stale."""
    if share.stale_after_s is None:
        return Limits(), None
    return Limits(stale_after_s=share.stale_after_s), round(share.now.timestamp() * 1e9)


class Desk:
    """Where one joint's pieces go, each worked off before the next is read: memory holds one piece, of one joint.

    Parameters
    ----------
    key, joint : str
        The joint among all, and its own name.
    baseline : JointBaseline or None
        What is known of it.
    share : Share
        What the joint is part of.
    """

    def __init__(self, key: str, joint: str, baseline: JointBaseline | None, share: Share) -> None:
        self._key, self._joint, self._baseline, self._share = key, joint, baseline, share
        self._overview = Overview()
        self._recent: deque[JointRecord] = deque()
        self._judging = Judging(baseline, limits=_limits(share)[0]) if baseline is not None else None

    def take(self, piece: JointRecord) -> None:
        """Work off one more piece."""
        self._overview.add(piece)
        if self._judging is None:
            return
        self._judging.add(piece)
        if self._share.models is not None:
            self._keep(piece)

    def _keep(self, piece: JointRecord) -> None:
        """Hold on to the latest samples, `RECENT` of them at least."""
        end = len(piece.t)
        self._recent.append(part_of(piece, max(end - RECENT, 0), end))
        while sum(len(one.t) for one in self._recent) - len(self._recent[0].t) >= RECENT:
            self._recent.popleft()

    def judged(self) -> Judged:
        """Judge what came."""
        if self._judging is None:
            why = "no baseline was learnt for this joint; run gsfdi baseline on fault-free batches"
            verdict = unjudged(self._joint, "not_assessed", why)
        else:
            verdict = self._judging.verdict(now_ns=_limits(self._share)[1], explain=self._cause)
        return Judged(self._key, verdict, self._overview.record())

    def _cause(self) -> Mapping[str, object] | None:
        """What reconcile makes of the latest part of the batch, where there is a model file to start from."""
        if self._share.models is None or self._baseline is None or not self._recent:
            return None
        from gsfdi.pipeline.cause import cause  # reconcile is a second to load, which a quiet night need not wait for

        whole = Overview()
        for part in self._recent:
            whole.add(part)
        return cause([whole.record()], self._baseline, self._share.models.for_joint(self._joint))


def baseline_of(baseline: Baseline, record: JointRecord) -> JointBaseline | None:
    """Find what is known of a record's joint: of its robot, else of the only joint of that name.

    Parameters
    ----------
    baseline : Baseline
        All that is known.
    record : JointRecord
        Telemetry; canonical files of other programs name no robot.
    """
    exact = baseline.joints.get(key_of(record))
    alike = [one for one in baseline.joints.values() if one.joint == record.joint]
    return exact or (alike[0] if len(alike) == 1 else None)


def desk_of(record: JointRecord, known: JointBaseline | None) -> str:
    """Name the desk that a record goes to: its joint's own, or where it names no robot that of its baseline's joint.

    Of the files of one batch some may name the robot and others not; two verdicts on one joint would each be on part
    of its batch.

    Parameters
    ----------
    record : JointRecord
        Telemetry.
    known : JointBaseline or None
        What is known of its joint.
    """
    return f"{known.robot}/{known.joint}" if known is not None and record.robot == UNNAMED else key_of(record)


def _mine(share: Share, known: JointBaseline | None) -> bool:
    if known is None:
        return share.number == 0
    return list(share.baseline.joints.values()).index(known) % share.of == share.number
