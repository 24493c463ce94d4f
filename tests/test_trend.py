"""The trend belongs to the fault that the verdict names, and reaches from the ledger to the date foretold."""

from dataclasses import replace

import pytest
from pages import analysis, verdict

from gsfdi.reports import to_html
from gsfdi.reports.trend import history_of, trend_figures
from gsfdi.types import Due

NIGHTS = [
    {"when": 1.795e9 + 86400 * k, "shares": {"torque_constant_change": [-0.002 * k, 1e-3], "backlash": [0.05, 1e-3]}}
    for k in range(10)
]


def test_a_drift_is_drawn_from_the_history_of_the_change() -> None:
    (figure,) = trend_figures(verdict("SH1"), NIGHTS, 0.1)
    assert "torque constant change" in figure.caption
    assert "foretold" in figure.svg
    assert "due" in figure.svg


def test_without_a_fault_the_outlook_says_which_history() -> None:
    quiet = replace(verdict("SH1"), fault=None, due=Due("2027-01-01", None, "backlash grows"))
    assert history_of(quiet, NIGHTS) == "backlash"
    assert history_of(replace(quiet, due=Due(None, None, "no degradation is under way")), NIGHTS) is None


@pytest.mark.parametrize("ledger", [[], NIGHTS[:1], [{"when": 0.0}], [{"when": 0.0, "shares": {}}] * 3])
def test_nothing_is_drawn_from_less_than_two_batches(ledger: list[dict[str, object]]) -> None:
    assert list(trend_figures(verdict("SH1"), ledger, 0.1)) == []


def test_the_page_holds_the_trend_of_each_joint() -> None:
    whole = replace(analysis("SH1", "SH2"), ledgers=(NIGHTS, ()))
    page = to_html.write(whole)
    assert "SH1: torque constant change over time" in page
    assert "SH2: torque constant change over time" not in page
