"""Messages of a clock and its hosts: each with its writer and a checking reader.

Each `read_...` raises WireError for anything else. `docs/time.md` has them in a table.
"""

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple

from rems_net.agents.about.wiring import Entry
from rems_net.agents.protocol import limits
from rems_net.agents.protocol.badge import RUNS
from rems_net.agents.protocol.roster import entry_from_plain, entry_to_plain
from rems_net.agents.protocol.shapes import (
    digest,
    fields,
    flag,
    host_name,
    items,
    real,
    shown,
    table,
    text,
    whole,
    wrong,
)
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import perform
from rems_net.errors import WireError
from rems_net.router.mail import Question
from rems_net.router.message import BADGES, LAST_TICK, pack, read

SLOWEST, FASTEST = limits.PACES


class Beat(NamedTuple):
    """A tick of a run, and the count of STOPs and releases: odd means stopped."""

    run: int
    tick: Tick
    stops: int


def pack_beat(run: int, tick: Tick, stops: int) -> bytes:
    """Return `[run, n, t, dt, pace, epoch, stops]`, packed."""
    return pack((run, tick.n, tick.t, tick.dt, tick.pace, tick.epoch, stops))


def read_beat(payload: bytes) -> Beat:
    """Read a tick, in one condition: this runs thousands of times a second."""
    words = read(payload)
    if type(words) is list and len(words) == 7:
        run, n, t, dt, pace, epoch, stops = words
        if (
            type(run) is type(n) is type(epoch) is type(stops) is int
            and type(t) is type(dt) is type(pace) is float
            and 0 < run < RUNS
            and 0 < n <= LAST_TICK
            and 0.0 < dt < 1e9
            and 0.0 < t < 1e18
            and (pace == 0.0 or SLOWEST <= pace <= FASTEST)
            and 0 <= epoch <= LAST_TICK
            and 0 <= stops <= LAST_TICK
        ):
            return Beat(run, Tick(n, t, dt, pace, epoch), stops)
    raise WireError(
        f"it is {words!r:.80}; expected a tick: [run, n, t, dt, pace, epoch, stops]."
        " (R0621)"
    )


def pack_done(badge: int, n: int) -> bytes:
    """Return `[badge, n]`, packed: this member has done tick n and all before."""
    return pack((badge, n))


def read_done(payload: bytes) -> tuple[int, int]:
    """Read a done."""
    words = read(payload)
    if type(words) is not list or len(words) != 2:
        raise WireError(f"it is {words!r:.80}; expected a done: [badge, n]. (R0621)")
    return whole(words[0], "its badge", 1, BADGES), whole(words[1], "its tick")


#: the payload at `rems/stop`
STOP = pack(True)


def read_stop(payload: bytes) -> None:
    """Read a STOP: it is `true`, and no other payload is."""
    word = read(payload)
    if word is not True:
        raise wrong("it", word, "true, which stops; `rems stop --release` lets go on")


class Request(NamedTuple):
    """Request of a host to the clock: to be admitted, with these agents.

    closing: the port (`robot/sim/state`) whose value ends every tick; "" for none
    schemas: digest to canonical description, of every Out
    stopped: whether it has received STOP
    ticket: the number that the run gave it at its start; 0 on another machine
    numerics: the libraries and processor that it computes with; "" if not known
    """

    host: str
    machine: str
    pid: int
    closing: str
    agents: Sequence[Entry]
    schemas: Mapping[str, bytes]
    stopped: bool = False
    ticket: int = 0
    numerics: str = ""

    def to_wire(self) -> bytes:
        plain = self._asdict() | {"agents": [entry_to_plain(e) for e in self.agents]}
        return pack(plain)


def read_request(payload: bytes) -> Request:
    """Read a host's request."""
    told = read(payload)
    numerics = told.pop("numerics", "") if type(told) is dict else ""
    plain = fields(told, "a host that joins", *Request._fields[:-1])
    host = host_name(plain["host"], "its host")
    agents = [
        entry_from_plain(e) for e in items(plain["agents"], "its agents", limits.AGENTS)
    ]
    if not agents:
        raise wrong("its agents", [], "one or more")
    for entry in agents:
        if entry.host != host:
            raise wrong(f"the host of {entry.key}", entry.host, f"{host!r}, its own")
        if entry.badge:
            raise wrong(f"the badge of {entry.key}", entry.badge, "0, before it joins")
    keys = {entry.key for entry in agents}
    if len(keys) < len(agents):
        raise wrong("its agents", sorted(e.key for e in agents), "each of them once")
    schemas = table(plain["schemas"], "its schemas", limits.AGENTS * 3)
    for key, wire in schemas.items():
        digest(key, "a schema's digest")
        if type(wire) is not bytes or len(wire) > limits.SCHEMA:
            raise wrong(f"schema {key}", wire, f"at most {limits.SCHEMA} bytes")
    for entry in agents:
        if missing := sorted(set(entry.outs.values()) - schemas.keys()):
            raise wrong("its schemas", sorted(schemas), f"{missing[0]} of {entry.key}")
    written = {f"{e.key}/{port}" for e in agents for port in e.outs}
    closing = text(plain["closing"], "closing", limits.SOURCE)
    if closing and closing not in written:
        raise wrong("closing", closing, "a port of its own, such as 'robot/sim/state'")
    return Request(
        host,
        text(plain["machine"], "its machine", limits.NAME),
        whole(plain["pid"], "its pid"),
        closing,
        agents,
        schemas,
        flag(plain["stopped"], "stopped"),
        whole(plain["ticket"], "its ticket", 0, BADGES),
        text(numerics, "its numerics", limits.NUMERICS),
    )


