"""Hands independent pieces of work, a joint each, to processes or to a Dask cluster; results come back in order."""

import logging
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from gsfdi.console import divert_warnings
from gsfdi.errors import UnusableInputError

LOG = logging.getLogger("gsfdi")
A = TypeVar("A")
R = TypeVar("R")


class Report(Protocol):
    """What is told how far the work has come."""

    def __call__(self, done: int, total: int, what: str) -> None:
        """Take `done` pieces of `total`, and what is going on."""


def silent(done: int, total: int, what: str) -> None:
    """Tell nobody."""


@dataclass(frozen=True, slots=True)
class Crew:
    """Who does the work.

    Parameters
    ----------
    jobs : int, optional
        At most this many processes; by default as many as there are processors for this one.
    scheduler : str, optional
        Address of a running Dask cluster, which then does it all.
    """

    jobs: int | None = None
    scheduler: str | None = None

    @property
    def size(self) -> int:
        """How many processes at most."""
        return self.jobs or available()

    def hands(self, pieces: int) -> int:
        """How many processors each of so many pieces may use, where they are fewer."""
        return 1 if self.scheduler else max(self.size // max(pieces, 1), 1)


ALONE = Crew(jobs=1)
"""This process and no other."""


ANSWER = 10.0
"""How long a Dask scheduler may take to answer [s]."""


def available() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each(
    work: Callable[[A], R], pieces: Sequence[A], crew: Crew = ALONE, report: Report = silent, what: str = "joints"
) -> list[R]:
    """Apply `work` to every piece.

    Parameters
    ----------
    work : callable
        A function of one piece that other processes can import.
    pieces : sequence
        What to work on.
    crew : Crew
        Who does it; this process alone by default.
    report : callable
        Told after every finished piece.
    what : str
        What is going on, for `report`.

    Returns
    -------
    list
        The results, in the order of `pieces`.
    """
    report(0, len(pieces), what)
    if not crew.scheduler and min(crew.size, len(pieces)) < 2:
        results = []
        for done, piece in enumerate(pieces, start=1):
            results.append(work(piece))
            report(done, len(pieces), what)
        return results
    with _cluster(crew.scheduler) if crew.scheduler else _pool(min(crew.size, len(pieces))) as (submit, finished):
        futures = [submit(work, piece) for piece in pieces]
        for done, _ in enumerate(finished(futures), start=1):
            report(done, len(pieces), what)
        return [future.result() for future in futures]


@contextmanager
def _pool(size: int) -> Iterator[tuple[Callable[..., Future[Any]], Callable[..., Any]]]:
    # A fork of a process that has started Arrow's or numba's threads can hang, so a clean server forks instead.
    methods = multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
    if "forkserver" in methods:
        context.set_forkserver_preload(
            ["gsfdi.pipeline.baseline", "gsfdi.pipeline.analyze", "gsfdi.pipeline.reconcile"]
        )
    pool = ProcessPoolExecutor(size, mp_context=context, initializer=_start, initargs=(LOG.getEffectiveLevel(),))
    try:
        yield pool.submit, as_completed
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _start(level: int) -> None:
    """Begin a worker: as quiet as its parent, and leaving Ctrl-C to it."""
    LOG.setLevel(level)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if level > logging.DEBUG:
        divert_warnings(logging.NullHandler())


@contextmanager
def _cluster(address: str) -> Iterator[tuple[Callable[..., Any], Callable[..., Any]]]:
    try:
        import distributed
    except ImportError as error:
        raise UnusableInputError("--scheduler", "Dask is not installed", "pip install 'gsfdi[dask]'") from error
    try:
        client = distributed.Client(address, timeout=ANSWER)
    except (OSError, ValueError, TimeoutError) as error:
        raise UnusableInputError(address, f"no Dask scheduler answers there ({error})", "check the address") from error
    try:
        yield client.submit, distributed.as_completed
    finally:
        client.close()
