"""Outlet: publisher of one of an agent's Outs."""

from collections import deque
from collections.abc import Callable, Collection, Mapping
from functools import partial

from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.protocol.crowds import pack_crowd
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import pack_done
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict
from rems_net.packing import pack
from rems_net.router.keys import ALL, STEP
from rems_net.router.message import pack_stamp
from rems_net.router.publisher import Member, Publisher, Puts, Unseen
from rems_net.router.session import Session

#: Number of agents. Above it, a host publishes and answers for all of a kind at once:
#: of 30 robots, a page's server takes 3.5 % of a core so, and 5.4 % one by one.
CROWD = 16
#: Ticks. If more ticks wait here, one `done` is for as many as this: for half of what
#: the clock may be ahead, so that it sends the next ones before the last is done.
TOGETHER = AHEAD // 2
#: s. A `done` waits no longer than this for that of the next tick.
SOON = 0.02


class Done:
    """Publisher of `done`, for several ticks at once if more of them wait here."""

    def __init__(self, session: Session):
        self._session = session
        #: badge of this host, once the clock has admitted it
        self.badge = 0
        #: the newest tick that is done if the clock does not know it; else 0
        self.owed = 0
        self._said, self._at = 0, 0.0

    def open(self) -> None:
        """Declare the publisher."""
        key = self._session.key("clock", STEP, "done")
        self._put = self._session.putting(key)

    def note(self, n: int) -> None:
        """Note that tick `n` is done; `settle` before this host waits."""
        self.owed = n
        if n - self._said >= TOGETHER or wall() - self._at > SOON:
            self.say(n)

    def settle(self) -> None:
        """Send what the clock does not know yet."""
        if self.owed:
            self.say(self.owed)

    def say(self, n: int) -> None:
        """Send that tick `n` is done, and so all before."""
        self._said, self._at, self.owed = n, wall(), 0
        self._put(pack_done(self.badge, n))


class Outlet:
    """Publisher of one port of one agent. Unwanted values cost no encoding."""

    __slots__ = (
        "_declare",
        "agent",
        "badge",
        "closing",
        "digest",
        "key",
        "members",
        "n",
        "packed",
        "port",
        "publisher",
        "recent",
        "run",
        "wanted",
    )

    def __init__(
        self,
        agent: Agent,
        port: str,
        key: str,
        publisher: Puts,
        declare: Callable[[], Callable[..., None]],
    ):
        self.agent, self.port, self.key = agent, port, key
        self.run = runtime(agent)
        #: for programs that look
        self.publisher = publisher
        #: Puts values for lock-step members in other hosts; None until there is one.
        self.members: Callable[..., None] | None = None
        self._declare = declare
        self.digest = agent.__dict__[port].schema.digest
        #: whether a reader in lock-step in another host takes it at its own key
        self.wanted = False
        #: whether all of these take it together with those of its crowd
        self.packed = False
        #: whether its value also means `done`, so that the clock receives it each tick
        self.closing = False
        #: the newest tick of which it has a value
        self.n = 0
        #: this host's badge, once it is admitted
        self.badge = 0
        #: the last payloads: a reader may be AHEAD ticks behind, plus one
        self.recent: deque[tuple[int, bytes, bytes]] = deque(maxlen=AHEAD + 2)

    def publish(self, stamp: bytes, *, wanted: bool) -> None:
        """Put the value of tick `self.n`. wanted: at its own key for members, too."""
        payload = self.agent.__dict__[self.port].encode()
        self.recent.append((self.n, payload, stamp))
        if wanted:
            if self.members is None:
                self.members = self._declare()
            self.members(payload, attachment=stamp)
        # The clock receives a closing value from `members`, if that message exists.
        if self.publisher.watched or (self.closing and not wanted):
            self.publisher.put_raw(payload, attachment=stamp)

    def want(self, wanted: bool, packed: bool) -> None:
        """Note whether another host reads it, from the next tick on.

        A new reader may need the value of the tick before: it is kept now.
        """
        if (wanted or packed) and not (self.wanted or self.packed) and self.n:
            stamp = self.stamp(self.n, self.run.tick.t)
            self.recent.append((self.n, self.value.encode(), stamp))
        self.wanted, self.packed = wanted, packed
        if wanted and self.members is None:
            self.members = self._declare()

    def stamp(self, n: int, t: float) -> bytes:
        """Return the stamp that is attached to the value of tick `n`."""
        return pack_stamp(n, t, self.badge, self.run.source_tick)

    @property
    def value(self) -> DefDict:
        value: DefDict = self.agent.__dict__[self.port]
        return value


