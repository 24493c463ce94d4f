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
def fields(data: Bytes, starts: Ints, offset: int, size: int) -> Any:
    """The bytes of one field from every message, side by side."""
    copied = np.empty((len(starts), size), dtype=np.uint8)
    for i in range(len(starts)):
        for j in range(size):
            copied[i, j] = data[starts[i] + offset + j]
    return copied


@numba.njit(cache=True)
def doubles(data: Bytes, starts: Ints, offsets: Ints) -> Any:
    """The eight bytes at each of several offsets from every message; a field's are side by side."""
    copied = np.empty((len(offsets), len(starts), 8), dtype=np.uint8)
    for i in range(len(starts)):
        start = starts[i]
        for k in range(len(offsets)):
            at = start + offsets[k]
            for j in range(8):
                copied[k, i, j] = data[at + j]
    return copied


@numba.njit(cache=True)
def slots(data: Bytes, starts: Ints, sizes: Ints, literals: Bytes, edges: Ints) -> Any:
    """Where the numbers of JSON messages stand, if everything between them is as in the literals.

    `edges` are the ends of each literal within `literals`; between two of them stands a number. Gives the start and
    length of every number, and which messages agree.
    """
    count = len(edges) - 1
    begins = np.empty((len(starts), count), dtype=np.int64)
    lengths = np.empty((len(starts), count), dtype=np.int64)
    agree = np.ones(len(starts), dtype=np.bool_)
    for i in range(len(starts)):
        at, end, used = starts[i], starts[i] + sizes[i], 0
        for k in range(count + 1):
            size = edges[k] - used
            if at + size > end:
                agree[i] = False
                break
            for j in range(size):
                if data[at + j] != literals[used + j]:
                    agree[i] = False
                    break
            if not agree[i]:
                break
            at += size
            used = edges[k]
            if k < count:
                first = at
                # 0-9 + - . e E
                while at < end and (48 <= data[at] <= 57 or data[at] in (43, 45, 46, 69, 101)):
                    at += 1
                begins[i, k] = first
                lengths[i, k] = at - first
        if at != end:
            agree[i] = False
    return begins, lengths, agree


@numba.njit(cache=True)
def packed(data: Bytes, begins: Ints, lengths: Ints) -> Any:
    """Pieces of the data side by side, and where each begins and ends."""
    edges = np.zeros(len(begins) + 1, dtype=np.int32)
    for i in range(len(begins)):
        edges[i + 1] = edges[i] + lengths[i]
    text = np.empty(edges[-1], dtype=np.uint8)
    for i in range(len(begins)):
        for j in range(lengths[i]):
            text[edges[i] + j] = data[begins[i] + j]
    return text, edges
