from pathlib import Path

import pytest

from gsfdi.config import load_night
from gsfdi.errors import UnusableInputError

GOOD = 'schema = "gsfdi/nightly/1"\ninbox = "inbox"\nout = "nights"\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "night.toml"
    path.write_text(text)
    return path


def test_paths_are_taken_from_the_folder_of_the_file(tmp_path: Path) -> None:
    night = load_night(written(tmp_path, GOOD + 'mappings = ["m.toml"]\nmodel = "/arm.toml"\njobs = 2\n'))
    assert (night.inbox, night.out, night.store) == (tmp_path / "inbox", tmp_path / "nights", tmp_path / "store")
    assert night.mappings == (tmp_path / "m.toml",)
    assert night.model == Path("/arm.toml")
    assert night.jobs == 2


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('out = "nights"', "inbox: is missing"),
        (GOOD + "stor = 'x'", "did you mean 'store'"),
        (GOOD + "jobs = 0", "jobs: 0 is impossible"),
        (GOOD + "jobs = true", "not a number"),
        (GOOD + "jobs = 'two'", "not a number"),
        (GOOD + "settle_s = -1", ":4: settle_s: -1 is impossible"),
        (GOOD + "settle_s = nan", "nan is impossible"),
        (GOOD + "mappings = [1]", "not a list of texts"),
        (GOOD + "fail_on = 'bad'", "'bad' is not known"),
        (GOOD + "inbox = 'again'", "Cannot overwrite"),
        ('schema = "gsfdi/nightly/9"\ninbox = "a"\nout = "b"', "known: gsfdi/nightly/1"),
        ("inbox = ", "Invalid value"),
    ],
)
def test_what_cannot_be_used_is_named_with_its_mend(tmp_path: Path, text: str, says: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(UnusableInputError, match=str(path)) as raised:
        load_night(path)
    assert says in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UnusableInputError, match=r"nowhere\.toml: "):
        load_night(tmp_path / "nowhere.toml")
