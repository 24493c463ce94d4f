"""Parquet: canonical telemetry as it is, other tables by a mapping."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from gsfdi.canonical import filled, open_verified
from gsfdi.errors import UnusableInputError
from gsfdi.mapping import Mapping
from gsfdi.readers import Reader
from gsfdi.types import Problem
from gsfdi.wire import Item
from gsfdi.wire.tables import Plan, columns_of, is_canonical, plans, read_as

ROWS = 65_536
"""Rows held at a time."""
MOST_RATIO, MOST_FREE = 5_000, 512 << 20
"""A file may unpack to this many times its size, and this many bytes on top."""


def sniff(head: bytes) -> bool:
    """Whether these are the first bytes of a Parquet file."""
    return head[:4] == b"PAR1"


def read(path: Path, mappings: Sequence[Mapping]) -> Iterator[Item]:
    """Yield the table block by block, page checksums verified.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    """
    file, _ = open_verified(path)
    with file:
        chosen = _plans(path, file, mappings)
        wanted = list(dict.fromkeys(column for plan in chosen for column in plan.columns))
        unpacked = 8 * file.metadata.num_rows * len(wanted)
        if unpacked > MOST_RATIO * path.stat().st_size + MOST_FREE:
            what = f"would unpack to {unpacked >> 20} MB, more than its size can honestly hold"
            raise UnusableInputError(path, what, "leave the file out")
        try:
            for batch in _blocks(file, wanted):
                for plan in chosen:
                    yield from columns_of(batch, plan, str(path))
        except (pa.ArrowException, OSError, ValueError) as error:
            yield Problem(str(path), f"is damaged: {error}; what was read before stands", "fetch the file again")


def _blocks(file: pq.ParquetFile, columns: list[str]) -> Iterator[pa.RecordBatch]:
    """The table in blocks; a row group at a time, since a walk over all of them would keep their bytes to its end."""
    for group in range(file.num_row_groups):
        yield from file.iter_batches(batch_size=ROWS, row_groups=[group], columns=columns, use_threads=False)


def describe(path: Path, mappings: Sequence[Mapping]) -> dict[str, object]:
    """Say what the table holds and how it would be read.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    """
    file, sealed = open_verified(path)
    with file:
        return {
            "format": "parquet",
            "integrity": "verified by its seal" if sealed else "page checksums where the writer made them",
            "rows": file.metadata.num_rows,
            "columns": [f"{field.name}: {field.type}" for field in file.schema_arrow],
            "read_as": [read_as(plan) for plan in _plans(path, file, mappings)],
        }


def _plans(path: Path, file: pq.ParquetFile, mappings: Sequence[Mapping]) -> list[Plan]:
    names = [str(name) for name in file.schema_arrow.names]
    if is_canonical(names):
        names = ["timestamp", "joint", *filled(file)]
    stated = (file.metadata.metadata or {}).get(b"gsfdi.robot", b"").decode("utf-8", "replace")
    return plans(path, names, mappings, stated)


READER = Reader("parquet", sniff, read, describe)
