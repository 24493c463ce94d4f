"""The page of the proof shows what was missed as plainly as what was reached."""

import html
import re

import pytest
from pages import HOSTILE, proof, rate

from gsfdi.reports.proof_page import GOALS, asked, is_right, tiles, write


def test_a_missed_goal_is_shown_as_missed() -> None:
    rows = {str(tile["says"]): tile["met"] for tile in tiles(proof()["figures"])}
    assert rows["first name right"] is True
    assert rows["component right"] is False
    assert rows["below what can be seen: silent or right"] is None


def test_a_question_that_never_arose_gets_no_tile() -> None:
    says = [tile["says"] for tile in tiles({"several_all_named": rate(0, 0), "parameter_error_median": None})]
    assert says == []


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: goal.key)
def test_goals_can_be_reached_and_read(goal: object) -> None:
    assert goal.least <= goal.most
    assert "–" not in asked(goal)


def test_the_page_holds_seal_figures_and_every_case() -> None:
    sealed = proof()
    page = html.unescape(write(sealed))
    assert "ab" * 32 in page
    assert "cd" * 32 in page
    assert all(name in page for name in sealed["scores"])
    assert "96 of 100, 95 % interval" in page
    assert "gsfdi prove --check" in page
    assert "said 90 % to 99 %, 95 % in the mean" in page


@pytest.mark.parametrize("part", ["rivals", "calibration", "real", "showcase"])
def test_what_a_proof_lacks_is_left_out(part: str) -> None:
    page = write({key: value for key, value in proof().items() if key != part})
    assert f'id="{part}"' not in page


def test_nothing_that_a_proof_says_is_markup() -> None:
    page = write(proof(HOSTILE))
    assert not re.search(r"<script>alert|<img", page)
    assert len(page.encode()) < 2_000_000


@pytest.mark.parametrize(
    ("score", "right"),
    [
        ({"group": "null", "kinds": [], "extra": []}, True),
        ({"group": "null", "kinds": [], "extra": ["cogging"]}, False),
        ({"group": "unknown", "kinds": ["creep"], "puzzled": True, "first_right": None}, True),
        ({"group": "unknown", "kinds": ["creep"], "puzzled": False, "first_right": None}, False),
        ({"group": "single", "kinds": ["backlash"], "puzzled": True, "first_right": False}, False),
        ({"group": "single", "kinds": ["controller_gain"], "first_right": None, "located": True}, True),
    ],
)
def test_what_counts_as_right_depends_on_what_acted(score: dict[str, object], right: bool) -> None:
    assert is_right(score) is right
