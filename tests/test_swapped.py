"""A term that takes the place of another must be worth a name of its own."""

from pathlib import Path

import pytest

from gsfdi import ingest
from gsfdi.modelfile import load_models
from gsfdi.proof.cases import Design, draw, write_files
from gsfdi.reconcile import reconcile


@pytest.mark.thorough
def test_what_only_mends_a_fit_that_was_stuck_is_no_name(tmp_path: Path) -> None:
    """A gearbox damping left the plant 44 off its best fit; a friction of 9e-5 of the load gained 14 beside nothing."""
    write_files(draw(Design("null", (), "plain", exact_nominal=True), 140427680407), tmp_path)
    records = ingest.read(sorted(tmp_path.glob("*.parquet"))).records
    answer = reconcile(records, load_models(tmp_path / "nominal.toml").for_joint(records[0].joint))
    assert answer.omitted_physics == ()
    assert answer.verdict in ("explained", "no_mismatch")
