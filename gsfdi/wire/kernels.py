"""Compiled loops over the bytes of a chunk: hop from record to record, check structure, copy fields out."""

from typing import Any

import numba
import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]


@numba.njit(cache=True)
def hop(data: Bytes, at: int, opcodes: Bytes, starts: Ints, sizes: Ints) -> tuple[int, int, bool]:
    """List whole records from `at` on: opcode, start of body, length of body.

    Returns how many, where the next one starts, and whether that one claims more bytes than there are.
    """
    count = 0
    end = len(data)
    while at + 9 <= end and count < len(starts):
        size = np.uint64(0)
        for i in range(8):
            size |= np.uint64(data[at + 1 + i]) << np.uint64(8 * i)
        if size > np.uint64(end - at - 9):
            return count, at, True
        opcodes[count] = data[at]
        starts[count] = at + 9
        sizes[count] = np.int64(size)
        at += 9 + int(size)
        count += 1
    return count, at, at < end and at + 9 > end


@numba.njit(cache=True)
def matching(data: Bytes, starts: Ints, places: Ints, expected: Bytes, mask: Bytes) -> Any:
    """Which messages have, at certain places, the expected bits wherever the mask has bits."""
    found = np.ones(len(starts), dtype=np.bool_)
    for i in range(len(starts)):
        start = starts[i]
        differs = np.uint8(0)
        for j in range(len(places)):
            differs |= (data[start + places[j]] ^ expected[j]) & mask[j]
        found[i] = differs == 0
    return found


@numba.njit(cache=True)
def deepest(data: Bytes) -> int:
    """How deep brackets and braces nest; those in strings count too."""
    depth = most = 0
    for i in range(len(data)):
        byte = data[i]
        if byte == 0x7B or byte == 0x5B:
            depth += 1
            most = max(most, depth)
        elif byte == 0x7D or byte == 0x5D:
            depth -= 1
    return most


@numba.njit(cache=True)
def fields(data: Bytes, starts: Ints, offset: int, size: int) -> Any:
    """The bytes of one field from every message, side by side."""
    copied = np.empty((len(starts), size), dtype=np.uint8)
    for i in range(len(starts)):
        for j in range(size):
            copied[i, j] = data[starts[i] + offset + j]
    return copied
