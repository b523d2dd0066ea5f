"""CsvOutput: one CSV file per robot or world, one row per tick."""

import csv
import errno
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.agents.agent import Output
from rems_net.agents.ports import In
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Field
from rems_net.errors import AgentError
from rems_net.pictures import is_picture
from rems_net.recordings.csv_file import heading, recorded, shielded

#: In this order; what else a robot writes follows.
PORTS = ("command", "state", "sensors")


class CsvOutput(Output):
    """Writes `<robot>.csv` for every robot it reads, all of them unless told.

    What lies about in a world goes to `world.<name>.csv`, where anything does.

    A row is stamped at the end of its step and is in the file when the tick is done,
    so a run that is killed leaves whole rows. Numbers are written such that reading
    them gives the same bits. Started again after a crash, it goes on in its files.
    What cameras see is left out: an output of type pictures keeps it.
    """

    robots = In(source="robot/*/*")
    worlds = In(source="world/*/*")

    def open(self) -> None:
        """Have no file yet: what to write is known at the first tick."""
        self._files: dict[str, _File] = {}

    def write(self, tick: Tick) -> None:
        """Add one row to each file."""
        for name, ports in self._by_file().items():
            if name not in self._files:
                path = self.out / f"{name}.csv"
                again = bool(self.restarts)
                self._files[name] = _File(path, self.key, ports, again)
            self._files[name].add(tick.t, ports)

    def _by_file(self) -> dict[str, dict[str, DefDict]]:
        found: dict[str, dict[str, DefDict]] = {}
        both: Any = self.robots, self.worlds
        for values in both:
            for key, value in values.items():
                kind, name, port = key.split("/")
                name = recorded(name, kind)
                found.setdefault(name, {})[port] = value
        return {name: dict(sorted(p.items(), key=_order)) for name, p in found.items()}

    def close(self) -> None:
        """Close the files."""
        for file in self._files.values():
            file.close()

    def made(self) -> list[Path]:
        """The files: robots in the order of their names, then worlds."""
        return [file.path for file in self._files.values()]


class _File:
    def __init__(self, path: Path, agent: str, ports: dict[str, DefDict], again: bool):
        self.path, self._agent = path, agent
        self._shape = _schemas(ports)
        there = path.is_file()
        if there and not again:  # no run left it, or it would have been moved
            raise AgentError(
                agent,
                f"{path} is there already, and is no file of an earlier run; move it, "
                "or give this run a folder of its own",
            )
        head = self._head(ports)
        try:
            # Unbuffered: a row goes to the system in one piece, or is taken back.
            self._file = path.open("r+b" if there else "wb", buffering=0)
            if there and self._file.readline() == head:
                self._file.seek(0, os.SEEK_END)
                return
        except OSError as error:
            raise self._failed(error) from None
        if there:
            raise AgentError(agent, f"{path} has other columns than before the crash")
        self._write(head)

    @staticmethod
    def _head(ports: dict[str, DefDict]) -> bytes:
        headings = [heading("time", "s")]
        for port, value in ports.items():
            for name, field in value.schema.rows():
                headings += _headings(f"{port}/{name}", field)
        return _line(headings)

    def add(self, time: float, ports: dict[str, DefDict]) -> None:
        if _schemas(ports) != self._shape:
            raise AgentError(
                self._agent,
                f"there are other ports than before while {self.path} is written",
            )
        cells = [repr(time)]
        for value in ports.values():
            for leaf in value.leaves():
                if type(leaf) is float:
                    cells.append(repr(leaf))
                else:
                    cells += _cells(leaf)
        self._write(_line(cells))

    def _write(self, line: bytes) -> None:
        try:
            written = self._file.write(line)
            if written != len(line):
                self._file.truncate(self._file.tell() - (written or 0))
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise self._failed(error) from None

    def _failed(self, error: OSError) -> AgentError:
        return AgentError(self._agent, f"cannot write {self.path}: {error.strerror}")

    def close(self) -> None:
        self._file.close()


def _order(item: tuple[str, object]) -> tuple[int, str]:
    port = item[0]
    return (PORTS.index(port) if port in PORTS else len(PORTS), port)


def _schemas(ports: dict[str, DefDict]) -> dict[str, str]:
    return {port: value.schema.digest for port, value in ports.items()}


def _headings(name: str, field: Field) -> Iterator[str]:
    unit = {"bool": "bool", "float": field.unit, "int": field.unit}.get(
        field.dtype, "text"
    )
    if not field.shape:
        yield heading(name, unit)
        return
    if is_picture(field):
        return
    for index in np.ndindex(field.shape):
        yield heading(name + "".join(f"[{i}]" for i in index), field.unit)


def _cells(leaf: Any) -> list[str]:
    """A leaf that is no float: int, bool, text, bytes, array or list."""
    if isinstance(leaf, np.ndarray):
        if is_picture(leaf):
            return []
        return [repr(x) for x in (leaf * 1).ravel().tolist()]
    if isinstance(leaf, bytes):
        return [leaf.hex()]
    if isinstance(leaf, tuple):
        return ["; ".join(repr(item) for item in leaf)]
    return [shielded(leaf) if isinstance(leaf, str) else str(leaf)]


def _line(cells: list[str]) -> bytes:
    """One line; a cell is quoted where it has to be."""
    line = ",".join(cells)
    if line.count(",") != len(cells) - 1 or '"' in line or "\n" in line or "\r" in line:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(cells)
        return text.getvalue().encode()
    return f"{line}\n".encode()
