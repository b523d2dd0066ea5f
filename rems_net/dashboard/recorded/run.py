"""RecordedRun: a recording as the channels of a page, with values at any time."""

from collections.abc import Iterator
from itertools import count
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

from rems_net.dashboard.feed import Channel
from rems_net.dashboard.protocol import LARGEST, REPORT, Value, described
from rems_net.defdict import Schema, cdr
from rems_net.packing import pack
from rems_net.pictures import is_picture
from rems_net.recordings.mcap.access import Access, Message
from rems_net.recordings.mcap.log import INFO, WARN, read_log
from rems_net.recordings.mcap.reader import McapFile

#: channels of a page; its frames have two bytes for their numbers
MOST = 65_535
#: level of an event in the file -> its word on the page
LEVELS = {INFO: "info", WARN: "warning"}
#: bytes of a value; of longer ones a page receives fewer
USUAL = 200
#: schema of values whose size is shown in their place
LARGE = "large"


class Track(NamedTuple):
    """One recorded port: its channel on the page and in the file, and its schema."""

    channel: Channel
    #: key of its agent and name of its port, on the page
    agent: str
    port: str
    key: str
    schema: Schema


class RecordedRun:
    """One recording.

    first: number of its first channel.
    mark: stands behind the names of its robots, if it is shown beside another
    recording; then it has robots only.
    """

    def __init__(self, path: Path, first: int = 1, mark: str = "") -> None:
        self.file = McapFile(path)
        self.mark = mark
        #: s. Its first and last value.
        self.begin = min((one.start for one in self.file.chunks), default=0) / 1e9
        self.end = self.file.end
        self.tracks = [*self._tracks(first)]
        self._access = Access(self.file)

    def close(self) -> None:
        """Close the file."""
        self._access.close()

    def named(self, agent: str) -> str:
        """Return the key of an agent on the page."""
        return f"{agent} ({self.mark})" if self.mark else agent

    def _tracks(self, first: int) -> Iterator[Track]:
        numbers = count(first)
        for key, schema in self.file.schemas.items():
            agent, _, port = key.rpartition("/")
            if self.mark and not agent.startswith("robot/"):
                continue
            if (number := next(numbers)) >= MOST:
                return
            shown = self.named(agent)
            kind = LARGE if _is_large(schema) else schema.digest
            channel = Channel(number, f"{shown}/{port}", kind)
            yield Track(channel, shown, port, key, schema)

    def schemas(self) -> dict[str, list[dict[str, Any]]]:
        """Return the fields of all schemas, in the order of their definitions."""
        found: dict[str, list[dict[str, Any]]] = {}
        for track in self.tracks:
            if track.channel.schema not in (LARGE, *found):
                order = {path: i for i, path in enumerate(self.file.ordered(track.key))}
                rows = described(track.schema)
                rows.sort(key=lambda row: order[row["path"]])
                found[track.channel.schema] = rows
        return found

    def newest(self, track: Track, until: int, after: int = -1) -> list[Value]:
        """Return the newest value with after < time <= until [ns], if there is one."""
        return self.values(track, until, after, most=1)

    def values(
        self, track: Track, until: int, after: int, *, most: int = 0, thin: int = 0
    ) -> list[Value]:
        """Return the values with after < time <= until [ns], in the order of time.

        most: only the newest so many; 0 for all.
        thin: about so many of them, evenly, among them the newest, and fewer if they
        are longer than USUAL; 0 for all.
        """
        channel = self.file.channels[track.key]
        places = self._access.places(channel, until, after, most)
        if thin and len(places):
            size = len(self._access.read(channel, places[-1:])[0].data)
            step = ceil(len(places) / thin * max(1.0, size / USUAL))
            places = places[::-step][::-1]
        with self.file.readable():
            messages = self._access.read(channel, places)
            return [_value(track, one) for one in messages]

    def events(self, until: int, after: int, most: int) -> list[dict[str, Any]]:
        """Return the newest events with after < time <= until [ns], for a page."""
        if (channel := self.file.log) is None:
            return []
        places = self._access.places(channel, until, after, most)
        with self.file.readable():
            return [_event(one) for one in self._access.read(channel, places)]


def _value(track: Track, message: Message) -> Value:
    stamp = pack([message.n, message.time / 1e9])
    if track.channel.schema == LARGE:
        return stamp, pack({"bytes": len(message.data)})
    payload: bytes = cdr(track.schema).decode(message.data).encode()
    return stamp, payload


def _event(message: Message) -> dict[str, Any]:
    level, agent, text = read_log(message.data)
    told = {"level": LEVELS.get(level, "error"), "tick": message.n}
    return told | {"agent": agent[:128], "text": text[:REPORT]}


def _is_large(schema: Schema) -> bool:
    """Return whether its values are too large for a page, as pictures are."""
    layout = cdr(schema).layout
    size = layout.itemsize if layout is not None else 0
    return size > LARGEST or any(is_picture(one) for one in schema.fields)
