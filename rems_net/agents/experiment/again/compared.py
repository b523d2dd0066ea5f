"""Compared: each recorded message beside the recomputed one, byte by byte."""

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from rems_net.agents.agent import PHASES
from rems_net.agents.experiment.again.rebuilt import Rebuilt
from rems_net.agents.experiment.direct import check_direct
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.agents.experiment.solo import Solo
from rems_net.agents.ports import Messages
from rems_net.agents.protocol.plan import Plan, grouped
from rems_net.agents.tick import Tick
from rems_net.defdict import cdr
from rems_net.recordings.comparison import Pair, Trajectory, compare as compared
from rems_net.recordings.mcap.derived import has_pose
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.writer import FILE

#: stands for a value in a tick in which a port has none
NOTHING = "no value"
#: fields of a pose
POSE = ("x", "y", "heading")
#: stands for a value in such a tick
SOME = "a value"


@dataclass
class Difference:
    """One field of a port that differs.

    path: "" for a whole message.  tick: the first that differs.  was, now: the values
    in it, recorded and recomputed.  unit: of both.  most: greatest difference; None
    for what is no number.  ticks: how many differ.
    """

    key: str
    path: str
    unit: str
    tick: int
    was: object
    now: object
    most: float | None = None
    ticks: int = 0

    @property
    def agent(self) -> str:
        """The key of its agent."""
        return self.key.rpartition("/")[0]

    @property
    def order(self) -> tuple[int, int, str]:
        """Its place: by the first tick, then by phase and key."""
        kind = self.key.partition("/")[0]
        place = PHASES.index(kind) if kind in PHASES else len(PHASES)
        return self.tick, place, self.key


@dataclass
class Compared:
    """The result of a rerun.

    messages: how many were compared.  differ: how many of them differ.  last: tick.
    agents: keys of all agents, each with `recomputed`, `played` or `not recorded`.
    """

    messages: int = 0
    differ: int = 0
    last: int = 0
    agents: dict[str, str] = field(default_factory=dict)
    found: dict[tuple[str, str], Difference] = field(default_factory=dict)
    #: by robot with a pose that differs, how far apart, from its first difference on
    pairs: dict[str, Pair] = field(default_factory=dict)

    def by_agent(self) -> list[tuple[str, list[Difference]]]:
        """Return agents with their differences, in the order in which they begin."""
        ordered = sorted(self.found.values(), key=lambda one: one.order)
        return [*grouped((one.agent, one) for one in ordered).items()]


class Comparison:
    """Takes the messages of each tick, and compares them with those of a file."""

    def __init__(self, file: McapFile, played: Container[str]) -> None:
        self.result = Compared()
        self._codecs = {key: cdr(one) for key, one in file.schemas.items()}
        #: what is played has a value at each tick; devices have one now and then
        self._sparse = {k for k in self._codecs if k.rpartition("/")[0] in played}
        self._posed = {k for k, one in file.schemas.items() if has_pose(k, one)}
        #: by key of a state: time [s], recorded and recomputed poses
        self._poses: dict[str, list[tuple[float, ...]]] = {}
        self._dt = file.told.dt
        self._recorded = file.ticks()
        self._next = next(self._recorded, None)

    def _until(self, n: float) -> None:
        """Compare the recorded messages before tick n, which were not recomputed."""
        while self._next is not None and self._next[0] < n:
            self._compare(*self._next, {})
            self._next = next(self._recorded, None)

    def add(self, n: int, messages: Mapping[str, bytes]) -> None:
        """Compare the messages of tick n."""
        self._until(n)
        recorded: Mapping[str, bytes] = {}
        if self._next is not None and self._next[0] == n:
            recorded = self._next[1]
            self._next = next(self._recorded, None)
        self._compare(n, recorded, messages)

    def end(self) -> Compared:
        """Compare what is left in the file."""
        self._until(inf)
        for key, rows in self._poses.items():
            time, *poses = np.array(rows).T
            both = Trajectory("recorded", time, *poses[:3]), Trajectory(
                "now", time, *poses[3:])  # fmt: skip
            self.result.pairs[key.rpartition("/")[0]] = compared(both)[0]
        return self.result

    def _compare(
        self, n: int, recorded: Mapping[str, bytes], messages: Mapping[str, bytes]
    ) -> None:
        self.result.last = n
        due = messages.keys() & self._codecs.keys() - self._sparse
        for key in sorted(recorded.keys() | due):
            was, now = recorded.get(key), messages.get(key)
            self.result.messages += 1
            if was == now:
                continue
            self.result.differ += 1
            if was is None or now is None:
                pair = (NOTHING, SOME) if was is None else (SOME, NOTHING)
                self._note(n, key, "", "", *pair)
                continue
            self._note_fields(n, key, was, now)

    def _note_fields(self, n: int, key: str, was: bytes, now: bytes) -> None:
        codec, some = self._codecs[key], False
        old, new = codec.decode(was).leaves(), codec.decode(now).leaves()
        if key in self._posed:
            pose = [codec.decode(one)[path] for one in (was, now) for path in POSE]
            self._poses.setdefault(key, []).append((n * self._dt, *pose))
        for (path, one), a, b in zip(codec.schema.rows(), old, new, strict=True):
            if not one.shape:
                if repr(a) != repr(b):
                    some = True
                    self._note(n, key, path, one.unit, a, b)
            elif (differs := _differs(a, b)).any():
                some = True
                first = tuple(int(i) for i in np.argwhere(differs)[0])
                shown = path + "".join(f"[{i}]" for i in first)
                most = float(np.abs(np.subtract(a, b, dtype=float)).max())
                about = a[first].item(), b[first].item()
                self._note(n, key, path, one.unit, *about, most=most, shown=shown)
        if not some:  # such as another NaN
            self._note(n, key, "", "", was.hex(), now.hex())

    def _note(
        self,
        n: int,
        key: str,
        path: str,
        unit: str,
        was: Any,
        now: Any,
        most: float | None = None,
        shown: str = "",
    ) -> None:
        one = self.result.found.get((key, path))
        if one is None:
            one = Difference(key, shown or path, unit, n, was, now)
            self.result.found[key, path] = one
        numbers = not isinstance(was, bool)
        if most is None and numbers and isinstance(was, int | float):
            most = abs(was - now)
        if most is not None:
            one.most = max(one.most or 0.0, most)
        one.ticks += 1


