"""Sources of a host: values that come over the network, and its own free agents'."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from operator import itemgetter

from rems_net.agents.about.payloads import MANY, Later
from rems_net.agents.about.wiring import Entry, Written, names_all
from rems_net.agents.agent import Agent
from rems_net.agents.host.inbox import Inbox
from rems_net.agents.protocol.crowds import CrowdValues
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Schema
from rems_net.engine.engine import Engine
from rems_net.engine.inlet import Inlet
from rems_net.engine.recorded import MessageInlet
from rems_net.engine.source import Conversion, Gone, Source, Value
from rems_net.engine.visits import Visits
from rems_net.errors import RemsError
from rems_net.router.keys import STEP, crowd_key
from rems_net.router.mail import Mail
from rems_net.router.message import pack_stamp
from rems_net.router.session import Session

#: name, in messages, of a program that is no agent of the run
OUTSIDE = "a program outside the experiment"


def is_open(inlet: Inlet) -> bool:
    """Return whether programs outside can put values at the In's own key.

    That includes a robot's command that an agent writes: such values are refused.
    """
    return inlet.source is None or inlet.key == f"robot/{inlet.agent.name}/command"


def watched(inlet: Inlet, full: Callable[..., str]) -> set[str]:
    """Return the keys to subscribe to for an In. full: makes a key of its parts."""
    own = {full(inlet.key)} if is_open(inlet) else set()
    if inlet.source is None:
        return own
    kind, name, *port = inlet.source.split("/")
    written = [kind, name, *(port or "*")]
    if inlet.run.in_step:  # a free-running reader takes what comes
        written.insert(2, STEP)
        if names_all(inlet.source):
            own.add(full(kind, *written[2:]))
    return own | {full(*written)}


def open_outside(
    inlet: Inlet, full: Callable[..., str], inbox: Inbox, visits: Visits
) -> None:
    """Give an In its source of values that programs outside put at its own key."""
    if inlet.source is not None and is_open(inlet):
        inlet.steady = [Refused(inlet.key, inlet.source, inbox)]
    elif inlet.source is None and inlet.schema is not None:
        inlet.steady = [Outside(full(inlet.key), inlet, inlet.schema, inbox, visits)]
    inlet.sources = [*inlet.steady]


class Others:
    """The agents of a run that are not here in lock-step, for the engine."""

    def __init__(
        self, agents: Mapping[str, Agent], full: Callable[..., str], inbox: Inbox
    ):
        self._agents, self._full, self._inbox = agents, full, inbox
        #: by digest, as in the newest roster
        self.packed: Mapping[str, bytes] = {}
        self._schemas: dict[str, Schema] = {}

    def schema(self, digest: str) -> Schema:
        """Return the schema of this digest, unpacked once."""
        if digest not in self._schemas:
            self._schemas[digest] = Schema.from_wire(self.packed[digest])
        return self._schemas[digest]

    def source(self, inlet: Inlet, written: Written, converter: Conversion) -> Source:
        """Return the source of a port that another process or a free agent writes."""
        entry, key = written.entry, self._full(written.key)
        if (local := self._agents.get(entry.key)) is not None:
            return Beside(written, local, converter)
        if entry.lockstep and inlet.run.in_step:
            return Peer(written, key, converter, self._inbox, inlet.phase)
        first = inlet.run.in_step
        return Newest(written, key, converter, self._inbox, first=first)

    def together(self, sources: Sequence[Source]) -> list[Source]:
        """Return the sources; those whose payloads may come at once are one."""
        alike: dict[object, list[Peer]] = {}
        made: list[Source] = []
        for one in sources:
            if isinstance(one, Peer) and isinstance(one.converter, Later):
                alike.setdefault(one.alike(), []).append(one)
            else:
                made.append(one)
        cohorts: dict[object, Cohort] = {}
        for peers in alike.values():
            if len(peers) >= MANY:
                made.append(Together(peers, self._inbox))
            elif (rhythm := peers[0].rhythm()) in cohorts:
                cohorts[rhythm].peers += peers
            else:
                cohorts[rhythm] = Cohort(peers, self._inbox)
        return [*made, *cohorts.values()]


class Peer:
    """An agent of another process, in lock-step: each value by its tick."""

    def __init__(
        self,
        written: Written,
        key: str,
        converter: Conversion,
        inbox: Inbox,
        phase: int,
    ):
        self.key = self.label = written.key
        self.entry: Entry | None = written.entry
        self._writer, self._digest = written.entry, written.digest
        #: its key, with that of the fabric
        self.full = key
        self.converter, self._inbox = converter, inbox
        #: whether its reader reads the value of this tick
        self._earlier = written.entry.phase < phase
        #: tick of the value that the reader has
        self.have = 0

    def alike(self) -> object:
        """Return the same for all that one process writes at the same ticks."""
        return crowd_key(self.full)[0], self._writer.badge, self.rhythm()

    def rhythm(self) -> object:
        """Return the same for all of one schema that are due at the same ticks."""
        writer = self._writer
        return self._digest, self.have, self._earlier, writer.every, writer.since

    def due(self, tick: Tick) -> int:
        """Return the tick of the value to read; 0 if the reader has it."""
        due = self._writer.due(tick.n if self._earlier else tick.n - 1)
        return 0 if due == self.have else due

    def take(self, tick: Tick) -> Value | None:
        """Return the value that is due, waiting for it. Raises Gone."""
        due = self.due(tick)
        if not due:
            return None
        came = self._inbox.value(self.full, due, self._writer)
        if came is None:
            raise Gone
        self.have = due
        return self.converter.decode(came.payload), came.said

    def beside(self, due: int) -> CrowdValues | None:
        """Return the values in one message with its own of that tick, if there is one.

        due: 0 for none.
        """
        if not due or self._inbox.value(self.full, due, self._writer) is None:
            return None
        return self._inbox.membership.crowd(self.full, due)


class Cohort:
    """Agents of other processes, all of one schema, that are due at the same ticks."""

    key = label = ""
    entry: Entry | None = None

    def __init__(self, peers: list[Peer], inbox: Inbox):
        self.peers, self._inbox = peers, inbox
        converter = peers[0].converter
        assert isinstance(converter, Later)
        self._waiting = converter.waiting

    def take(self, tick: Tick) -> None:
        """Put aside the payloads that are due, waiting for those that are late."""
        due = self.peers[0].due(tick)
        if not due:
            return
        value, waiting = self._inbox.membership.value, self._waiting
        for one in self.peers:
            if one.have == due:
                continue
            if (came := value(one.full, due)) is None:
                with suppress(Gone):
                    one.take(tick)
            else:
                one.have = due
                waiting.keys.append(one.key)
                waiting.payloads.append(came.payload)


class Together(Cohort):
    """Those of one process, whose payloads can be taken from one message."""

    #: the places of their payloads in messages with `_where`, if all are there
    _places: Callable[[Sequence[bytes]], tuple[bytes, ...]] | None = None
    _where: Mapping[str, int] = {}

    @cached_property
    def _keys(self) -> list[str]:
        return [one.key for one in self.peers]

    def take(self, tick: Tick) -> None:
        """Put aside the payloads that are due."""
        due = self.peers[0].due(tick)
        some = self.peers[0].beside(due)
        if some is not None and some.where is not self._where:
            self._where = some.where
            places = [some.where.get(key.split("/")[1]) for key in self._keys]
            self._places = None if None in places else itemgetter(*places)
        if some is None or self._places is None:
            super().take(tick)
            return
        for one in self.peers:
            one.have = due
        self._waiting.add(self._keys, self._places(some.payloads))


class Newest:
    """An agent of another process, if it or its reader is free-running."""

    def __init__(
        self,
        written: Written,
        key: str,
        converter: Conversion,
        inbox: Inbox,
        *,
        first: bool,
    ):
        self.key = self.label = written.key
        self.entry: Entry | None = written.entry
        self._key, self._converter, self._inbox = key, converter, inbox
        self._have: Mail | None = None
        #: whether to ask for its first value: a robot begins at its `initial`, not at 0
        self._first = first

    def take(self, tick: Tick) -> Value | None:
        """Return the newest value, if it has not been read yet."""
        if self._first:
            self._first = False
            self._inbox.ask_first(self._key)
        newest = self._inbox.latest.get(self._key)
        if newest is None or newest[0] is self._have:
            return None
        self._have, stamp = newest
        value = self._converter.decode(self._have.payload)
        return value, min(stamp.said, tick.n - 1)


class Beside:
    """An agent of this process, if it or its reader is free-running."""

    def __init__(self, written: Written, agent: Agent, converter: Conversion):
        self.key = self.label = written.key
        self.entry: Entry | None = written.entry
        self._own, self._run = agent.__dict__, runtime(agent)
        self._port, self._converter = written.port, converter

    def take(self, tick: Tick) -> Value:
        """Return the agent's current value."""
        return self._converter(self._own[self._port]), self._run.source_tick


