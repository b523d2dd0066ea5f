"""A running fabric from outside: robots as ordinary objects, values by their key.

with rems_net.join() as fabric:
    robot = fabric.robot("sim")
    robot.command["wheel/left"] = "50 percent"
    print(robot.state.x)
    robot.reset()
    for state in robot.watch("state"):
        print(state)
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any, Self

from rems_net.agents.verbs import outcome, request
from rems_net.defdict import DefDict, Schema
from rems_net.errors import ExperimentError, FabricError, UnknownFieldError, nearest
from rems_net.router.find import open_session
from rems_net.router.keys import FABRIC, full_key
from rems_net.router.message import pack, read
from rems_net.router.session import Mail, Mailbox, Session

#: what is wrong where nobody answers
NOBODY = "no experiment runs there. Start one with `rems run` or `rems demo --pace 1`"
#: how often an agent that is there, but does not answer, is asked again
TRIES = 10
#: seconds a verb may take
PATIENCE = 10.0


def join(fabric: str = FABRIC) -> Fabric:
    """Join the running fabric, found as `rems list` finds it; close it by `with`.

    Raises FabricError if there is none.
    """
    return Fabric(open_session(fabric))


class Fabric:
    """Everything that lives on a fabric, from outside."""

    def __init__(self, session: Session):
        self.session = session
        self._schemas: dict[str, Schema] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()

    def agents(self) -> list[dict[str, Any]]:
        """Who is there: agent, kind, host, rate [Hz], seen [s ago], tick.

        Raises FabricError where a router runs, but no experiment.
        """
        found: list[dict[str, Any]] = json.loads(
            self._ask("clock/roster?format=json", NOBODY)[0].payload
        )
        return found

    def robot(self, name: str) -> Proxy:
        """The robot of this name. Raises FabricError if there is none."""
        return self.agent(f"robot/{name}")

    def agent(self, key: str) -> Proxy:
        """Any agent, such as `process/follow`. Raises FabricError if there is none."""
        answers = self._ask(f"{key}/@schema", "")
        schemas = {
            port: Schema.from_wire(wire)
            for port, wire in read(answers[0].payload).items()
        }
        return Proxy(self, key, schemas)

    def get(self, key: str) -> dict[str, Any]:
        """What lives at a key or glob, by full key: tick, time and values with units.

        `{"rems/robot/sim/state": {"tick": 7, "time": 0.7, "values": {"x": {"value":
        0.1, "unit": "m"}}}}`; empty where nothing lives. Raises ExperimentError for
        what is no key.
        """
        key = full_key(key, self.session.fabric)
        answers = self.session.ask(f"{key}?format=json")
        found = {mail.key: json.loads(mail.payload) for mail in answers}
        return dict(sorted(found.items()))

    def nothing_at(self, key: str) -> ExperimentError:
        """The error for a key at which nothing lives: it names what is nearest."""
        fabric = f"{self.session.fabric}/"
        short = full_key(key, self.session.fabric).removeprefix(fabric)
        fields = {
            port.removeprefix(fabric): list(found["values"])
            for port, found in self.get(f"{fabric}**").items()
            if "values" in found
        }
        inside = sorted(port for port in fields if port.startswith(f"{short}/"))
        if inside:
            hint = f" Did you mean '{short}/*' ({', '.join(inside[:4])})?"
        else:
            every = [f"{port}/{path}" for port in fields for path in fields[port]]
            agents = sorted({port.rpartition("/")[0] for port in fields})
            hint = nearest(short, sorted([*fields, *every])) or (
                f" Agents are: {', '.join(agents[:8]) or 'none'}."
            )
        return ExperimentError(f"Nothing lives at {short!r}.{hint}")

    def stop(self, released: bool = False) -> None:
        """Stop every robot, until `stop(released=True)`."""
        self.session.put(self.session.key("stop"), pack(not released))

    def clock(self, verb: str, *args: Any) -> Any:
        """Tell the clock: "pause", "resume", "step", "pace", "end"."""
        return self.call("clock", verb, args, {})

    def call(self, key: str, verb: str, args: tuple[Any, ...], kwargs: Any) -> Any:
        """Call a verb of an agent by value; raises AgentError with what it raised."""
        payload = request(args, kwargs)
        selector = f"{key}/@call/{verb}"
        answers = self._ask(selector, f"{key} does not answer", payload)
        return outcome(key, answers[0].payload)

    def _ask(self, key: str, nothing: str, payload: bytes | None = None) -> list[Mail]:
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

    def _alive(self) -> list[str]:
        tokens = self.session.who(self.session.key("*", "*", "@alive"))
        return sorted(t.removesuffix("/@alive") for t in tokens)


class Proxy:
    """An agent in another process: its ports are DefDicts, its verbs are methods."""

    def __init__(self, fabric: Fabric, key: str, schemas: dict[str, Schema]):
        self._fabric, self._key, self._schemas = fabric, key, schemas

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name in self._schemas:
            return LiveValue(self, name)
        return self._verb(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):
            super().__setattr__(name, value)
        elif name in self._schemas:
            LiveValue(self, name).update(value)
        else:
            raise UnknownFieldError(
                f"{self._key} has no port {name!r}; it has "
                f"{', '.join(self._schemas)}.{nearest(name, self._schemas)}"
            )

    def __dir__(self) -> list[str]:
        return [*self._schemas, "watch"]

    def __repr__(self) -> str:
        return f"<{self._key} at {self._fabric.session.link.endpoint}>"

    def _verb(self, name: str) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            return self._fabric.call(self._key, name, args, kwargs)

        return call

    def watch(self, port: str, count: int | None = None) -> Iterator[DefDict]:
        """Every value that is put at the port from now on, or the first `count`."""
        schema = self._schema(port)
        box = Mailbox()
        session = self._fabric.session
        watching = session.watch(session.key(self._key, port), box)
        try:
            while count is None or count > 0:
                mail = box.get(0.5)  # a wait without end would hide Ctrl+C
                if isinstance(mail, Mail):
                    count = None if count is None else count - 1
                    yield schema.decode(mail.payload)
        finally:
            watching.close()

    def _schema(self, port: str) -> Schema:
        if port not in self._schemas:
            raise UnknownFieldError(
                f"{self._key} has no port {port!r}; it has "
                f"{', '.join(self._schemas)}.{nearest(port, self._schemas)}"
            )
        return self._schemas[port]

    def _get(self, port: str) -> DefDict:
        """The value now. With no newer answer than one's own, the newest counts."""
        answers = self._fabric._ask(f"{self._key}/{port}", f"{self._key} is gone")
        newest = max(answers, key=lambda mail: mail.stamp())
        return self._schema(port).decode(newest.payload)

    def _put(self, port: str, value: DefDict) -> None:
        schema = value.schema
        self._fabric.session.put(
            self._fabric.session.key(self._key, port),
            value.encode(),
            f"{schema.name}@{schema.digest}",
        )


