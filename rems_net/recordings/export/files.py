"""Exported files: CSV with the bytes that an output of type csv writes, or Parquet."""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from rems_net.errors import ExperimentError
from rems_net.recordings.export.frames import parquet
from rems_net.recordings.export.lines import cells, line
from rems_net.recordings.export.rows import Rows, rows

if TYPE_CHECKING:
    from rems_net.recordings.recording import Recording

#: kinds of files
KINDS = ("csv", "parquet")
#: rows of a file that are in memory at a time
BLOCK = 10_000
#: agents of one pass through a file; each has a file open
TOGETHER = 200


def export(
    recording: "Recording", names: Sequence[str], folder: Path, to: str
) -> list[Path]:
    """Write one file for each of these agents. Returns their paths.

    Raises ExperimentError, also for a file that cannot be written.
    """
    if to not in KINDS:
        raise ExperimentError(
            f"there are no files of kind {to!r}; there is {', '.join(KINDS)}. (R0842)"
        )
    made = {name: folder / f"{name.replace('/', '.')}.{to}" for name in names}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if to == "parquet":
            for name, path in made.items():
                parquet(recording.blocks(name, BLOCK), path)
        else:
            _csv(recording, made)
    except OSError as error:
        raise ExperimentError(
            f"cannot write into {folder}: {error.strerror}. (R0905)"
        ) from None
    return [*made.values()]


def _csv(recording: "Recording", made: dict[str, Path]) -> None:
    """Write CSV files. One pass through an MCAP file serves many of them."""
    inside: dict[Path, dict[str, str]] = {}
    for name, path in made.items():
        source, agent = recording.source(name)
        if agent:
            inside.setdefault(source, {})[agent] = name
        elif recording.like is None:
            path.write_bytes(source.read_bytes())
        else:
            _write_table(recording, name, path)
    for source, agents in inside.items():
        file, every = recording.mcap(source), [*agents]
        for i in range(0, len(every), TOGETHER):
            with ExitStack() as stack:
                some = [Rows(file, agent) for agent in every[i : i + TOGETHER]]
                files: dict[str, IO[bytes]] = {}
                for one in some:
                    path = made[agents[one.agent]]
                    files[one.agent] = stack.enter_context(path.open("wb"))
                    files[one.agent].write(line(one.headings()))
                for one, time in rows(file, some):
                    row = [repr(time), *(c for v in one.values() for c in cells(v))]
                    files[one.agent].write(line(row))


def _write_table(recording: "Recording", name: str, path: Path) -> None:
    table = recording.table(name)
    with path.open("wb") as file:
        file.write(line([*table]))
        for row in zip(*(np.asarray(v).tolist() for v in table.values()), strict=True):
            file.write(line([c for value in row for c in cells(value)]))