def outlets_of(agents: Mapping[str, Agent], session: Session) -> list[Outlet]:
    """Return the outlets of these agents: one each, or a common one for a crowd."""
    many = len(agents) > CROWD
    crowds: dict[str, Publisher] = {}
    made = []
    for agent in agents.values():
        for port, schema in agent.published().items():
            key = session.key(agent.key, port)
            encoding = f"{schema.name}@{schema.digest}"
            # An In must not receive its own value as that of a program outside.
            away = not session.near or port in agent.ins()
            # Values for programs that look may be lost; those for members may not.
            show = partial(session.putting, key, encoding, block=False, remote=away)
            step = session.key(agent.key, STEP, port)
            send = partial(
                session.putting,
                step,
                encoding,
                block=runtime(agent).in_step,
                remote=not session.near,
            )
            publisher: Puts
            if not many:
                publisher = session.publisher(key, encoding, block=False, remote=away)
            elif port in agent.ins():
                publisher = Unseen()
            else:
                whole = glob(key)
                if whole not in crowds:
                    crowds[whole] = session.publisher(whole, block=False, remote=away)
                publisher = Member(crowds[whole], show)
            made.append(Outlet(agent, port, key, publisher, send))
    return made


class Crowd:
    """One port of many agents in one message: all those that have stepped.

    It is for programs that look, and for members whose Ins read all of a kind.
    key, encoding: of the message.  declare: makes the publisher for members.
    """

    def __init__(
        self,
        key: str,
        encoding: str,
        outlets: list[Outlet],
        publisher: Publisher | Unseen,
        declare: Callable[[], Callable[..., None]],
    ):
        self.publisher, self._declare = publisher, declare
        self.kind = outlets[0].agent.kind
        self._put: Callable[..., None] | None = None
        self.key, self.encoding = key, encoding
        self._members = [(pack(o.agent.name), o) for o in outlets]
        #: the last messages for members, with their stamps: a reader may miss one
        self.recent: deque[tuple[int, bytes, bytes]] = deque(maxlen=AHEAD + 2)

    def publish(self, n: int, stamp: bytes) -> None:
        """Put the values of tick `n`, if a member or another program wants them.

        Those with an older source tick go to members at their own keys.
        """
        message = b""
        due = [one for one in self._members if one[1].n == n]
        fresh = [o for o in due if o[1].packed and o[1].run.source_tick == n]
        if fresh:
            message = _packed(fresh)
            self.recent.append((n, message, stamp))
            self._put = self._put or self._declare()
            self._put(message, attachment=stamp)
        if due and self.publisher.watched:
            if len(fresh) < len(due):
                message = _packed(due)
            self.publisher.put_raw(message, attachment=stamp)


def _packed(members: list[tuple[bytes, Outlet]]) -> bytes:
    return pack_crowd([n + o.agent.__dict__[o.port].encode() for n, o in members])


