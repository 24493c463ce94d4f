"""Decompression that never gives more than was promised."""

import lz4.frame
import zstandard

STEP = 1 << 22
"""Bytes unpacked at a time where the size is not known beforehand."""


def unpack(compression: str, packed: bytes, size: int, cut: bool) -> bytes:
    """Decompress a chunk into exactly `size` bytes, or as far as a cut one goes.

    Parameters
    ----------
    compression : str
        ``""``, ``"zstd"`` or ``"lz4"``.
    packed : bytes
    size : int
        Length that the chunk states.
    cut : bool

    Raises
    ------
    ValueError
        Not what the chunk states, or of unknown compression.
    """
    try:
        if compression == "":
            data = packed
        elif compression == "zstd":
            data = _zstd(packed, size, cut)
        elif compression == "lz4":
            data = _lz4(packed, size)
        else:
            raise ValueError(f"compression {compression[:20]!r} is none of zstd, lz4")
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise ValueError(f"it does not unpack: {error}") from error
    if len(data) > size or (len(data) < size and not cut):
        raise ValueError(f"it unpacks to {len(data)} bytes and not the {size} that it states")
    return data


def _zstd(packed: bytes, size: int, cut: bool) -> bytes:
    if not cut and len(packed) >= 18 and zstandard.get_frame_parameters(packed).content_size == size:
        try:
            return zstandard.ZstdDecompressor().decompress(packed, allow_extra_data=False)
        except zstandard.ZstdError:
            pass  # several frames, or damaged: the bounded way says which
    parts: list[bytes] = []
    left = size + 1
    with zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True) as stream:
        while left > 0:
            part = stream.read(min(left, STEP))
            if not part:
                break
            parts.append(part)
            left -= len(part)
    return b"".join(parts)


def _lz4(packed: bytes, size: int) -> bytes:
    parts: list[bytes] = []
    left = size + 1
    while packed and left > 0:
        frame = lz4.frame.LZ4FrameDecompressor()
        part = frame.decompress(packed, max_length=left)
        parts.append(part)
        left -= len(part)
        packed = frame.unused_data or b""
    return b"".join(parts) if len(parts) != 1 else parts[0]
