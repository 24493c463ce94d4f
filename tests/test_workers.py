import os
import subprocess
import sys

import pytest

from gsfdi import workers
from gsfdi.errors import LockedError, UnusableInputError
from gsfdi.workers import ALONE, Crew, available, each


def square(number: int) -> tuple[int, int]:
    return number * number, os.getpid()


def refuse(number: int) -> int:
    raise LockedError(number, "is locked", "wait")


def test_alone_it_runs_here_and_in_order() -> None:
    seen: list[tuple[int, int, str]] = []
    assert each(square, [3, 1, 2], ALONE, lambda *told: seen.append(told), "squares") == [
        (9, os.getpid()), (1, os.getpid()), (4, os.getpid())
    ]  # fmt: skip
    assert seen == [(done, 3, "squares") for done in range(4)]


def test_several_processes_give_the_same_in_order() -> None:
    found = each(square, list(range(6)), Crew(jobs=2))
    assert [number for number, _ in found] == [0, 1, 4, 9, 16, 25]
    assert os.getpid() not in {process for _, process in found}


def test_a_worker_says_what_is_wrong_in_full() -> None:
    with pytest.raises(LockedError, match="2: is locked; wait") as raised:
        each(refuse, [2, 2], Crew(jobs=2))
    assert raised.value.exit_status == 5


def test_as_many_as_there_are_processors() -> None:
    assert Crew().size == available() >= 1
    assert Crew(jobs=3).size == 3


@pytest.mark.parametrize(("jobs", "pieces", "hands"), [(1, 1, 1), (4, 1, 4), (4, 2, 2), (4, 3, 1), (2, 7, 1)])
def test_processors_to_spare_work_on_the_same_piece(jobs: int, pieces: int, hands: int) -> None:
    assert Crew(jobs=jobs).hands(pieces) == hands
    assert Crew(jobs=jobs, scheduler="tcp://elsewhere").hands(pieces) == 1


def test_no_scheduler_there_is_said_in_a_line() -> None:
    code = (
        "import sys; sys.modules['distributed'] = None\n"
        "from gsfdi.workers import Crew, each\neach(print, [1], Crew(scheduler='tcp://127.0.0.1:1'))"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "UnusableInputError: --scheduler: Dask is not installed" in ended.stderr


def test_a_dask_cluster_does_the_same() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        found = each(square, [2, 3], Crew(scheduler=cluster.scheduler_address))
    assert [number for number, _ in found] == [4, 9]


def test_a_scheduler_that_does_not_answer_is_said_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "ANSWER", 0.5)
    with pytest.raises(UnusableInputError, match="no Dask scheduler answers there"):
        each(square, [1], Crew(scheduler="tcp://127.0.0.1:1"))
