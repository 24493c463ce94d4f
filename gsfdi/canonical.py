"""Canonical telemetry as Parquet: long form, units on every field, and a seal that any flipped bit breaks.

Pages carry checksums and are verified, but nothing in Parquet protects the footer, where types, counts and units
stand. A file written here therefore holds the SHA-256 of all its bytes, taken with the digest itself as zeros.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from gsfdi import seal
from gsfdi.atomic import aside
from gsfdi.channels import CHANNEL_OF_COLUMN, CHANNELS, Axis
from gsfdi.errors import UnusableInputError
from gsfdi.types import JointRecord

SCHEMA = "gsfdi/telemetry/1"
ROW_GROUP = 131_072
"""Rows read at a time: 22 minutes of 100 Hz."""


def to_table(records: Sequence[JointRecord], every_column: bool = False) -> pa.Table:
    """Lay records out in the contract's columns.

    Parameters
    ----------
    records : sequence of JointRecord
    every_column : bool
        Whether to name columns that no record fills.

    Returns
    -------
    pyarrow.Table
        One row per joint and sample, joint after joint, sorted by time within a joint.
    """
    columns = [name for name in CHANNEL_OF_COLUMN if every_column or any(_carries(each, name) for each in records)]
    fields = [
        pa.field(
            "timestamp", pa.timestamp("ns", tz="UTC"), metadata=_says("ns since 1970-01-01, UTC", "time of sampling")
        ),
        pa.field("joint", pa.string(), metadata=_says("", "name of the joint")),
    ]
    for column in columns:
        name, axis = CHANNEL_OF_COLUMN[column]
        channel = CHANNELS[name]
        fields.append(pa.field(column, pa.float64(), metadata=_says(channel.unit(axis or "rotary"), channel.meaning)))
    schema = pa.schema(fields)
    parts = []
    for record in records:
        stamps = record.t0_ns + np.round(record.t * 1e9).astype(np.int64)
        arrays = [
            pa.array(stamps).cast(schema.field(0).type),
            pa.array([record.joint]).take(pa.array(np.zeros(len(stamps), np.int32))),
        ]
        for column in columns:
            if _carries(record, column):
                values = record.channels[CHANNEL_OF_COLUMN[column][0]]
                arrays.append(pa.array(values, mask=np.isnan(values)))
            else:
                arrays.append(pa.nulls(len(stamps), pa.float64()))
        parts.append(pa.table(arrays, schema=schema))
    return pa.concat_tables(parts) if parts else schema.empty_table()


def write_parquet(
    path: Path, records: Sequence[JointRecord], notes: Mapping[str, str] | None = None, hive: bool = False
) -> None:
    """Write records of one robot as canonical telemetry, whole or not at all.

    Parameters
    ----------
    path : Path
    records : sequence of JointRecord
    notes : mapping of str to str, optional
        Further entries for the file's metadata.
    hive : bool
        The file goes among others under a folder ``joint=...``. Then it names every column, so that all files agree,
        and the joint's Arrow type, not its Parquet type, is a dictionary: pandas reads the folder's name as one and
        would refuse to merge it with a string.
    """
    table = to_table(records, every_column=hive)
    if hive:
        at = table.schema.get_field_index("joint")
        joint = pa.field("joint", pa.dictionary(pa.int32(), pa.string()), metadata=table.schema.field(at).metadata)
        table = table.set_column(at, joint, table.column(at).dictionary_encode())
    content = {
        "gsfdi.schema": SCHEMA,
        "gsfdi.robot": records[0].robot if records else "",
        "gsfdi.source": json.dumps(sorted({(record.source, record.sha256) for record in records})),
        "gsfdi.quality": json.dumps(
            {record.joint: {k: dict(v) for k, v in record.quality.items()} for record in records}
        ),
        **(notes or {}),
        seal.NAME.decode(): seal.BLANK.decode(),
    }
    numbers = [name for name in table.column_names if name != "joint"]
    with aside(path) as part:
        with pq.ParquetWriter(
            part,
            table.schema,
            compression="zstd",
            use_dictionary=False,
            column_encoding={name: "BYTE_STREAM_SPLIT" for name in numbers if name != "timestamp"}
            | {"timestamp": "DELTA_BINARY_PACKED", "joint": "PLAIN"},
            write_page_checksum=True,
        ) as writer:
            writer.write_table(table, row_group_size=ROW_GROUP)
            writer.add_key_value_metadata(content)
        seal.seal(part)


def open_verified(path: Path, whole: bool | None) -> pq.ParquetFile:
    """Open a Parquet file with page checksums verified, unless a seal vouches for every byte already.

    Parameters
    ----------
    path : Path
    whole : bool or None
        Whether the file's seal holds (`gsfdi.seal.digests`); None where it carries none.

    Returns
    -------
    pyarrow.parquet.ParquetFile

    Raises
    ------
    UnusableInputError
        The file is damaged or no Parquet file.
    """
    if whole is False:
        raise UnusableInputError(path, "is damaged: its SHA-256 is not the one sealed into it", "fetch the file again")
    try:
        file = pq.ParquetFile(path, page_checksum_verification=not whole, **_BOUNDS)
    except (pa.ArrowException, OSError, ValueError) as error:
        raise UnusableInputError(path, f"is not a whole Parquet file: {error}", "fetch the file again") from error
    stated = (file.metadata.metadata or {}).get(b"gsfdi.schema")
    if stated is not None and whole is None:
        raise UnusableInputError(path, "is damaged: its seal is gone", "fetch the file again")
    return file


_BOUNDS: dict[str, Any] = {"thrift_string_size_limit": 16 << 20, "thrift_container_size_limit": 1 << 20}


def _carries(record: JointRecord, column: str) -> bool:
    name, axis = CHANNEL_OF_COLUMN[column]
    return name in record.channels and axis in (None, record.axis)


def _says(unit: str, description: str) -> dict[str, str]:
    return {"unit": unit, "description": description}


def filled(file: pq.ParquetFile) -> list[str]:
    """Canonical columns of a file that hold anything, by its statistics.

    Parameters
    ----------
    file : pyarrow.parquet.ParquetFile
    """
    names = []
    for at, name in enumerate(file.schema_arrow.names):
        groups = [file.metadata.row_group(i).column(at) for i in range(file.metadata.num_row_groups)]
        empty = all(
            group.statistics is not None
            and group.statistics.has_null_count
            and group.statistics.null_count == group.num_values
            for group in groups
        )
        if name in CHANNEL_OF_COLUMN and not empty:
            names.append(name)
    return names


def axis_of(columns: Sequence[str]) -> Axis:
    """Kind of joint whose canonical columns these are; rotary where they leave it open."""
    return "linear" if any(CHANNEL_OF_COLUMN.get(column, ("", None))[1] == "linear" for column in columns) else "rotary"
