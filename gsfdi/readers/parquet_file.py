"""Parquet: canonical telemetry as it is, other tables by a mapping."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from gsfdi.canonical import filled, open_verified
from gsfdi.errors import UnusableInputError
from gsfdi.mapping import Mapping
from gsfdi.readers import Reader
from gsfdi.seal import digests
from gsfdi.types import Problem
from gsfdi.wire import Item
from gsfdi.wire.tables import Plan, columns_of, is_canonical, plans, read_as

VALUES = 1 << 20
"""Values of all columns that are held at a time: a whole row group of our own files, few rows of a wide table."""
MOST_RATIO, MOST_FREE = 5_000, 512 << 20
"""A file may unpack to this many times its size, and this many bytes on top."""


def sniff(head: bytes) -> bool:
    """Whether these are the first bytes of a Parquet file."""
    return head[:4] == b"PAR1"


def read(path: Path, mappings: Sequence[Mapping], whole: bool | None) -> Iterator[Item]:
    """Yield the table block by block, page checksums verified.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    whole : bool or None
        Whether the file's seal holds (`gsfdi.seal`); None without one.
    """
    with open_verified(path, whole) as file:
        chosen = _plans(path, file, mappings)
        wanted = list(dict.fromkeys(column for plan in chosen for column in plan.columns))
        unpacked = 8 * file.metadata.num_rows * len(wanted)
        if unpacked > MOST_RATIO * path.stat().st_size + MOST_FREE:
            what = f"would unpack to {unpacked >> 20} MB, more than its size can honestly hold"
            raise UnusableInputError(path, what, "leave the file out")
        try:
            for batch in _blocks(file, wanted, bool(whole)):
                for plan in chosen:
                    yield from columns_of(batch, plan, str(path))
        except (pa.ArrowException, OSError, ValueError) as error:
            yield Problem(str(path), f"is damaged: {error}; what was read before stands", "fetch the file again")


def _blocks(file: pq.ParquetFile, columns: list[str], vouched: bool) -> Iterator[pa.RecordBatch]:
    """The table in blocks; a row group at a time, since a walk over all of them would keep their bytes to its end."""
    rows = max(VALUES // max(len(columns), 1), 1)
    for group in range(file.num_row_groups):
        alike = {name: _one_value(file, group, name) for name in columns if name == "joint" and vouched}
        known = {name: pa.repeat(value, 1) for name, value in alike.items() if value is not None}
        read = [name for name in columns if name not in known]
        for batch in file.iter_batches(batch_size=rows, row_groups=[group], columns=read, use_threads=False):
            for name, value in known.items():
                # All Arrow's own: what is given numpy's arrays looks for pandas, which is half a second to load.
                same = pa.DictionaryArray.from_arrays(pa.repeat(pa.scalar(0, pa.int32()), len(batch)), value)
                batch = batch.append_column(name, same)
            yield batch


def _one_value(file: pq.ParquetFile, group: int, name: str) -> str | None:
    """The text that all rows of a group hold, as its statistics say, which are believed where a seal vouches for them.

    Most groups speak of one joint, whose name need not be read a hundred thousand times.
    """
    at = file.schema_arrow.names.index(name)
    told = file.metadata.row_group(group).column(at).statistics
    if told is None or not told.has_min_max or told.null_count != 0 or told.min != told.max:
        return None
    return told.min if isinstance(told.min, str) else None


def describe(path: Path, mappings: Sequence[Mapping]) -> dict[str, object]:
    """Say what the table holds and how it would be read.

    Parameters
    ----------
    path : Path
    mappings : sequence of Mapping
    """
    whole = digests(path).whole
    with open_verified(path, whole) as file:
        return {
            "format": "parquet",
            "integrity": "verified by its seal" if whole else "page checksums where the writer made them",
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
