"""Files damaged in every place: what is read must be true, what is lost must be named, and nothing may crash.

python benchmarks/damage.py [--quick] [--seed N]
"""

import argparse
import json
import struct
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import recordings

from gsfdi import ingest
from gsfdi.canonical import write_parquet
from gsfdi.errors import GsfdiError
from gsfdi.readers.mcap_file import message_counts
from gsfdi.types import Batch

Truth = dict[tuple[str, str, str], dict[int, float]]
RESULTS = Path(__file__).parent / "results" / "damage.json"


def truth_of(batch: Batch) -> Truth:
    """Every number of a batch, by robot, joint and channel, then by stamp."""
    found: Truth = {}
    for record in batch.records:
        stamps = (record.t0_ns + np.round(record.t * 1e9).astype(np.int64)).tolist()
        for name in record.channels:
            values = record[name].tolist()
            found[record.robot, record.joint, name] = {s: v for s, v in zip(stamps, values, strict=True) if v == v}
    return found


def untrue(batch: Batch, truth: Truth) -> int:
    """How many believed numbers of a batch are not those of the whole file."""
    wrong = 0
    for key, values in truth_of(batch).items():
        known = truth.get(key, {})
        wrong += sum(known.get(stamp) != value for stamp, value in values.items())
    return wrong


def flips(path: Path, where: Path, every: int, seed: int) -> Iterator[tuple[int, Path]]:
    """The file with one bit flipped, at every byte or every so many."""
    whole = path.read_bytes()
    bits = np.random.default_rng(seed).integers(0, 8, len(whole))
    for at in range(0, len(whole), every):
        damaged = bytearray(whole)
        damaged[at] ^= 1 << int(bits[at])
        where.write_bytes(damaged)
        yield at, where


def flip_campaign(path: Path, where: Path, every: int, seed: int) -> Counter[str]:
    """Read the file with each bit flipped and compare with the truth."""
    whole = ingest.read([path])
    truth = truth_of(whole)
    score: Counter[str] = Counter()
    for _, damaged in flips(path, where, every, seed):
        score["flips"] += 1
        try:
            batch = ingest.read([damaged])
        except Exception as error:
            score[f"traceback {type(error).__name__}"] += 1
            continue
        wrong = untrue(batch, truth)
        told = [p for p in batch.problems if p.kind != "note"]
        lost = truth_of(batch) != truth
        score["flips that gave a wrong number"] += wrong > 0
        score["wrong numbers"] += wrong
        score["flagged"] += bool(told)
        score["lost something unflagged"] += lost and not told and not wrong and not _masked(batch)
        score["no effect"] += not lost and not told
    return score


def _masked(batch: Batch) -> bool:
    return any(
        count
        for record in batch.records
        for channel, counts in record.quality.items()
        for kind, count in counts.items()
        if channel != "time" and kind != "saturated"
    )


def cut_campaign(path: Path, where: Path, every: int) -> Counter[str]:
    """Cut the file at every byte: all that can be unpacked is found, and nothing else."""
    whole = path.read_bytes()
    truth = truth_of(ingest.read([path]))
    score: Counter[str] = Counter()
    for at in range(0, len(whole), every):
        where.write_bytes(whole[:at])
        score["cuts"] += 1
        try:
            batch = ingest.read([where])
            found = message_counts(where).total() if at >= 8 else 0
        except GsfdiError:
            found = 0
        except Exception as error:
            score[f"traceback {type(error).__name__}"] += 1
            continue
        expected = decodable(whole[:at])
        score["messages decodable"] += expected
        score["messages recovered"] += min(found, expected)
        score["messages invented"] += max(found - expected, 0)
        score["untrue numbers"] += untrue(batch, truth)
        score["unflagged"] += not any(p.kind != "note" for p in batch.problems)
    return score


def decodable(data: bytes) -> int:
    """Count the whole messages in the front part of a file, the slow and obvious way."""
    at, count = 8, 0
    while at + 9 <= len(data):
        opcode, size = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        body = data[at + 9 : at + 9 + size]
        if opcode == 5 and len(body) == size:
            count += 1
        elif opcode == 6 and len(body) > 32:
            name = struct.unpack_from("<I", body, 28)[0]
            if len(body) >= 40 + name:
                compression = body[32 : 32 + name].decode()
                count += _inside(_unpacked(compression, body[40 + name :]))
        elif opcode == 15:
            return count
        at += 9 + size
    return count


