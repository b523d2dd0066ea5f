"""Client of a running fabric: it waits only for the agents that it has asked.

Any program may keep a question open or answer it with nonsense. So a question for a key
with one owner ends with the first readable answer. A question for a glob ends when
every agent that is there has answered. Presence shows which agents are there; a second
question shows that they have answered, since a host reads it after the first.
"""

import time
from collections import Counter
from collections.abc import Callable
from threading import Event
from typing import Any, Generic, TypeVar

from rems_net.agents.agent import PHASES
from rems_net.agents.verbs import request
from rems_net.client.answers import NONSENSE, read_result, read_rows, read_schemas
from rems_net.client.commands import Commands
from rems_net.errors import FabricError, RemsError, nearest, some
from rems_net.events import warn
from rems_net.router.asking import Asking, Refusal, meets, printable
from rems_net.router.gate.identity import check_member, identity
from rems_net.router.keys import agent_of, is_name
from rems_net.router.mail import Mail
from rems_net.router.session import DOUBT, Session

T = TypeVar("T")

#: the reason if there is no answer
NOBODY = "no experiment runs there. Start one with `rems run` or `rems demo --pace 1`"
#: count, s. Repeats of a question that did not find its agent.
TRIES = 5
PAUSE = 0.05
#: s. Usually a question ends by itself within this time.
HELD = 0.1
#: s. A glob ends after this silence of the agents that are awaited.
SILENCE = 0.5
#: s. Longest time for an agent that is there to answer.
BUSY = 3.0
#: keys at which a clock answers
CLOCK = (("clock", "roster"), ("clock", "tick"))
#: s. Longest time for a verb.
ANSWER_TIMEOUT = 10.0


class UnansweredError(FabricError):
    """A question ended without an answer and without a refusal."""


class Gathered(Generic[T]):
    """The readable answers to one question.

    read: returns the value of an answer; raises one of NONSENSE if it is malformed.
    """

    def __init__(self, read: Callable[[Mail], T]):
        self._read = read
        self.values: dict[str, T] = {}
        self.refusal = ""
        #: why answers were ignored, and how many
        self.dropped: Counter[str] = Counter()

    def take(self, asking: Asking, until: float) -> Mail | None:
        """Return the next readable answer; None if there is none in time."""
        while (came := asking.next(until)) is not None:
            if (mail := self.hear(came)) is not None:
                return mail
            if self.refusal:  # any program can refuse; the answer may only be slower
                until = min(until, time.monotonic() + DOUBT)
        return None

    def hear(self, came: Mail | Refusal) -> Mail | None:
        """Store one answer; return None if it is ignored."""
        if isinstance(came, Refusal):
            self.refusal = self.refusal or came
            return None
        try:
            if came.key in self.values:
                raise FabricError("there is an answer already")
            self.values[came.key] = self._read(came)
            return came
        except NONSENSE as error:
            why = str(error) if isinstance(error, RemsError) else "it is no answer"
            self.dropped[printable(f"{came.key}: {why}")] += 1
        return None


