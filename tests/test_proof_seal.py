"""A proof end to end with tools of straw, and everybody who tries to cheat."""

import json
import os
from pathlib import Path

import pytest

from gsfdi.errors import UnusableInputError
from gsfdi.proof import check, prove
from gsfdi.proof.plan import SHARES, full, plan

SAYS_NOTHING = """
import json, pathlib
pathlib.Path("answer").mkdir()
joint = {"verdict": "no_mismatch", "omitted_physics": [], "indistinguishable": [], "location": {}, "fit": None}
json.dump({"joints": [joint]}, open("answer/reconcile.json", "w"))
"""


def tool(folder: Path, code: str) -> tuple[str, ...]:
    path = folder / "tool.py"
    path.write_text(code)
    return (str(path),)


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("proof")
    said: list[str] = []
    result = prove(3, seed=5, out=folder, tool=tool(tmp_path_factory.mktemp("tool"), SAYS_NOTHING), say=said.append)
    assert result["seal"]["truth_sha256"] in said[0]
    return folder


@pytest.fixture
def proof(honest: Path, tmp_path: Path) -> Path:
    """A copy that a test may spoil."""
    for path in honest.rglob("*"):
        if path.is_file():
            target = tmp_path / path.relative_to(honest)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    return tmp_path


def test_an_untouched_proof_checks(proof: Path) -> None:
    result = check(proof)
    assert result["figures"]["cases"] == 3
    assert result["figures"]["trespasses"] == 0
    assert result["figures"]["answered"]["rate"] == 1.0


def test_a_tampered_answer_is_caught(proof: Path) -> None:
    path = sorted((proof / "answers").iterdir())[0]
    path.write_text(path.read_text().replace("no_mismatch", "explained"))
    with pytest.raises(UnusableInputError, match="not the answer that was scored"):
        check(proof)


def test_a_changed_truth_is_caught(proof: Path) -> None:
    path = proof / "truth.json"
    path.write_text(path.read_text().replace('"single"', '"null"', 1))
    with pytest.raises(UnusableInputError, match="not the truth that was sealed"):
        check(proof)


def test_changed_figures_are_caught(proof: Path) -> None:
    path = proof / "proof.json"
    stored = json.loads(path.read_text())
    stored["figures"]["first_name_right"]["rate"] = 1.0
    path.write_text(json.dumps(stored))
    with pytest.raises(UnusableInputError, match="figures are not what the answers give"):
        check(proof)


@pytest.mark.parametrize(
    "theft",
    [
        "open(SEAL).read()",
        "import os; open(f'/proc/{os.getppid()}/cmdline', 'rb').read()",
        "import subprocess; subprocess.run(['cat', SEAL])",
        "import gsfdi.proof.cases",
    ],
)
def test_a_tool_that_reads_the_truth_is_caught(theft: str, tmp_path: Path) -> None:
    out, shop = tmp_path / "out", tmp_path / "shop"
    shop.mkdir()
    code = f"SEAL = {str(out / 'seal.json')!r}\n{theft}\n{SAYS_NOTHING}"
    result = prove(1, seed=6, out=out, tool=tool(shop, code))
    assert result["figures"]["trespasses"] == 1
    with pytest.raises(UnusableInputError, match="reading what the tool may not read"):
        check(out)


def test_a_folder_that_python_searches_for_modules_may_be_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, shop, path = tmp_path / "out", tmp_path / "shop", tmp_path / "path"
    shop.mkdir()
    path.mkdir()
    monkeypatch.setenv("PYTHONPATH", str(path), prepend=os.pathsep)
    code = f"import os; os.listdir({str(path)!r})\n{SAYS_NOTHING}"
    assert prove(1, seed=6, out=out, tool=tool(shop, code))["figures"]["trespasses"] == 0


def test_the_truth_is_nowhere_while_the_tool_works(tmp_path: Path) -> None:
    """The tool finds two files beside itself, and no truth is written before the last answer is stored."""
    out, shop = tmp_path / "out", tmp_path / "shop"
    shop.mkdir()
    code = SAYS_NOTHING.replace('"location": {}', '"location": {"here": sorted(map(str, pathlib.Path().iterdir()))}')

    def look(done: int, total: int, what: str) -> None:
        if what == "cases" and done < total:
            assert not (out / "truth.json").exists()
            assert (out / "seal.json").exists()

    prove(2, seed=8, out=out, tool=tool(shop, code), progress=look)
    for path in (out / "answers").iterdir():
        here = json.loads(path.read_text())["answer"]["joints"][0]["location"]["here"]
        assert "nominal.toml" in here
        assert all(name == "answer" or name == "nominal.toml" or name.startswith("recording") for name in here)


def test_a_crash_and_a_silence_are_counted(tmp_path: Path) -> None:
    result = prove(1, seed=14, out=tmp_path / "out", tool=tool(tmp_path, "raise ValueError('no')"))
    assert result["figures"]["answered"]["hits"] == 0


def test_a_proof_goes_on_where_it_stopped(proof: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    sorted((proof / "answers").iterdir())[0].unlink()
    shop = tmp_path_factory.mktemp("tool")
    before = json.loads((proof / "proof.json").read_text())["figures"]["first_name_right"]
    after = prove(3, seed=5, out=proof, tool=tool(shop, SAYS_NOTHING))["figures"]["first_name_right"]
    assert before == after


def test_other_cases_may_not_move_into_a_sealed_folder(proof: Path) -> None:
    drawn: list[int] = []
    with pytest.raises(UnusableInputError, match="seals other cases"):
        prove(3, seed=6, out=proof, progress=lambda done, total, what: drawn.append(done))
    assert drawn == [0]  # told by the first


@pytest.mark.parametrize("text", ["", "{", "[]", "{}"])
def test_what_is_no_seal_is_told_so(tmp_path: Path, text: str) -> None:
    (tmp_path / "seal.json").write_text(text)
    with pytest.raises(UnusableInputError, match="is no seal"):
        prove(1, seed=6, out=tmp_path)


def test_twenty_cases_span_the_groups() -> None:
    designs = plan(20, 0)
    assert len(designs) == 20
    assert {design.group for design in designs} >= {"single", "null", "double", "unknown", "withheld"}
    kinds = [design.kinds for design in designs if design.group == "single"]
    assert len(set(kinds)) == len(kinds)
    assert sum(SHARES.values()) == pytest.approx(1.0)


def test_the_full_proof_holds_every_kind_eight_times() -> None:
    designs = full(0)
    counts: dict[tuple[str, ...], int] = {}
    for design in designs:
        if design.group == "single":
            counts[design.kinds] = counts.get(design.kinds, 0) + 1
    assert min(counts.values()) >= 8
    assert len(counts) >= 20
    assert sum(design.group == "null" for design in designs) >= 100