class Outside:
    """Programs outside the run, which put values at the In's own key."""

    key, label = "", OUTSIDE
    entry: Entry | None = None

    def __init__(
        self, key: str, inlet: Inlet, schema: Schema, inbox: Inbox, visits: Visits
    ):
        self._key, self._own, self._schema = key, inlet.key, schema
        self._inlet, self._inbox, self._visits = inlet, inbox, visits

    def take(self, tick: Tick) -> Value | None:
        """Return the value that was put since the last call."""
        came = self._inbox.given.pop(self._own, None)
        if came is None:
            return None
        mail, stamp = came
        # The sender may stamp it with the tick of the state that it answers to.
        source_tick = tick.n - 1 if stamp.n < 0 else min(stamp.said, tick.n - 1)
        value = self._decode(mail)
        self._visits.put(self._inlet, value, tick.n - 1, source_tick)
        return value, source_tick

    def _decode(self, mail: Mail) -> DefDict:
        name, at, digest = mail.schema.rpartition("@")
        if at and digest != self._schema.digest:
            raise RemsError(
                f"it is encoded as {name!r} with digest {digest}, and {self._key} "
                f"takes {self._schema.name}@{self._schema.digest}; send its own units, "
                "and the encoding 'application/msgpack'. (R0621)"
            )
        return self._schema.decode(mail.payload)


