"""CsvOutput: one CSV file per robot or world, one row per tick."""

import errno
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rems_net.agents.agent import Output
from rems_net.agents.ports import In
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Schema
from rems_net.errors import AgentError
from rems_net.outputs.refused import failed, taken
from rems_net.recordings.csv_file import heading, recorded
from rems_net.recordings.export.lines import cells, headings, line, order
from rems_net.recordings.manifest import Manifest, read_manifest


class CsvOutput(Output):
    """Writes `<robot>.csv` for every robot it reads, by default all of them.

    Things that lie about in a world go to `world.<name>.csv`, if there are any. If it
    reads an input or a process, their files are `input.<name>.csv` and so on.

    A row is stamped at the end of its step and is in the file when the tick is done,
    so a run that is killed leaves whole rows. Numbers are written such that reading
    them gives the same bits. Started again after a crash, it goes on in its files.
    Pictures of cameras are left out: an output of type pictures keeps them.
    """

    robots = In(source="robot/*/*")
    worlds = In(source="world/*/*")

    def open(self) -> None:
        """Have no file yet: what to write is known at the first tick."""
        self._files: dict[str, _File] = {}
        self._keys: list[str] = []
        self._plan: list[tuple[_File, list[str]]] = []
        #: by port: the tick of its first value, and what holds before
        self._initial: dict[str, tuple[int, DefDict]] = {}

    def write(self, tick: Tick) -> None:
        """Add one row to each file."""
        values: Any = {**self.robots, **self.worlds}
        if self._keys != [*values]:
            self._keys, self._plan = [*values], self._planned(values)
            self._begin(values)
        for key, (first, value) in [*self._initial.items()]:
            if tick.n < first:
                values[key] = value
            else:
                del self._initial[key]
        for file, keys in self._plan:
            file.add(tick.t, [values[key] for key in keys])

    def _begin(self, values: dict[str, DefDict]) -> None:
        """Find the initial values of robots that do not step at every tick."""
        about = read_manifest(self.out) or Manifest()
        for key, value in values.items():
            first = about.first(key.rpartition("/")[0], runtime(self).dt)
            if first > 1:
                self._initial[key] = first, about.initial(key, value.schema)

    def _planned(self, values: dict[str, DefDict]) -> list[tuple["_File", list[str]]]:
        """Return each file, with the keys of its columns in their order."""
        found: dict[str, dict[str, str]] = {}
        for key in values:
            agent, _, port = key.rpartition("/")
            found.setdefault(recorded(agent), {})[port] = key
        plan = []
        for name, by_port in found.items():
            ports = dict(sorted(by_port.items(), key=lambda item: order(item[0])))
            shape = {port: values[key].schema for port, key in ports.items()}
            if name not in self._files:
                path, again = self.out / f"{name}.csv", bool(self.restarts)
                self._files[name] = _File(path, self.key, shape, again)
            self._files[name].check(shape)
            plan.append((self._files[name], [*ports.values()]))
        return plan

    def close(self) -> None:
        """Close the files."""
        for file in self._files.values():
            file.close()

    def expected(self, ports: Mapping[str, Schema]) -> list[str]:
        """Return the files."""
        names = dict.fromkeys(recorded(key.rpartition("/")[0]) for key in ports)
        return [f"{name}.csv" for name in names]

    def made(self) -> list[Path]:
        """Return the files: robots in the order of their names, then worlds."""
        return [file.path for file in self._files.values()]


class _File:
    def __init__(self, path: Path, agent: str, ports: dict[str, Schema], again: bool):
        self.path, self._agent = path, agent
        self._shape = {port: schema.digest for port, schema in ports.items()}
        there = path.is_file()
        if there and not again:
            raise taken(agent, path)
        head = self._head(ports)
        try:
            # Unbuffered: a row goes to the system in one piece, or is taken back.
            self._file = path.open("r+b" if there else "wb", buffering=0)
            if there and self._file.readline() == head:
                self._file.seek(0, os.SEEK_END)
                return
        except OSError as error:
            raise failed(self._agent, self.path, error) from None
        if there:
            raise AgentError(
                agent,
                f"{path} has other columns than before the crash; give this run "
                "a folder of its own: rems run --out (R0801)",
            )
        self._write(head)

    @staticmethod
    def _head(ports: dict[str, Schema]) -> bytes:
        row = [heading("time", "s")]
        for port, schema in ports.items():
            for name, field in schema.rows():
                row += headings(f"{port}/{name}", field)
        return line(row)

    def check(self, ports: dict[str, Schema]) -> None:
        """Raise AgentError for other columns than those of the file."""
        if {port: schema.digest for port, schema in ports.items()} != self._shape:
            raise AgentError(
                self._agent,
                f"{self.path} has the columns of the ports at the start, and there "
                "are other ports now; end the run, and start it again "
                "(R0801)",
            )

    def add(self, time: float, values: list[DefDict]) -> None:
        leaves = [time]
        for value in values:
            leaves += value.leaves()
        if {*map(type, leaves)} == {float}:  # as for most robots
            self._write(f"{','.join(map(repr, leaves))}\n".encode())
            return
        self._write(line([cell for leaf in leaves for cell in cells(leaf)]))

    def _write(self, row: bytes) -> None:
        try:
            written = self._file.write(row)
            if written != len(row):
                self._file.truncate(self._file.tell() - (written or 0))
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise failed(self._agent, self.path, error) from None

    def close(self) -> None:
        self._file.close()