class LiveValue:
    """A port of another process: reading asks for it, writing puts it."""

    def __init__(self, proxy: Proxy, port: str, prefix: str = ""):
        vars(self).update(_proxy=proxy, _port=port, _prefix=prefix)

    def __getitem__(self, path: str) -> Any:
        return self._now()[self._prefix + path]

    def __setitem__(self, path: str, value: Any) -> None:
        self.update({path: value})

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        path = self._prefix + name
        if isinstance(self._proxy._schema(self._port)[path], Schema):
            return LiveValue(self._proxy, self._port, f"{path}/")
        return self._now()[path]

    def __setattr__(self, name: str, value: Any) -> None:
        self.update({name: value})

    def __iter__(self) -> Iterator[str]:
        return iter(self.get())

    def __len__(self) -> int:
        return len(self.get())

    def __contains__(self, path: object) -> bool:
        return path in self.get()

    def __eq__(self, other: object) -> bool:
        return bool(self.get() == other)

    def __hash__(self) -> int:
        raise TypeError("a live value changes, so it cannot be a key of a dict")

    def __repr__(self) -> str:
        return repr(self.get())

    def __str__(self) -> str:
        return str(self.get())

    def get(self) -> Any:
        """The value now, as a DefDict of its own."""
        now = self._now()
        return now[self._prefix.rstrip("/")] if self._prefix else now

    def keys(self) -> Any:
        """The names of its fields."""
        return self.get().keys()

    def update(self, values: Any) -> None:
        """Change some fields; the others stay as they are. One put."""
        now = self._now()
        for path, value in dict(values).items():
            now[self._prefix + path] = value
        self._proxy._put(self._port, now)

    def _now(self) -> DefDict:
        now: DefDict = self._proxy._get(self._port)
        return now
