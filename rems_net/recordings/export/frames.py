"""Frames of pandas and polars, and Parquet files. Each needs its library."""

import importlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.errors import ExperimentError
from rems_net.libraries import needed

#: libraries that have data frames
FRAMES = ("pandas", "polars")
#: a table, or some rows of one: heading to values (n,)
Block = Mapping[str, np.ndarray[Any, Any]]


def frame(table: Block, library: str) -> Any:
    """Return a table as a frame of pandas or polars. Raises MissingPartError."""
    if library not in FRAMES:
        raise ExperimentError(
            f"there are no frames of {library!r}; there is {' and '.join(FRAMES)}. "
            "(R0842)"
        )
    return _library(library, "frames").DataFrame(dict(table))


def parquet(blocks: Iterable[Block], path: Path) -> None:
    """Write a Parquet file, block by block; units are in the names of its columns.

    Raises MissingPartError without pyarrow.
    """
    arrow, module = (
        _library(name, "parquet") for name in ("pyarrow", "pyarrow.parquet")
    )
    writer: Any = None
    try:
        for block in blocks:
            table = arrow.table(dict(block))
            writer = writer or module.ParquetWriter(str(path), table.schema)
            writer.write_table(table)
    finally:
        if writer is not None:
            writer.close()


def _library(name: str, extra: str) -> Any:
    with needed(name.partition(".")[0], extra):
        return importlib.import_module(name)
