"""Client: asks a running fabric from outside, and again where nobody answered yet."""

from __future__ import annotations

from typing import Any

from rems_net.agents.verbs import outcome, request
from rems_net.errors import FabricError, nearest
from rems_net.router.mail import Mail
from rems_net.router.session import Session

#: what is wrong where nobody answers
NOBODY = "no experiment runs there. Start one with `rems run` or `rems demo --pace 1`"
#: how often an agent that is there, but does not answer, is asked again
TRIES = 10
#: seconds a verb may take
PATIENCE = 10.0


class Client:
    """A session with a fabric of other processes."""

    def __init__(self, session: Session):
        self.session = session

    def ask(self, key: str, nothing: str, payload: bytes | None = None) -> list[Mail]:
        """The answers at a key; `nothing` says what it means that there are none.

        Raises FabricError then, naming who is there.
        """
        selector = self.session.key(key)
        for _ in range(TRIES):
            answers = self.session.ask(selector, payload, PATIENCE)
            if answers:
                return answers
            # No answer is no proof: right after a reconnect nobody may be found.
            if not self.session.who(self.session.key("clock", "@alive")):
                nothing = NOBODY
                break
        agents = [k.split("/", 1)[1] for k in self._alive()]
        agent = "/".join(key.split("/")[:2])
        hint = nearest(agent, agents) or f" There is {', '.join(agents) or 'nobody'}."
        raise FabricError(
            f"At {self.session.link.endpoint}: "
            f"{nothing or f'there is no {agent}'}.{hint if agents else ''}"
        )

    def call(self, key: str, verb: str, args: tuple[Any, ...], kwargs: Any) -> Any:
        """Call a verb of an agent by value; raises AgentError with what it raised."""
        selector = f"{key}/@call/{verb}"
        answers = self.ask(selector, f"{key} does not answer", request(args, kwargs))
        return outcome(key, answers[0].payload)

    def _alive(self) -> list[str]:
        tokens = self.session.who(self.session.key("*", "*", "@alive"))
        return sorted(t.removesuffix("/@alive") for t in tokens)