def _unpacked(compression: str, packed: bytes) -> bytes:
    try:
        if compression == "zstd":
            return zstandard.ZstdDecompressor().decompressobj().decompress(packed)
        if compression == "lz4":
            return lz4.frame.LZ4FrameDecompressor().decompress(packed)
    except (zstandard.ZstdError, RuntimeError):
        return b""
    return packed


def _inside(data: bytes) -> int:
    at = count = 0
    while at + 9 <= len(data):
        size = struct.unpack_from("<Q", data, at + 1)[0]
        count += data[at] == 5 and at + 9 + size <= len(data)
        at += 9 + size
    return count


def length_campaign(path: Path, where: Path) -> Counter[str]:
    """Edit the length of every record at the top of the file."""
    whole = path.read_bytes()
    truth = truth_of(ingest.read([path]))
    score: Counter[str] = Counter()
    at = 8
    while at + 9 <= len(whole) - 8:
        size = struct.unpack_from("<Q", whole, at + 1)[0]
        for edited in (0, 1, max(size - 1, 0), size + 1, size * 2, 2**31, 2**40, 2**63, 2**64 - 1):
            if edited == size:
                continue
            where.write_bytes(whole[: at + 1] + struct.pack("<Q", edited) + whole[at + 9 :])
            score["edits"] += 1
            try:
                batch = ingest.read([where])
            except Exception as error:
                score[f"traceback {type(error).__name__}"] += 1
                continue
            score["untrue numbers"] += untrue(batch, truth)
            lost = truth_of(batch) != truth
            score["lost something unflagged"] += lost and not any(p.kind != "note" for p in batch.problems)
        at += 9 + size
    return score


def _chunk(compression: str, packed: bytes, size: int) -> bytes:
    name = compression.encode()
    body = (
        struct.pack("<QQQI", 0, 0, size, 0)
        + struct.pack("<I", len(name))
        + name
        + struct.pack("<Q", len(packed))
        + packed
    )
    return struct.pack("<BQ", 6, len(body)) + body


def bombs(folder: Path) -> Iterator[tuple[str, Path]]:
    """Small files that ask for a lot."""
    magic, header = b"\x89MCAP0\r\n", struct.pack("<BQ", 1, 8) + bytes(8)

    def mcap(name: str, *parts: bytes) -> tuple[str, Path]:
        path = folder / f"{name}.mcap"
        path.write_bytes(magic + header + b"".join(parts))
        return name, path

    gigabyte = zeros_zstd(1 << 30)
    yield mcap("zstd 1 GB, size stated", _chunk("zstd", gigabyte, 1 << 30))
    yield mcap("zstd 8 GB, size stated", _chunk("zstd", zeros_zstd(8 << 30), 8 << 30))
    yield mcap("zstd 8 GB, small size stated", _chunk("zstd", zeros_zstd(8 << 30), 1 << 20))
    yield mcap("zstd without a size", _chunk("zstd", zeros_zstd(4 << 30, sized=False), 64 << 20))
    yield mcap("lz4 1 GB", _chunk("lz4", lz4.frame.compress(bytes(1 << 30)), 1 << 30))
    yield mcap("lz4 1 GB, small size stated", _chunk("lz4", lz4.frame.compress(bytes(1 << 30)), 1 << 20))
    many = zeros_zstd(100 << 20)
    yield mcap("forty chunks of 100 MB", *[_chunk("zstd", many, 100 << 20)] * 40)
    tiny = zstandard.ZstdCompressor().compress((b"\x80" + bytes(8)) * (10 << 20))
    yield mcap("ten million empty records", _chunk("zstd", tiny, 90 << 20))
    yield mcap("a chunk of 2^63 bytes", struct.pack("<BQ", 6, 2**63) + bytes(64))
    schema = struct.pack("<HI", 1, 2**32 - 1) + b"x" * 100
    yield mcap("a schema name of 4 GB", struct.pack("<BQ", 3, len(schema)) + schema)
    channels = b"".join(
        struct.pack("<BQ", 4, 16) + struct.pack("<HHIII", i % 65536, 0, 0, 0, 0) for i in range(200_000)
    )
    yield mcap("200,000 channels", _chunk("zstd", zstandard.ZstdCompressor().compress(channels), len(channels)))
    nested = b'{"a":' * 100_000
    message = struct.pack("<HIQQ", 1, 0, 0, 0) + nested
    channel = struct.pack("<HHI", 1, 0, 1) + b"x" + struct.pack("<I", 4) + b"json" + struct.pack("<I", 0)
    body = struct.pack("<BQ", 4, len(channel)) + channel
    body += (struct.pack("<BQ", 5, len(message)) + message) * 100
    yield mcap(
        "JSON nested a hundred thousand deep", _chunk("zstd", zstandard.ZstdCompressor().compress(body), len(body))
    )


