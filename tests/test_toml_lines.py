from pathlib import Path

import pytest

from gsfdi.errors import UnusableInputError
from gsfdi.toml_lines import Place, lines_of, read

TEXT = """# a comment = nothing
name = "x"
plant.mass = 2
[joints.SH1.plant]
"odd key" = 1
[[joints.SH1.physics]]
term = "a"
[[joints.SH1.physics]]
term = "b"
"""


def test_lines_of_every_kind_of_key() -> None:
    lines = lines_of(TEXT)
    assert lines[("name",)] == 2
    assert lines[("plant", "mass")] == 3
    assert lines[("joints", "SH1", "plant")] == 4
    assert lines[("joints", "SH1", "plant", "odd key")] == 5
    assert lines[("joints", "SH1", "physics", 1, "term")] == 9


def place(tmp_path: Path, text: str) -> Place:
    path = tmp_path / "x.toml"
    path.write_text(text)
    return Place(path, *read(path))


def test_a_table_that_is_none(tmp_path: Path) -> None:
    top = place(tmp_path, "plant = 3\nphysics = 1")
    with pytest.raises(UnusableInputError, match=r"x.toml:1: plant: is not a table; write it as \[plant\]"):
        top.inside("plant")
    with pytest.raises(UnusableInputError, match=r"write each entry under \[\[physics\]\]"):
        top.entries("physics")


def test_a_complaint_of_what_is_not_there_points_at_its_table(tmp_path: Path) -> None:
    inner = place(tmp_path, "\n[plant]\nx = 1").inside("plant")
    assert str(inner.error("y", "is missing", "add it")).endswith("x.toml:2: plant.y: is missing; add it")
