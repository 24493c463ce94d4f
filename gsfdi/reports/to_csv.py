"""``verdicts.csv``: one row per joint, nested names joined by an underscore, for spreadsheets."""

import csv
import io
import json

from gsfdi.reports import Analysis, Report, judged, storable
from gsfdi.reports.to_json import Json, joint_object

FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
"""What makes a spreadsheet take a text for a formula."""

COLUMNS = (
    *("joint", "verdict", "action", "component", "fault", "fault_probability", "alternatives", "onset_s"),
    *(f"methods_{method}_{key}" for method in ("signal", "parity", "smi") for key in ("alarm", "p_value")),
    *("due_when", "due_interval90", "due_reason", "says"),
)
"""The columns that are always there; others follow as the verdicts bring them."""


def flat(value: Json, name: str = "") -> dict[str, Json]:
    """Join the names of nested objects by underscores; lists stay whole.

    Examples
    --------
    >>> flat({"due": {"when": None}, "says": "fine"})
    {'due_when': None, 'says': 'fine'}
    """
    if not isinstance(value, dict):
        return {name: value}
    return {key: leaf for part, item in value.items() for key, leaf in flat(item, f"{name}_{part}".strip("_")).items()}


def cell(value: Json) -> str:
    """Write one cell; a text that a spreadsheet would take for a formula is led by an apostrophe.

    Examples
    --------
    >>> cell("=1+1"), cell(-0.5), cell(True), cell(None)
    ("'=1+1", '-0.5', 'true', '')
    """
    if value is None:
        return ""
    if isinstance(value, str):
        return "'" + value if value.startswith(FORMULA) else value
    return json.dumps(value, ensure_ascii=False)


def write(analysis: Analysis) -> str:
    """Write `analysis` as ``verdicts.csv``."""
    rows = []
    for verdict, record, _ in judged(analysis):
        joint = joint_object(verdict, record)
        del joint["findings"]
        rows.append(flat(joint))
    columns = list(dict.fromkeys([*COLUMNS, *(name for row in rows for name in row)]))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(map(cell, columns))
    table.writerows([cell(row.get(name)) for name in columns] for row in rows)
    return storable(text.getvalue())


REPORT = Report("csv", "verdicts.csv", write)
