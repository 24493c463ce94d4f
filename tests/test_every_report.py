"""Every form of report keeps every finding, escapes what it prints, and says the same thing twice."""

import csv
import html
import io
import json
import re

import pytest
from pages import HOSTILE, analysis

from gsfdi.registry import shelf
from gsfdi.reports import Report

REPORTS = list(shelf("gsfdi.reports", Report).values())


@pytest.mark.parametrize("report", REPORTS, ids=lambda report: report.name)
class TestEveryReport:
    def test_keeps_every_joint(self, report: Report) -> None:
        joints = [f"joint-{k}" for k in range(12)]
        text = report.write(analysis(*joints))
        assert [joint for joint in joints if joint not in text] == []

    def test_says_the_same_twice(self, report: Report) -> None:
        assert report.write(analysis(*HOSTILE)) == report.write(analysis(*HOSTILE))

    def test_can_be_stored_whatever_a_file_is_called(self, report: Report) -> None:
        report.write(analysis(*HOSTILE)).encode("utf-8")

    def test_writes_a_batch_without_joints(self, report: Report) -> None:
        assert report.write(analysis()).endswith("\n") or report.name == "html"

    def test_says_no_number_that_is_none(self, report: Report) -> None:
        assert not re.search(r"\b(nan|NaN|Infinity|inf)\b", report.write(analysis("SH1")))


def written(name: str, *joints: str) -> str:
    return shelf("gsfdi.reports", Report)[name].write(analysis(*joints))


def test_json_is_strict_and_keeps_every_finding() -> None:
    def refuse(name: str) -> None:
        raise AssertionError(name)

    document = json.loads(written("json", *HOSTILE), parse_constant=refuse)
    assert document["schema"] == "gsfdi/verdicts/1"
    assert [joint["joint"] for joint in document["joints"]] == list(HOSTILE)
    for joint in document["joints"]:
        assert {finding["detector"] for finding in joint["findings"]} == {"parity", "angles"}
        assert joint["methods"]["smi"] == {"alarm": False, "p_value": None}
        assert joint["due"]["interval90"] == ["2026-12-02", "2027-01-08"]


def test_csv_has_a_row_per_joint_and_no_cell_is_a_formula() -> None:
    rows = list(csv.DictReader(io.StringIO(written("csv", *HOSTILE))))
    assert len(rows) == len(HOSTILE)
    for row, joint in zip(rows, HOSTILE, strict=True):
        assert row["joint"].removeprefix("'") == joint.replace("\udcff", r"\udcff")
        assert row["due_when"] == "2026-12-14"
        assert row["methods_parity_alarm"] == "true"
        assert not any(value.startswith(("=", "+", "@")) for value in row.values())


def test_html_shows_every_finding_and_nothing_in_it_is_markup() -> None:
    page = written("html", *HOSTILE)
    for joint in HOSTILE:
        said = html.escape(f"Residual of {joint}", quote=False).replace("\udcff", r"\udcff")
        assert said in page.replace("&#34;", '"').replace("&#39;", "'")
    for smuggled in ("<script>alert", "<img src=x", "<b>arm", "<i>night", "<u>bad"):
        assert smuggled not in page
    assert "cut short &amp; odd" in page


def test_html_fetches_nothing_and_stays_small() -> None:
    page = written("html", *(f"joint-{k}" for k in range(40)))
    assert len(page.encode()) < 2_000_000
    assert not re.search(r"(src|href)=.?(https?:|//)|@import|url\(", page.replace("x onerror", ""))


def test_prometheus_gauges_are_one_per_joint_and_level() -> None:
    text = written("prometheus", "SH1", 'a"b')
    values = [line.rsplit(" ", 1) for line in text.splitlines() if not line.startswith("#")]
    assert len(values) == len({name for name, _ in values})
    assert 'gsfdi_joint_verdict{robot="<b>arm</b>",joint="SH1",verdict="distress"} 1' in text
    assert r'joint="a\"b"' in text
