"""Proxy: an agent of another process, used like a local object."""

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from rems_net.agents.about.wiring import is_source
from rems_net.client.client import Client, UnansweredError
from rems_net.defdict import DefDict, Schema
from rems_net.errors import FabricError, RemsError, UnknownFieldError, nearest
from rems_net.events import warn
from rems_net.router.asking import printable
from rems_net.router.mail import Mail, Mailbox


class Proxy:
    """An agent in another process: its ports are DefDicts, its verbs are methods."""

    def __init__(self, client: Client, key: str, schemas: dict[str, Schema]):
        self._client, self._key, self._schemas = client, key, schemas
        #: whether no agent of its run commands it, by its own answer
        self._free = False

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name in self._schemas:
            return LiveValue(self, name)
        return RemoteVerb(self, name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):
            super().__setattr__(name, value)
        elif name in self._schemas:
            LiveValue(self, name).update(value)
        else:
            raise self._no_port(name)

    def __dir__(self) -> list[str]:
        return [*self._schemas, "watch"]

    def __repr__(self) -> str:
        return f"<{self._key} at {self._client.session.link.endpoint}>"

    def _no_port(self, name: str) -> UnknownFieldError:
        return UnknownFieldError(
            f"{self._key} has no port {name!r}; it has "
            f"{', '.join(self._schemas)}.{nearest(name, self._schemas)} (R0620)"
        )

    def watch(self, port: str, count: int | None = None) -> Iterator[DefDict]:
        """Yield every value that is put at the port from now on, or the first `count`.

        Malformed values are ignored, with one warning.
        """
        schema = self._schema(port)
        told = False
        box = Mailbox()
        session = self._client.session
        watching = session.watch(session.key(self._key, port), box)
        try:
            while count is None or count > 0:
                mail = box.get(0.5)  # an endless wait would block Ctrl+C
                if not isinstance(mail, Mail):
                    continue
                try:
                    value = schema.decode(mail.payload)
                except RemsError as error:
                    if not told:
                        warn("rejected", f"{self._key}/{port}: {error}")
                    told = True
                    continue
                count = None if count is None else count - 1
                yield value
        finally:
            watching.close()

    def _schema(self, port: str) -> Schema:
        if port not in self._schemas:
            raise self._no_port(port)
        return self._schemas[port]

    def _get(self, port: str) -> tuple[DefDict, int]:
        """Return the current value and its tick: the first readable answer."""
        schema = self._schema(port)
        return self._client.ask(
            f"{self._key}/{port}",
            lambda mail: (schema.decode(mail.payload), mail.stamp().n),
            f"{self._key} is gone",
        )

    def _update(self, port: str, values: Mapping[str, Any]) -> None:
        """Change some fields of the newest command, by one put."""
        if port != "command" or not self._key.startswith("robot/"):
            raise FabricError(
                f"{self._key}/{port} is an Out, and only {self._key} itself writes "
                f"it. {self._advice()} (R0619)"
            )
        if not self._free:
            self._check_free()
        commands = self._client.commands
        value = commands.newest(self._key, port, *self._get(port))
        value.update(values)
        commands.put(self._key, port, value)

    def _check_free(self) -> None:
        """Ask the robot, before its first command, which agent commands it.

        Raises FabricError if an agent of its run does; warns of a lease, which ends.
        """
        source = ""
        with suppress(UnansweredError):  # a program in another language may not answer
            source = self._client.ask(f"{self._key}/@why", _read_source)
        if is_source(source):
            raise FabricError(
                f"{source} commands {self._key}, so it takes no command from here; to "
                f"command it from a program, leave out its connection to {source}."
                " (R0619)"
            )
        if source:
            warn("lease", f"{self._key} is leased to {source}, and obeys nobody else")
        self._free = True

    def _advice(self) -> str:
        command = self._schemas.get("command")
        if command is None:
            return "From outside only robots are commanded."
        return f"Set the command of the robot: {', '.join(command.paths)}."


def _read_source(mail: Mail) -> str:
    """Return the source of a robot's commands. Raises for a malformed answer."""
    return printable(json.loads(mail.payload)["ins"]["command"]["source"])


class RemoteVerb:
    """A verb of an agent. Any name that is no port is one; the agent checks it."""

    def __init__(self, proxy: Proxy, name: str):
        self._proxy, self._name = proxy, name

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        proxy = self._proxy
        return proxy._client.call(proxy._key, self._name, args, kwargs)

    def __getitem__(self, field: str) -> Any:
        raise self._proxy._no_port(self._name)

    def __getattr__(self, field: str) -> Any:
        if field.startswith("__"):
            raise AttributeError(field)
        raise self._proxy._no_port(self._name)

    def __repr__(self) -> str:
        return f"<{self._proxy._key}.{self._name}(), if it has that verb>"


class LiveValue:
    """A port of another process: reading asks for its value, writing puts one."""

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
        """Return the current value, as a DefDict of its own."""
        now = self._now()
        return now[self._prefix.rstrip("/")] if self._prefix else now

    def keys(self) -> Any:
        """Return the names of its fields."""
        return self.get().keys()

    def update(self, values: Any) -> None:
        """Change some fields by one put; the others keep the newest command's values.

        Raises FabricError for an Out, which only its agent writes.
        """
        pairs = dict(values).items()
        self._proxy._update(self._port, {self._prefix + p: v for p, v in pairs})

    def _now(self) -> DefDict:
        now: DefDict = self._proxy._get(self._port)[0]
        return now
