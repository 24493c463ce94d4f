"""Reading speed beside other readers, in one run: messages per second of processor time on one core.

python benchmarks/reading.py [messages]
"""

import json
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import lz4.frame
import mcap.records
import mcap.stream_reader
import pyarrow.parquet as pq
import zstandard
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import recordings

from gsfdi import ingest
from gsfdi.readers import mcap_file
from gsfdi.store import Store
from gsfdi.wire import Columns

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper", "gripper_finger")
RESULTS = Path(__file__).parent / "results" / "reading.json"
OURS = "gsfdi, columns"
REPEATS = 3


def timed(run: Callable[[], int]) -> float:
    """Best rate of a few runs [1/s]; the run says how many messages it read."""
    best = 0.0
    for _ in range(REPEATS):
        started = time.process_time()
        count = run()
        best = max(best, count / (time.process_time() - started))
    return best


def columns(path: Path) -> int:
    """Read every channel of every joint as columns, checksums verified."""
    items = [item for item in mcap_file.read(path, (), None) if isinstance(item, Columns)]
    assert sum(len(item.values) > 0 for item in items) == len(items)
    return sum(len(item.time_ns) for item in items)


def records(path: Path) -> int:
    """Read what `gsfdi ingest` works on, times checked and quality judged."""
    return len(ingest.read([path]).records[0].t)


def with_mcap(path: Path) -> int:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return sum(1 for _, _, _, message in reader.iter_decoded_messages() if message.position)


def with_rosbags(path: Path) -> int:
    types = get_typestore(Stores.ROS2_HUMBLE)
    count = 0
    with Reader(path) as reader:
        for connection, _, data in reader.messages():
            count += len(types.deserialize_cdr(data, connection.msgtype).position) == len(JOINTS)
    return count


def with_protobuf(path: Path) -> int:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        made, count = None, 0
        for schema, _, message in reader.iter_messages():
            if made is None:
                files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
                pool = descriptor_pool.DescriptorPool()
                for each in files.file:
                    pool.Add(each)
                made = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
            whole = made.FromString(message.data)
            count += len([(joint.name, joint.position, joint.velocity) for joint in whole.joints]) == len(JOINTS)
        return count


def with_json(path: Path) -> int:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        return sum(len(json.loads(message.data)["position"]) == len(JOINTS) for _, _, message in reader.iter_messages())


def unpacking(path: Path, messages: int) -> float:
    """Bare decompression of the file's chunks, as messages per second."""
    with path.open("rb") as file:
        stream = mcap.stream_reader.StreamReader(file, emit_chunks=True)
        chunks = [record for record in stream.records if isinstance(record, mcap.records.Chunk)]
    unpack = {"zstd": zstandard.ZstdDecompressor().decompress, "lz4": lz4.frame.decompress, "": bytes}

    def run() -> int:
        for chunk in chunks:
            unpack[chunk.compression](chunk.data)
        return messages

    return timed(run)


def store_rates(folder: Path, path: Path) -> dict[str, float]:
    """The store against pyarrow on the same columns [rows/s of one joint]."""
    batch = ingest.read([path])
    store = Store(folder / "store")
    started = time.process_time()
    written = store.add(batch)
    rows = sum(len(record.t) for record in batch.records)
    rates = {"written": rows / (time.process_time() - started)}
    names = ["timestamp", "position_rad", "joint_velocity_rad_s", "drive_torque_nm"]

    def bare() -> int:
        return sum(pq.ParquetFile(each).read(names, use_threads=False).num_rows for each in written)

    rates["read by pyarrow"] = timed(bare)
    rates["read as records, verified, judged"] = timed(lambda: sum(len(r.t) for r in store.records()))
    rates["bytes per row"] = sum(each.stat().st_size for each in written) / rows
    return rates


def main() -> None:
    messages = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    rows: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def add(encoding: str, compression: str, reader: str, rate: float) -> None:
            rows.append(
                {"encoding": encoding, "compression": compression, "reader": reader, "messages per s": round(rate)}
            )
            print(f"{encoding:9} {compression:5} {reader:45} {rate:12,.0f} /s", flush=True)

        columns(recordings.joint_states(folder / "warm.mcap", 100, JOINTS))
        for compression in ("zstd", "lz4", "none"):
            path = recordings.joint_states(folder / f"{compression}.mcap", messages, JOINTS, compression)
            add("ROS 2 CDR", compression, OURS, timed(lambda p=path: columns(p)))
            add("ROS 2 CDR", compression, "gsfdi, judged records", timed(lambda p=path: records(p)))
            add("ROS 2 CDR", compression, f"mcap {version('mcap')} + ros2", timed(lambda p=path: with_mcap(p)))
            add("ROS 2 CDR", compression, f"rosbags {version('rosbags')}", timed(lambda p=path: with_rosbags(p)))
            if compression != "none":
                add("ROS 2 CDR", compression, "decompression alone", unpacking(path, messages))
        path = recordings.protobuf_recording(folder / "pb.mcap", messages, JOINTS)
        add("Protobuf", "zstd", OURS, timed(lambda: columns(path)))
        add("Protobuf", "zstd", f"mcap + protobuf {version('protobuf')}", timed(lambda: with_protobuf(path)))
        text = recordings.json_recording(folder / "js.mcap", messages, JOINTS)
        add("JSON", "zstd", OURS, timed(lambda: columns(text)))
        add("JSON", "zstd", "mcap + json", timed(lambda: with_json(text)))
        store = store_rates(folder, folder / "zstd.mcap")
    ours = {(r["encoding"], r["compression"]): float(str(r["messages per s"])) for r in rows if r["reader"] == OURS}
    ratios = {
        f"{row['encoding']}, {row['compression']}: gsfdi / {row['reader']}": round(
            ours[row["encoding"], row["compression"]] / float(str(row["messages per s"])), 2
        )
        for row in rows
        if row["reader"] != OURS
    }
    RESULTS.write_text(
        json.dumps({"messages": messages, "rows": rows, "ratios": ratios, "store": store}, indent=1) + "\n"
    )
    print(json.dumps(ratios, indent=1), json.dumps(store, indent=1))


if __name__ == "__main__":
    main()
