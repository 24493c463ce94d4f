"""Coverage-guided fuzzing of the readers: any bytes give records and problems, never an exception or a bad record.

python benchmarks/fuzz.py [seconds]
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ["NUMBA_DISABLE_JIT"] = "1"  # compiled loops would be blind spots
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import atheris

with atheris.instrument_imports(include=["gsfdi"]):
    from gsfdi import ingest, quality
    from gsfdi.readers import csv_file, mcap_file, parquet_file
    from gsfdi.wire import cdr, idl, jsons, layout, proto, records, rows, select, tables, topic

import numpy as np
import recordings

from gsfdi.canonical import write_parquet

RESULTS = Path(__file__).parent / "results" / "fuzz.json"
PARTS = (
    cdr,
    csv_file,
    idl,
    jsons,
    layout,
    mcap_file,
    parquet_file,
    proto,
    quality,
    records,
    rows,
    select,
    tables,
    topic,
)
SHOWN = 200


class Fuzz:
    """The target, and how often it was called."""

    def __init__(self, where: Path, seconds: float) -> None:
        self.where, self.end = where, time.monotonic() + seconds
        self.started = time.monotonic()
        self.executions = self.with_records = 0

    def one(self, data: bytes) -> None:
        """Read some bytes, whatever they are."""
        self.where.write_bytes(data)
        batch = ingest.read([self.where])
        self.executions += 1
        self.with_records += bool(batch.records)
        assert batch.records or batch.problems
        for record in batch.records:
            assert (np.diff(record.t) > 0).all()
            for name in record.channels:
                believed = record[name]
                assert len(believed) == len(record.t)
                assert not np.isinf(believed).any()
        if time.monotonic() > self.end:
            self.tell()
            os._exit(0)

    def tell(self) -> None:
        """Keep the count."""
        result = {
            "executions": self.executions,
            "gave records": self.with_records,
            "failures": 0,
            "seconds": round(time.monotonic() - self.started),
            "atheris": "coverage-guided, compiled loops run as Python",
            "parts": [part.__name__ for part in PARTS],
        }
        RESULTS.write_text(json.dumps(result, indent=1) + "\n")
        print(json.dumps(result, indent=1))


def corpus(folder: Path) -> None:
    """Small recordings of every kind to start from."""
    folder.mkdir()
    plain = {"compression": "none", "enable_crcs": False}
    recordings.joint_states(folder / "cdr", 4, **plain)
    recordings.joint_states(folder / "loose", 3, use_chunking=False, enable_crcs=False)
    recordings.joint_states(folder / "crc", 3, compression="lz4")
    recordings.protobuf_recording(folder / "proto", 3, **plain)
    recordings.json_recording(folder / "json", 3, **plain)
    idl_entry = ("/js", "cdr", "sensor_msgs/msg/JointState", "ros2idl", recordings.JOINT_STATE_IDL.encode(), [])
    recordings.write_mcap(folder / "idl", [idl_entry], **plain)
    batch = ingest.read([folder / "cdr"])
    write_parquet(folder / "parquet", batch.records[:1])
    (folder / "csv").write_text("timestamp,joint,position_rad\n" + "2026-01-01T00:00:00Z,J1,0.5\n" * 3)
    (folder / "csv2").write_text("timestamp;joint;position_m\n1700000000000000000;J1;1,5\n1700000000000000001;J1;x\n")


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 600.0
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as name:
        folder = Path(name)
        corpus(folder / "corpus")
        fuzz = Fuzz(folder / "input", seconds)
        options = ["-max_len=8192", "-timeout=20", "-rss_limit_mb=2048", f"-artifact_prefix={folder}/"]
        atheris.Setup([sys.argv[0], str(folder / "corpus"), *options], fuzz.one)
        try:
            atheris.Fuzz()
        finally:
            for found in folder.glob("crash-*"):
                print(f"the input that failed: {found.read_bytes()[:SHOWN]!r}", file=sys.stderr)


if __name__ == "__main__":
    main()
