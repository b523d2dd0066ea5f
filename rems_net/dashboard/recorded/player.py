"""Player: the place of one page in a recording, and its next values."""

from collections.abc import Set
from math import isfinite
from typing import Any, NamedTuple

from rems_net.agents.protocol.limits import PACES
from rems_net.dashboard.protocol import Value
from rems_net.dashboard.recorded.run import RecordedRun, Track
from rems_net.dashboard.recorded.runs import RecordedRuns
from rems_net.errors import WireError

#: s. A page looks back so far at most, as its plots do.
PAST = 600.0
#: s. Length of a trail, and its points at most.
TRAIL, POINTS = 20.0, 400
#: values of plots that a page receives at once, and while a hand drags the time
MOST, DRAGGED = 20_000, 2_000
#: ticks. A shorter way ahead is played, not jumped.
NEAR = 5
#: events that a page shows
EVENTS = 200
#: ports that are plotted at once
PORTS = 64


class Wish(NamedTuple):
    """A page's request to play; None: as before.

    t: s, a jump there.  past: s of plots before it.  ports: plotted ones, in full.
    """

    playing: bool | None = None
    pace: float | None = None
    t: float | None = None
    past: float | None = None
    ports: frozenset[str] | None = None
    dragged: bool = False

    def then(self, later: "Wish") -> "Wish":
        """Return both together; the later one counts."""
        new = {word: one for word, one in later._asdict().items() if one is not None}
        if later.t is None:
            new["dragged"] = self.dragged
        return self._replace(**new)


def read_wish(message: dict[str, Any]) -> Wish:
    """Read what a page asks its player for. Raises WireError."""
    given = message["play"]
    if not isinstance(given, dict) or not given.keys() <= set(Wish._fields):
        raise WireError(f"A page plays by {', '.join(Wish._fields)}. (R1003)")
    for word in ("playing", "dragged"):
        if type(given.get(word, False)) is not bool:
            raise WireError(f"{word} is {given[word]!r:.40}; expected a bool. (R1003)")
    for word, low, high in (("pace", *PACES), ("t", 0, 1e9), ("past", 0, PAST)):
        value = given.get(word, low)
        number = type(value) in (int, float) and isfinite(value)
        if not number or not low <= value <= high:
            raise WireError(
                f"{word} is {value!r:.40}; expected {low:g} to {high:g}. (R1003)"
            )
    ports = given.get("ports")
    if ports is not None:
        if not isinstance(ports, list) or len(ports) > PORTS:
            raise WireError(f"A page plots a list of at most {PORTS} ports. (R1003)")
        ports = frozenset(map(str, ports))
    return Wish(**{**given, "ports": ports})


class Frame(NamedTuple):
    """The next message to a page: a text, and the values of channels."""

    text: dict[str, Any]
    values: list[tuple[int, Value]]


class Player:
    """The place of one page in a recording. It begins at the beginning, paused.

    One thread at a time. Raises ExperimentError for a part of a file that is damaged.
    """

    def __init__(self, recorded: RecordedRuns) -> None:
        self._recorded = recorded
        #: s
        self.t = recorded.begin
        self._n = -1
        self.playing, self.pace = False, 1.0
        self._past, self._ports = TRAIL, frozenset[str]()
        #: whether the past of its plots is thin, from a hand that dragged the time
        self._coarse = False
        self._looks: Set[str] = frozenset()
        self._shown: list[tuple[RecordedRun, Track]] = []

    def frame(self, passed: float, wish: Wish, looks: Set[str]) -> Frame:
        """Return what has changed.

        passed: s of wall time since the last call.  looks: as of a live page.
        """
        recorded, text = self._recorded, dict[str, Any]()
        was = self.playing, self.pace
        there = self._move(passed, wish)
        near = 0 <= recorded.number(there) - self._n <= NEAR
        jumps = self._n < 0 or (wish.t is not None and not near)
        if wish.t is not None:
            jumps |= self._coarse and not wish.dragged
            self._coarse = wish.dragged
        if wish.ports is not None and wish.ports != self._ports:
            self._ports = wish.ports
            jumps = True  # for their past
        if wish.past is not None:
            jumps |= wish.past > self._past
            self._past = wish.past
        before, self.t = self._n, there
        self._n = n = recorded.number(there)
        values = self._met(looks, before)
        if jumps:
            values = self._past_values(n, DRAGGED if wish.dragged else MOST)
            text["rewind"] = True
        elif n != before:
            values += self._values(before, n)
        if jumps or n != before:
            values.append(recorded.tick(n, self.pace))
            after = -1 if jumps else recorded.until(before)
            if found := recorded.runs[0].events(recorded.until(n), after, EVENTS):
                text["events"] = found
        if jumps or was != (self.playing, self.pace):
            text["playback"] = {"playing": self.playing, "pace": self.pace}
        return Frame(text, values)

    def _move(self, passed: float, wish: Wish) -> float:
        """Return the time of the next frame [s]."""
        recorded = self._recorded
        self.pace = self.pace if wish.pace is None else wish.pace
        there = self.t if wish.t is None else wish.t
        if wish.playing is not None:
            self.playing = wish.playing
            if self.playing and wish.t is None and there >= recorded.end:
                self._n, there = -1, recorded.begin  # once more
        elif self.playing and wish.t is None:
            there += passed * self.pace
        if there >= recorded.end:
            self.playing = False
        return min(max(there, recorded.begin), recorded.end)

    def _met(self, looks: Set[str], n: int) -> list[tuple[int, Value]]:
        """Return the values at tick n of ports that are shown from now on."""
        looks = looks | self._ports
        if looks == self._looks and self._shown:
            return []
        old = {track.channel.id for _, track in self._shown}
        self._looks, self._shown = looks, self._recorded.shown(looks)
        until = self._recorded.until(n)
        new = (pair for pair in self._shown if pair[1].channel.id not in old)
        return [
            (track.channel.id, value)
            for run, track in new
            for value in run.newest(track, until)
        ]

    def _values(self, before: int, n: int) -> list[tuple[int, Value]]:
        """Return the newest values of ticks before < n' <= n; all of plotted ports."""
        recorded, found = self._recorded, []
        after, until = recorded.until(before), recorded.until(n)
        thin = MOST // max(1, len(self._ports))
        for run, track in self._shown:
            if track.channel.key in self._ports:
                values = run.values(track, until, after, thin=thin)
            else:
                values = run.newest(track, until, after)
            found += [(track.channel.id, value) for value in values]
        return found

    def _past_values(self, n: int, most: int) -> list[tuple[int, Value]]:
        """Return the values at tick n, with the past that trails and plots show."""
        recorded, found = self._recorded, []
        until, robots = recorded.until(n), 0
        for run, track in self._shown:
            key, past, thin = track.channel.key, 0.0, 1
            if key in self._ports:
                past, thin = self._past, most // len(self._ports)
            elif track.port == "state" and robots < most // POINTS:
                past, thin, robots = TRAIL, POINTS, robots + 1
            values = run.newest(track, until)
            if past:
                after = until - round(past * 1e9)
                values = run.values(track, until, after, thin=thin) or values
            found += [(track.channel.id, value) for value in values]
        return found
