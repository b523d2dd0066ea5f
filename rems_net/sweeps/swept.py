"""Swept: the results of a sweep."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from rems_net.errors import UnknownFieldError
from rems_net.recordings.recording import Recording, read
from rems_net.recordings.table import Table
from rems_net.sweeps.store import PARQUET, Store
from rems_net.sweeps.table import Column, columns, table, written
from rems_net.sweeps.work import FAILED, Row, Run


class Swept:
    """Results of a sweep: a table, and a recording of each run.

    folder: where they are.  rows: of the runs that are over.
    """

    def __init__(
        self, folder: Path, runs: Sequence[Run], names: Sequence[str], some: list[str]
    ):
        self.folder = folder
        self.rows: Sequence[Row] = ()
        self._runs, self._names, self._some = runs, names, some

    def _columns(self) -> list[Column]:
        return columns(self._runs, self.rows, self._names, self._some)

    def csv(self) -> bytes:
        """Return the table as a CSV file: the same bytes however it was computed."""
        return written(self._columns())

    @cached_property
    def table(self) -> Table:
        """The table, by heading: `robot/sim.track [mm]` to an array, for pandas."""
        return table(self._columns())

    @property
    def failed(self) -> dict[int, str]:
        """The runs that failed, by number, each with its sentence."""
        return {row.number: row.error for row in self.rows if row.status == FAILED}

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, number: int) -> Recording:
        """Return the recording of a run. Raises UnknownFieldError."""
        path = Store(self.folder, len(self._runs)).folder(number)
        if not path.is_dir():
            raise UnknownFieldError(
                f"there is no run {number!r} in {self.folder}; there are {len(self)}, "
                "from 1. (R1026)"
            )
        return read(path)

    def frame(self, library: str = "pandas") -> Any:
        """Return the table as a frame of pandas or "polars".

        Raises MissingPartError without the library.
        """
        from rems_net.recordings.export.frames import frame

        return frame(self.table, library)

    def parquet(self, path: Path | str | None = None) -> Path:
        """Write the table as a Parquet file; return its path.

        Raises MissingPartError without pyarrow.
        """
        from rems_net.recordings.export.frames import parquet

        file = Path(path or self.folder / PARQUET)
        parquet([self.table], file)
        return file

    def __repr__(self) -> str:
        some = f", {len(self.failed)} failed" if self.failed else ""
        return f"<sweep in {self.folder}: {len(self)} of {len(self._runs)} runs{some}>"