def _differs(a: Any, b: Any) -> Any:
    """Return where two arrays differ, to the bit, as an array of the same shape."""
    raw = f"V{a.dtype.itemsize}"
    old, new = np.ascontiguousarray(a), np.ascontiguousarray(b)
    return old.view(raw).reshape(a.shape) != new.view(raw).reshape(b.shape)


def compare(rebuilt: Rebuilt, *, fabric: bool = False) -> Compared:
    """Do the experiment until the last recorded tick, and compare all messages.

    fabric: with each agent in a process of its own, as `rems run`; otherwise all are
    stepped in this process. Raises ExperimentError for what cannot be done, AgentError
    for an agent that fails.
    """
    agents, lab, recorder = rebuilt.check(), rebuilt.lab, rebuilt.recorder
    comparison = Comparison(rebuilt.file, rebuilt.played)
    if not fabric:
        check_direct(lab.plans, agents)
        recorder = _comparing(recorder, comparison)
    lab.plans[recorder.key] = recorder
    try:
        if fabric:
            _run(lab, comparison)
        else:
            with Solo(lab, Path(), rebuilt.last) as engine:
                engine.run()
    finally:
        del lab.plans[recorder.key]
    result = comparison.end()
    result.agents = dict(_verdicts(rebuilt, agents))
    return result


def _run(lab: Experiment, comparison: Comparison) -> None:
    """Run it on a fabric, and compare its recording."""
    with TemporaryDirectory() as folder:
        lab.run(Path(folder) / "again", show=Show())
        for n, messages in McapFile(Path(folder) / "again" / FILE).ticks():
            comparison.add(n, messages)


def _verdicts(rebuilt: Rebuilt, agents: Iterable[str]) -> Iterator[tuple[str, str]]:
    recorded = {key.rpartition("/")[0] for key in rebuilt.file.channels}
    for key in sorted({*agents, *rebuilt.played}):
        if key in rebuilt.played:
            yield key, "played"
        else:
            yield key, "recomputed" if key in recorded else "not recorded"


def _comparing(recorder: Plan, comparison: Comparison) -> Plan:
    """Return the plan of an output that has the Ins of a recorder, and compares."""

    def write(self: Any, tick: Tick) -> None:
        messages: dict[str, bytes] = {}
        for port in self.ins():
            some: Messages = self.__dict__[port]
            some.spread()
            messages |= some
            some.clear()
        comparison.add(tick.n, messages)

    def nothing(self: Any) -> list[Any]:
        return []

    slots = {"write": write, "open": nothing, "close": nothing, "made": nothing}
    cls = type("Recomputed", (recorder.classes[0],), slots)
    return replace(recorder, classes=[cls])
