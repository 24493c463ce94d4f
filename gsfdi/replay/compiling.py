"""How the kernel's functions are compiled, and what numba's cache must know of them."""

import zlib
from pathlib import Path

from numba import njit

from gsfdi import motion

# Nothing is allocated in the kernel, so numba need count no references: that counting, with its atomic instructions,
# took three quarters of the time. Functions with many arguments that are called from one place are inlined. Only the
# entry is cached, by `gsfdi.replay.kernel`: a cached part would keep what it calls as it once was.
compiled = njit(nogil=True, _nrt=False)
inlined = njit(nogil=True, inline="always", _nrt=False)

SOURCES = (*sorted(Path(__file__).parent.glob("*.py")), Path(motion.__file__))
"""Files whose code or numbers are frozen into the kernel."""


def stamp() -> int:
    """Checksum of the times and sizes of `SOURCES`, by which numba too tells whether a file has changed."""
    stats = [path.stat() for path in SOURCES]
    return zlib.crc32(repr([(one.st_mtime_ns, one.st_size) for one in stats]).encode())
