"""``verdicts.json``: the verdicts for other programs, in strict JSON (what is not a number is null)."""

import json
import math
from collections.abc import Mapping, Sequence
from datetime import date, datetime

import numpy as np

from gsfdi.reports import Analysis, Report, judged, storable
from gsfdi.types import JointRecord, Verdict

Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]


def strict(value: object) -> Json:
    """Turn numpy, tuples, dates and NaN into what JSON knows.

    Examples
    --------
    >>> strict({"p": float("nan"), "n": np.int64(3), "span": (1, np.inf)})
    {'p': None, 'n': 3, 'span': [1, None]}
    """
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return strict(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): strict(item) for key, item in value.items()}
    if isinstance(value, Sequence | set | frozenset):
        return [strict(item) for item in value]
    return value.isoformat() if isinstance(value, date | datetime) else str(value)


def joint_object(verdict: Verdict, record: JointRecord | None) -> dict[str, Json]:
    """Give one joint's verdict as the published format has it, and its findings without their arrays."""
    due = verdict.due
    return {
        "joint": verdict.joint,
        "robot": record.robot if record is not None else None,
        "verdict": verdict.verdict,
        "action": verdict.action,
        "component": verdict.component,
        "fault": verdict.fault,
        "fault_probability": strict(verdict.fault_probability),
        "alternatives": strict(verdict.alternatives),
        "onset_s": strict(verdict.onset_s),
        "methods": strict(verdict.methods),
        "due": {"when": due.when, "interval90": strict(due.interval90), "reason": due.reason},
        "says": verdict.says,
        "findings": [
            {
                "detector": finding.detector,
                "method": finding.method,
                "alarm": strict(finding.alarm),
                "p_value": strict(finding.p_value),
                "statistic": strict(finding.statistic),
                "threshold": strict(finding.threshold),
                "unit": finding.unit,
                "onset_s": strict(finding.onset_s),
                "says": finding.sentence,
            }
            for finding in verdict.findings
        ],
    }


def write(analysis: Analysis) -> str:
    """Write `analysis` as ``verdicts.json``."""
    document = {
        "schema": "gsfdi/verdicts/1",
        "made": analysis.made,
        "batch": {"path": analysis.batch_path, "sha256": analysis.batch_sha256},
        "baseline": {"name": analysis.baseline_name, "sha256": analysis.baseline_sha256},
        "joints": [joint_object(verdict, record) for verdict, record, _ in judged(analysis)],
        "problems": [
            {"path": problem.path, "kind": problem.kind, "what": problem.what, "mend": problem.mend}
            for problem in analysis.problems
        ],
    }
    return storable(json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


REPORT = Report("json", "verdicts.json", write)