class Client:
    """Client of the agents on one session's fabric."""

    def __init__(self, session: Session):
        self.session = session
        self.commands = Commands(self)

    def ask(
        self,
        key: str,
        read: Callable[[Mail], T],
        nothing: str = "",
        payload: bytes | None = None,
        patience: float = BUSY,
    ) -> T:
        """Return the first answer of a key's owner; `nothing`: the reason for none.

        Raises UnansweredError if there is none, naming the agents that are there;
        FabricError with the sentence of a refusal, or if the owner is silent for
        `patience` seconds.
        """
        clock = key.startswith("clock/")
        agent = "clock" if clock else "/".join(key.split("/")[:2])
        selector = self.session.key(key)
        until = time.monotonic() + patience
        for again in range(TRIES):
            if again:  # right after a reconnect Zenoh may find no agent
                Event().wait(PAUSE)
            gathered = Gathered(read)
            with self.session.asking(selector, payload, patience) as asking:
                came = gathered.take(asking, min(until, time.monotonic() + HELD))
                if came is None and not asking.ended and self.is_there(agent):
                    doubt = time.monotonic() + DOUBT
                    came = gathered.take(asking, doubt if gathered.refusal else until)
                ended = asking.ended and not asking.timed_out
            self._tell_dropped(gathered, asking)
            if came is not None:
                return gathered.values[came.key]
            if gathered.refusal:
                raise FabricError(f"{agent}: {gathered.refusal}")
            if not ended and self.is_there(agent):
                raise FabricError(
                    f"At {self.session.link.endpoint}: {agent} is there, and has not "
                    f"answered for {patience:g} s; it is busy, frozen or cut off."
                    " (R0602)"
                )
        if "/@call/" in key:
            # A router with users drops a guest's forbidden questions.
            check_member(self.session)
        raise self._nobody(agent, nothing)

    def call(self, key: str, verb: str, args: tuple[Any, ...], kwargs: Any) -> Any:
        """Call a verb of an agent by value. Raises AgentError with the verb's error."""
        returned = self.ask(
            f"{key}/@call/{verb}",
            lambda mail: read_result(mail, key),
            f"{key} does not answer",
            request(args, kwargs),
            BUSY if key == "clock" else ANSWER_TIMEOUT,
        )
        if isinstance(returned, RemsError):
            raise returned
        if key.startswith("robot/"):
            self.commands.tell_if_stopped(key)
        return returned

    def every(self, glob: str, read: Callable[[Mail], T]) -> dict[str, T]:
        """Return the answers at a full key or glob of the agents that are there."""
        gathered = Gathered(read)
        bare = glob.partition("?")[0]
        one = "*" not in bare
        with self.session.asking(glob, None, ANSWER_TIMEOUT) as asking:
            until = time.monotonic() + HELD
            while gathered.take(asking, until) is not None:
                if one:
                    break
            if not asking.ended and not (one and gathered.values):
                self._wait(bare, asking, gathered)
        self._tell_dropped(gathered, asking)
        return gathered.values

    def alive(self) -> list[str]:
        """Return the agents that are present, such as `robot/sim`."""
        return self._present("*", "*")

    def _present(self, *chunks: str) -> list[str]:
        """Return the present agents whose keys match."""
        tokens = self.session.who(self.session.key(*chunks, "@alive"))
        seen = {agent_of(token) for token in tokens}
        crowds = {agent for agent in seen if agent.endswith("/*")}
        if crowds:  # the clock knows the agents of a host with many
            seen.update(a for a in self._members() if f"{a.split('/')[0]}/*" in crowds)
        own = self.session.key(*chunks)
        return sorted(
            agent
            for agent in seen
            for kind, _, name in [agent.partition("/")]
            if kind in PHASES and is_name(name) and meets(own, self.session.key(agent))
        )

    def _members(self) -> list[str]:
        """Return the agents of the roster; none if no clock answers."""
        roster = self.session.key("clock", "roster?format=json")
        gathered = Gathered(read_rows)
        with self.session.asking(roster, None, BUSY) as asking:
            mail = gathered.take(asking, time.monotonic() + BUSY)
        rows = gathered.values[mail.key] if mail else []
        return [row["agent"] for row in rows]

    def _wait(self, glob: str, asking: Asking, gathered: Gathered[Any]) -> None:
        """Wait for the awaited agents, while some program keeps the question open."""
        missing = self._met(glob)
        chunks = glob.split("/")[:3]
        agents = "/".join(chunks) if "**" not in chunks else self.session.key("*", "*")
        heard = Gathered(read_schemas)
        with self.session.asking(f"{agents}/@schema", None, ANSWER_TIMEOUT) as second:
            last = time.monotonic()
            limit = last + ANSWER_TIMEOUT
            while missing and (now := time.monotonic()) < min(last + SILENCE, limit):
                before = len(gathered.values), len(missing)
                for came in second.come():
                    if (mail := heard.hear(came)) is not None:
                        missing.discard(agent_of(mail.key))
                # Read these after the second: an agent answers the first question
                # first.
                for came in asking.come():
                    gathered.hear(came)
                keys = (self.session.key(*said) for said in CLOCK)
                if {k for k in keys if meets(glob, k)} <= gathered.values.keys():
                    missing.discard("clock")
                if before != (len(gathered.values), len(missing)):
                    last = now
                Event().wait(PAUSE / 10)
        if missing:
            who = some(sorted(missing), 5)
            text = f"{who} did not answer for {SILENCE:g} s; busy, frozen or cut off."
            warn("silent", text)

    def _met(self, glob: str) -> set[str]:
        """Return the agents that a glob matches, and the clock if it does."""
        key = self.session.key
        found = {a for a in self.alive() if meets(glob, key(a, "**"))}
        if any(meets(glob, key(*said)) for said in CLOCK) and self.is_there("clock"):
            found.add("clock")
        return found

    def is_there(self, agent: str) -> bool:
        """Return whether an agent, or the clock, is present."""
        if agent == "clock":
            return bool(self.session.who(self.session.key(agent, "@alive")))
        return bool(self._present(*agent.split("/")))

    def _tell_dropped(self, gathered: Gathered[Any], asking: Asking) -> None:
        count = gathered.dropped.total() + asking.dropped
        if count:
            first = next(iter(gathered.dropped), "too large, or too many")
            answers = "1 answer is" if count == 1 else f"{count} answers are"
            warn("rejected", f"{answers} passed over; the first is at {first}")

    def _nobody(self, agent: str, nothing: str) -> UnansweredError:
        if not self.is_there("clock"):
            nothing = NOBODY
            if (known := identity(self.session)) and known.team:
                nothing += f". The class's robots are on --fabric {known.fabric}"
        agents = self.alive()
        hint = nearest(agent, agents) or f" There is {', '.join(agents) or 'nobody'}."
        return UnansweredError(
            f"At {self.session.link.endpoint}: "
            f"{nothing or f'there is no {agent}'}."
            f"{hint if agents and agent not in agents else ''} (R0602)"
        )
