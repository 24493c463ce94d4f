"""The heap is kept: what was freed is there for the next array."""

import resource
import subprocess
import sys

import pytest

from gsfdi.heap import keep_freed

CHURN = """
import resource, sys
import numpy as np
from gsfdi.heap import keep_freed
if sys.argv[1] == "kept":
    keep_freed()
for _ in range(200):
    held = [np.ones(1 << 17) for _ in range(8)]
    del held
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
"""


def faults(how: str) -> int:
    done = subprocess.run([sys.executable, "-c", CHURN, how], capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="glibc alone can be told")
def test_pages_are_not_mapped_again() -> None:
    assert faults("kept") < 0.5 * faults("usual")


def test_it_can_be_said_again() -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    keep_freed()
    keep_freed()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + (1 << 15)