class Refused:
    """Programs outside that put a command for a robot that an agent commands."""

    key, label = "", OUTSIDE
    entry: Entry | None = None

    def __init__(self, own: str, source: str, inbox: Inbox):
        self._own, self._source, self._inbox = own, source, inbox

    def take(self, tick: Tick) -> None:
        """Raise RemsError if a program has put something."""
        if self._inbox.given.pop(self._own, None) is not None:
            raise RemsError(f"it is commanded by {self._source} alone. (R0619)")


class Called:
    """Calls from outside, sent to the processes whose outputs record."""

    def __init__(self, engine: Engine, session: Session, inbox: Inbox):
        self._session, self._visits = session, engine.visits
        #: badge of this host, once the clock has admitted it
        self.badge = 0
        engine.visits.send, inbox.hear_call = self._send, self._receive
        for inlet in engine.inlets:
            if isinstance(inlet, MessageInlet) and inlet.source is not None:
                kind, name = inlet.source.split("/")[:2]
                key = session.key(kind, name, "@event", "called")
                session.watch(key, inbox.box, remote=True)

    def _send(self, key: str, text: str) -> None:
        # Before the values of the next tick, in the order of which it comes.
        n, full = self._visits.n, self._session.key(key, "@event", "called")
        stamp = pack_stamp(n, 0.0, self.badge)
        self._session.put(full, text.encode(), stamp=stamp)

    def _receive(self, mail: Mail) -> None:
        _, kind, name, *_ = mail.key.split("/")
        text = mail.payload.decode(errors="replace")
        self._visits.receive(f"{kind}/{name}", text, mail.stamp().badge)
