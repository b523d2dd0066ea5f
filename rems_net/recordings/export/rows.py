"""Rows of agents in an MCAP file, tick by tick, in the memory of one chunk."""

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

from rems_net.defdict import Field, cdr
from rems_net.recordings.export.lines import headings, order
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.span import Span


class Rows:
    """The rows of one agent: what stands above them, and its values at each tick.

    fields: name and field of each value, in the order of the columns.
    """

    def __init__(self, file: McapFile, agent: str) -> None:
        keys = [key for key in file.channels if key.rpartition("/")[0] == agent]
        self.agent, self._span = agent, Span(file, agent)
        self.fields: list[tuple[str, Field]] = []
        self._ports: dict[str, tuple[Any, list[int], int]] = {}
        self._values: list[Any] = []
        for key in sorted(keys, key=lambda key: order(key.rpartition("/")[2])):
            schema, port = file.schemas[key], key.rpartition("/")[2]
            paths = file.ordered(key)
            places = [schema.paths.index(path) for path in paths]
            codec = cdr(schema)
            self._ports[key] = codec.decode, places, len(self.fields)
            self.fields += [(f"{port}/{p}", schema.fields[i]) for p, i in zip(
                paths, places, strict=True)]  # fmt: skip
            before = file.told.initial(key, schema)
            start = codec.decode(codec.encode(before)).leaves()
            self._values += [start[i] for i in places]

    @property
    def keys(self) -> list[str]:
        """Those of its ports."""
        return [*self._ports]

    def headings(self) -> list[str]:
        """Return the headings of a CSV file."""
        named = [h for name, one in self.fields for h in headings(name, one)]
        return ["time [s]", *named]

    def take(self, n: int, messages: Mapping[str, bytes]) -> bool:
        """Take the messages of tick n; return whether this tick has a row."""
        for key, (decode, places, at) in self._ports.items():
            if key in messages:
                self._span.written(n)
                leaves = decode(messages[key]).leaves()
                self._values[at : at + len(places)] = [leaves[i] for i in places]
        return self._span.has(n)

    def values(self) -> Sequence[Any]:
        """Return the newest values."""
        return self._values


def rows(file: McapFile, agents: Sequence[Rows]) -> Iterator[tuple[Rows, float]]:
    """Yield agents with the times [s] of their rows; each has its values then."""
    p, q = Fraction(repr(file.told.dt)).as_integer_ratio()
    before = 0

    def quiet(until: int) -> Iterator[tuple[Rows, float]]:
        """Yield those of ticks without a message of these agents."""
        for m in range(before + 1, until if p else 0):
            yield from ((a, m * p / q) for a in agents if a.take(m, {}))

    for n, time, messages in file.moments(*[key for one in agents for key in one.keys]):
        yield from quiet(n)
        before = n
        for one in agents:
            if one.take(n, messages):
                yield one, n * p / q if p else time / 1e9
    yield from quiet(file.last + 1)