def crowds_of(outlets: list[Outlet], session: Session) -> list[Crowd]:
    """Return the crowds of a host, by kind, port and schema: `robot/@crowd/state`."""
    alike: dict[tuple[str, str, str], list[Outlet]] = {}
    for outlet in outlets:
        if not isinstance(outlet.publisher, Publisher):
            encoding = f"{outlet.value.schema.name}@{outlet.digest}"
            of = outlet.agent.kind, outlet.port, encoding
            alike.setdefault(of, []).append(outlet)
    made = []
    away = not session.near
    for (kind, port, encoding), some in alike.items():
        key, step = (session.key(kind, chunk, port) for chunk in (ALL, STEP))
        send = partial(session.putting, step, encoding, remote=away)
        publisher: Publisher | Unseen = Unseen()
        if isinstance(some[0].publisher, Member):
            publisher = session.publisher(key, encoding, block=False, remote=away)
        made.append(Crowd(key, encoding, some, publisher, send))
    return made


def glob(key: str) -> str:
    """Return the key of a port for all agents of the kind: `rems/robot/*/state`."""
    fabric, kind, _, *rest = key.split("/")
    return "/".join((fabric, kind, "*", *rest))


def closing_of(agents: Collection[Agent], outlets: list[Outlet]) -> Outlet | None:
    """Return the last value of every tick of a host with one agent, if there is one.

    This value also means `done`, which saves a message per tick; it is put as the last
    of its tick. It is a state if there is one, which most programs want. An output in
    the same host would not be done yet: the run could end before its row.
    """
    steady = [o for o in outlets if o.run.every == 1 and o.run.in_step]
    if len(agents) != 1 or not steady:
        return None
    closing = next((o for o in steady if o.port == "state"), steady[-1])
    closing.closing = True
    return closing


class Outlets:
    """All ports of one host, with their publishers."""

    def __init__(self, agents: Mapping[str, Agent], session: Session):
        self.all = outlets_of(agents, session)
        self.crowds = crowds_of(self.all, session)
        #: the port whose value ends every tick of this host
        self.closing = closing_of(agents.values(), self.all)
        self._kinds: dict[str, list[Outlet]] = {}
        self._badge = 0

    def begin(self, badge: int) -> None:
        """Publish with this badge: the clock has admitted the host."""
        self._badge = badge
        for outlet in self.all:
            outlet.badge = badge
            # Programs that watch already must miss no tick; the answer came later.
            outlet.publisher.look()
        for crowd in self.crowds:
            crowd.publisher.look()

    def connect(self, roster: Roster, host: str) -> set[str]:
        """Publish for the members of this roster; return the ports they wait for."""
        self._kinds = {kind: [] for kind in PHASES}
        read = roster.read_outside(host)
        alone = roster.read_outside(host, all_at_once=False) if self.crowds else read
        for outlet in self.all:
            if outlet.agent.key in roster.agents:
                self._kinds[outlet.agent.kind].append(outlet)
            key = f"{outlet.agent.key}/{outlet.port}"
            packed = key in read and key not in alone and outlet.run.in_step
            outlet.want(key in read and not packed, packed)
        for some in self._kinds.values():
            some.sort(key=lambda outlet: outlet.closing)
        return read

    def publish(self, kind: str, tick: Tick) -> None:
        """Put the new values of the agents of a kind, if they are read or watched."""
        n, stamp = tick.n, b""
        for outlet in self._kinds[kind]:
            run = outlet.run
            if n % run.every:
                continue
            outlet.n = n
            fresh = run.source_tick == n
            wanted = outlet.wanted or (outlet.packed and not fresh)
            if wanted or outlet.publisher.watched or outlet.closing:
                stamp = stamp or pack_stamp(n, tick.t, self._badge)
                own = stamp if fresh else outlet.stamp(n, tick.t)
                outlet.publish(own, wanted=wanted)
        for crowd in self.crowds:
            if crowd.kind == kind:
                crowd.publish(n, stamp or pack_stamp(n, tick.t, self._badge))

    def forget(self) -> None:
        """Forget the values of a clock that is gone."""
        for outlet in self.all:
            outlet.n = 0
            outlet.recent.clear()
        for crowd in self.crowds:
            crowd.recent.clear()