class Admission(NamedTuple):
    """The clock's answer to a host that is admitted.

    first: the first tick that it receives       dt: seconds of a tick
    patience: seconds for which either may be out of the other's sight: `wait.back`
    """

    badge: int
    first: int
    dt: float
    stops: int
    patience: float


def read_admission(payload: bytes) -> Admission:
    """Read the clock's answer."""
    plain = fields(read(payload), "the clock's answer", *Admission._fields)
    return Admission(
        whole(plain["badge"], "its badge", 1, BADGES),
        whole(plain["first"], "its first tick", 1),
        real(plain["dt"], "its dt", 1e-9, 1e9),
        whole(plain["stops"], "stops"),
        real(plain["patience"], "its patience", 0.0, 1e9),
    )


class Farewell(NamedTuple):
    """Last message of a host: files its outputs have made; how it failed, if it did.

    badge: the host's; the ticket of a host that was never admitted
    """

    badge: int
    made: Sequence[str]
    #: the agent and the cause
    failed: tuple[str, str] | None

    def to_wire(self) -> bytes:
        return pack(self._asdict())


def read_farewell(payload: bytes) -> Farewell:
    """Read a host's last message."""
    plain = fields(read(payload), "a host that leaves", *Farewell._fields)
    failed = plain["failed"]
    if failed is not None:
        if len(items(failed, "failed", 2)) < 2:
            raise wrong("failed", failed, "an agent and a cause")
        failed = (
            shown(failed[0], "the agent that failed", limits.SOURCE),
            shown(failed[1], "the cause", limits.CAUSE),
        )
    made = items(plain["made"], "made", limits.FILES)
    return Farewell(
        whole(plain["badge"], "its badge", 1, BADGES),
        [shown(path, "a file that was made", limits.PATH) for path in made],
        failed,
    )


class Age(NamedTuple):
    """Age of a tick, as the clock of `run` answers it."""

    run: int
    seconds: float
    stops: int


def pack_age(run: int, seconds: float, stops: int) -> bytes:
    """Return `[run, seconds, stops]`, packed; infinite if the tick is not known."""
    return pack((run, seconds, stops))


def read_age(payload: bytes) -> Age:
    """Read the age of a tick."""
    words = read(payload)
    if type(words) is not list or len(words) != 3:
        raise WireError(
            f"it is {words!r:.80}; expected an age: [run, s, stops]. (R0621)"
        )
    run, seconds, stops = words
    if type(seconds) is not float or not seconds >= 0:
        raise wrong("its age", seconds, "seconds")
    return Age(
        whole(run, "its run", 1, RUNS),
        seconds if isfinite(seconds) else float("inf"),
        whole(stops, "stops"),
    )


class Claim(NamedTuple):
    """Request for the lease of a robot; sent again to keep it.

    badge: in the stamps of the commands.
    holder: its name; "" gives the lease back. To take a robot back from a
    run: 1, and the name of the person.
    """

    badge: int
    holder: str


def read_claim(payload: bytes) -> Claim:
    """Read a request for a lease."""
    words = read(payload)
    if type(words) is not list or len(words) != 2:
        raise WireError(
            f"it is {words!r:.80}; expected a claim: [badge, holder]. (R0621)"
        )
    badge, holder = words
    return Claim(
        whole(badge, "its badge", 1, BADGES - 1),
        text(holder, "its holder", limits.HOLDER),
    )


def read_badge(payload: bytes) -> int:
    """Read the badge of a host that asks whether it is still a member."""
    return whole(read(payload), "its badge", 1, BADGES)


def answer_call(
    question: Question, key: str, verbs: Mapping[str, Callable[..., Any]]
) -> None:
    """Call the verb at `key`, and answer; an error goes to the caller."""
    try:
        payload = question.payload
    except WireError as error:
        question.answer(key, pack({"error": str(error)}))
        return
    question.answer(key, perform(verbs, key.rpartition("/")[2], payload))
