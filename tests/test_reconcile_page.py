"""The page of reconcile tells every outcome, with and without evidence, and hides nothing of what was found."""

import html
import json
from dataclasses import replace
from pathlib import Path

import pytest
from pages import HOSTILE, story

from gsfdi.reports import reconcile_page
from gsfdi.reports.reconcile_page import HEADLINES, LEVELS, Story, sentence, write

BARE = {
    "joint": "SH1",
    "verdict": "no_mismatch",
    "mismatch": {"detected": False, "p_value": None, "effect": None},
    "location": None,
    "omitted_physics": [],
    "indistinguishable": [],
    "fit": None,
    "updated_model": None,
}


@pytest.mark.parametrize("outcome", sorted(HEADLINES))
def test_every_outcome_is_told_even_without_evidence(outcome: str) -> None:
    page = write([Story({**BARE, "verdict": outcome})], [], "2026-11-21")
    assert HEADLINES[outcome] in page
    assert f'class="level {LEVELS[outcome]}"' in page


def test_everything_that_was_found_is_on_the_page() -> None:
    page = html.unescape(write([story("SH1")], [{"path": "a.mcap", "sha256": "ab" * 32}], "2026-11-21"))
    for said in (
        "coulomb friction (motor side)",
        "98 %",
        "2 to 2.2",
        "torque constant change · output inertia change",
        "Move SH1 with a known load.",
        "why SH1 lost",
        "7.4 to 60 s",
        "0 to 2 Hz",
        "6.5 %",
        'name = "SH1"',
        "ab" * 32,
    ):
        assert said in page, said


def test_many_joints_begin_with_a_summary_that_leads_to_each() -> None:
    page = write([story(joint) for joint in HOSTILE], [], "2026-11-21")
    assert all(f'href="#joint-{k}"' in page and f'id="joint-{k}"' in page for k in range(len(HOSTILE)))
    assert len(page.encode()) < 2_000_000


def test_the_page_tells_what_could_have_been_seen() -> None:
    least = [{"term": "coulomb_friction", "side": "motor", "parameters": {"torque_nm": 0.0123}}]
    page = write([Story({**BARE, "mismatch": {"smallest_seen": least}})], [], "2026-11-21")
    assert "What could have been seen" in page
    assert "0.0123" in page


@pytest.mark.parametrize("part", ["overlays", "maps", "profiles", "ranking", "experiments"])
def test_any_part_of_the_evidence_may_be_missing(part: str) -> None:
    whole = story("SH1")
    less = replace(whole, evidence={key: value for key, value in whole.evidence.items() if key != part})
    assert len(write([less], [], "")) < len(write([whole], [], ""))


def test_the_sentence_names_terms_by_probability() -> None:
    assert sentence(story("SH1").joint) == "the mismatch is explained: coulomb friction (motor side), 98 %"


def test_the_example_of_the_published_format_makes_a_page(tmp_path: Path) -> None:
    published = {**story("SH1").joint, "updated_model": "SH1.updated_model.toml"}
    again = json.loads(json.dumps(published))
    assert "SH1" in reconcile_page.write([Story(again)], [], "2026-11-21")
