"""Paths in, `Batch` out: which files, which reader, and what of their content may be believed."""

from gsfdi.ingest.reading import read, stream
from gsfdi.ingest.sources import describe, gather
from gsfdi.ingest.summary import summary
from gsfdi.mapping import load_mapping

__all__ = ["describe", "gather", "load_mapping", "read", "stream", "summary"]
