"""The C library's allocator, told to keep what was freed.

A long batch is worked off in pieces whose arrays, of a megabyte each, are made and freed by the thousand. By default
the allocator gives each back to the system and has the next one mapped anew, page by page, which costs as much as the
sum that is taken of it.
"""

import ctypes
import sys

# What malloc.h calls them.
M_TRIM_THRESHOLD = -1
M_MMAP_THRESHOLD = -3
KEPT = 64 << 20
"""Bytes at the end of the heap that are kept for the next array."""
LARGEST = 32 << 20
"""Arrays up to this size come from the heap; it is the most that may be asked for [bytes]."""


def keep_freed() -> None:
    """Have this process keep its heap; only glibc can be told so, and elsewhere nothing happens."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        mallopt(M_TRIM_THRESHOLD, KEPT)
        mallopt(M_MMAP_THRESHOLD, LARGEST)
