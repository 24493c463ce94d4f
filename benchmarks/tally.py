"""Jobs that each say whether they came out right: run side by side, told line by line, and counted."""

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

Asked = TypeVar("Asked")


def tally(one: Callable[[Asked], tuple[bool, str]], jobs: Iterable[Asked], processes: int) -> str:
    """Run `one` on every job, print its line as it comes, and say how many of how many were right."""
    found = []
    with ProcessPoolExecutor(processes) as pool:
        for right, line in pool.map(one, jobs):
            print(line, flush=True)
            found.append(right)
    return f"{sum(found)} of {len(found)}"