def zeros_zstd(size: int, sized: bool = True) -> bytes:
    """A zstd frame of zeros."""
    compressor = zstandard.ZstdCompressor().compressobj(size=size if sized else -1)
    block = bytes(1 << 24)
    parts = [compressor.compress(block) for _ in range(size >> 24)]
    return b"".join([*parts, compressor.compress(bytes(size & ((1 << 24) - 1))), compressor.flush()])


_ONE = """
import resource, sys, time
from pathlib import Path
from gsfdi import ingest
list(ingest.stream([Path(sys.argv[1])]))  # compiled, imported
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
started = time.perf_counter()
problems = [problem for batch in ingest.stream([Path(sys.argv[2])]) for problem in batch.problems]
took = time.perf_counter() - started
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(round(took, 2), peak // 1024, (peak - before) // 1024, len(problems))
"""


def bomb_campaign(folder: Path) -> list[dict[str, object]]:
    """Read each bomb in a process of its own, which says how long it took and its peak memory."""
    warm = recordings.joint_states(folder / "warm.mcap", 20)
    rows = []
    for name, path in bombs(folder):
        told = subprocess.run(
            [sys.executable, "-c", _ONE, str(warm), str(path)], capture_output=True, text=True, check=True
        ).stdout.split()
        size = path.stat().st_size // 1024
        rows.append(
            {
                "bomb": name,
                "file kB": size,
                "seconds": float(told[0]),
                "peak MB": int(told[1]),
                "of which it": int(told[2]),
                "named": told[3] != "0",
            }
        )
    return rows


def _guarded(name: str, run: Callable[[], object], results: dict[str, object]) -> None:
    started = time.perf_counter()
    results[name] = run()
    print(f"{name} ({time.perf_counter() - started:.0f} s)\n  {json.dumps(results[name])}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="every 40th place only")
    parser.add_argument("--bombs", action="store_true", help="the bombs alone, beside the results kept")
    parser.add_argument("--seed", type=int, default=1, help="which bit of each byte is flipped")
    asked = parser.parse_args()
    every, seed = 40 if asked.quick else 1, asked.seed
    results: dict[str, object] = json.loads(RESULTS.read_text()) if asked.bombs else {}
    with tempfile.TemporaryDirectory() as name:
        folder, where = Path(name), Path(name) / "damaged.mcap"
        _guarded("bombs", lambda: bomb_campaign(folder), results)
        for compression in () if asked.bombs else ("none", "lz4", "zstd"):
            options = {"compression": compression, "chunk_size": 4096}
            path = recordings.joint_states(folder / f"{compression}.mcap", 60, **options)
            _guarded(f"cut, {compression}", lambda p=path: cut_campaign(p, where, every), results)
            _guarded(f"lengths, {compression}", lambda p=path: length_campaign(p, where), results)
            _guarded(f"flips with CRC, {compression}", lambda p=path: flip_campaign(p, where, every, seed), results)
            path = recordings.joint_states(folder / f"{compression}-bare.mcap", 60, enable_crcs=False, **options)
            _guarded(
                f"flips without CRC, {compression}",
                lambda p=path: flip_campaign(p, where, every, seed + 1),
                results,
            )
        if not asked.bombs:
            _others(folder, where, every, seed + 2, results)
    if every == 1:
        RESULTS.write_text(json.dumps(results, indent=1) + "\n")


def _others(folder: Path, where: Path, every: int, seed: int, results: dict[str, object]) -> None:
    path = recordings.joint_states(folder / "loose.mcap", 60, use_chunking=False, enable_data_crcs=True)
    _guarded("flips, no chunks, data CRC", lambda: flip_campaign(path, where, every, seed), results)
    parquet = folder / "whole.parquet"
    write_parquet(parquet, ingest.read([path]).records)
    bad = folder / "damaged.parquet"
    _guarded("flips, Parquet", lambda: flip_campaign(parquet, bad, every, seed + 1), results)


if __name__ == "__main__":
    main()
