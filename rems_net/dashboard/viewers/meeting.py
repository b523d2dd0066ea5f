"""Meeting viewers: who gets in, what each is sent, and what it may do."""

import asyncio
import json
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from typing import Any

from rems_net.dashboard.controls import CHECK
from rems_net.dashboard.door import Answer, Door, refusal
from rems_net.dashboard.stream import Stream
from rems_net.dashboard.viewers import wire
from rems_net.dashboard.viewers.grip import Grip
from rems_net.dashboard.viewers.parameters import (
    Parameters,
    pack_rows,
    read_names,
    read_parameters,
    read_values,
    write_parameters,
)
from rems_net.dashboard.viewers.ports import Ports
from rems_net.dashboard.viewers.viewer import Send, Viewer
from rems_net.errors import RemsError, WireError
from rems_net.events import warn

#: viewers at once
MOST = 4
#: services, by number: what the page's buttons do; and `call`, any agent's verbs
SERVICES = dict(enumerate(("stop", "release", "pause", "resume", "call"), 1))
#: close code of WebSocket: it is no viewer
OTHER = 1002
#: s. Agents are asked so often for their settings, while a viewer follows them.
SETTINGS_PERIOD = 2.0


class Viewers:
    """The viewers of one stream. Without viewers, nothing is subscribed to."""

    def __init__(self, door: Door, stream: Stream, send: Send):
        self._door, self._stream, self._send = door, stream, send
        self._viewers: set[Viewer] = set()
        self._ports: Ports | None = None
        self._tasks: list[asyncio.Task[None]] = []
        #: the settings that viewers who follow them were sent
        self._known: Parameters = {}

    def refuse(self, host: str | None, path: str) -> Answer | None:
        """Return why a viewer at this path does not get in; None if it does."""
        if not self._door.is_here(host) or not self._door.knows_viewer(path):
            return refusal(
                HTTPStatus.FORBIDDEN,
                "This is no address of it: use the one that `rems dashboard --viewers` "
                "prints.",
            )
        if len(self._viewers) >= MOST:
            return refusal(
                HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST} viewers look already."
            )
        return None

    async def meet(self, link: Any) -> None:
        """Serve one viewer, to its end; an error of its connection ends it."""
        if link.subprotocol is None or len(self._viewers) >= MOST:
            await link.close(OTHER, f"expected one of {', '.join(wire.SUBPROTOCOLS)}")
            return
        if self._ports is None or self._ports.fabric is not self._stream.fabric:
            self._begin()
        viewer = Viewer(link, self._send, lambda key: self._grip(viewer, key))
        viewer.send(
            wire.pack_text(
                "serverInfo",
                name=f"rems: {self._stream.fabric.session.fabric}",
                capabilities=list(wire.ABLE),
                supportedEncodings=["json", "cdr"],
                metadata={},
                sessionId=self._stream.fabric.session.id,
            )
        )
        viewer.send(wire.pack_text("advertiseServices", services=_services()))
        self._viewers.add(viewer)
        try:
            await self._hear(viewer)
        finally:
            viewer.let_go()
            self._viewers.discard(viewer)
            self._want()
            if not self._viewers:
                self._end()

    def _grip(self, viewer: Viewer, key: str) -> Grip:
        return Grip(self._stream.fabric, key, self._stream.workers, viewer.say)

    def _begin(self) -> None:
        self._end()
        self._ports = Ports(self._stream.fabric, self._stream.lookups.submit)
        self._tasks = [
            asyncio.create_task(self._every(1.0 / self._stream.rate, self._frame)),
            asyncio.create_task(self._every(CHECK, self._look)),
            asyncio.create_task(self._every(SETTINGS_PERIOD, self._follow)),
        ]

    def _end(self) -> None:
        for task in self._tasks:
            task.cancel()
        self._tasks = []
        if self._ports is not None:
            self._ports.close()
        self._ports = None

    async def _every(self, period: float, work: Callable[[], Any]) -> None:
        """Do this again and again. Any program can send anything: no error ends it."""
        due, told = time.monotonic(), False
        while True:
            due = max(due + period, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            try:
                await work()
            except Exception as error:
                if not told:
                    told = True
                    warn("page", f"viewers: {type(error).__name__}: {error}")

    async def _frame(self) -> None:
        ports = self._ports
        if ports is None:
            return
        changed = ports.drain()
        for viewer in self._viewers:
            viewer.tell(ports)
            viewer.show(changed, ports)

    async def _look(self) -> None:
        if self._ports is None:
            return
        if self._ports.fabric is not self._stream.fabric:  # the page follows a new run
            for viewer in self._viewers:
                viewer.let_go()
                viewer.version = -1
            self._begin()
            return
        for viewer in [*self._viewers]:
            with suppress(Exception):  # it has just gone
                await viewer.look(self._ports.gone, time.monotonic())

    def _want(self) -> None:
        if self._ports is not None:
            self._ports.want(
                {channel for one in self._viewers for channel in one.looks.values()}
            )

    async def _hear(self, viewer: Viewer) -> None:
        """Obey the messages of a viewer until it goes."""
        calls: set[asyncio.Task[None]] = set()
        async for message in viewer.messages():
            if self._ports is None:
                continue
            try:
                call = viewer.obey(message, self._ports)
            except WireError as error:
                viewer.say(str(error))
                continue
            self._want()
            if call is not None:
                if isinstance(call, dict):
                    work = self._parameters(viewer, call)
                else:
                    work = self._call(viewer, *call)
                task = asyncio.create_task(work)
                calls.add(task)
                task.add_done_callback(calls.discard)

    async def _parameters(self, viewer: Viewer, words: dict[str, Any]) -> None:
        """List settings, change them, or note which of them a viewer follows."""
        try:
            match words["op"]:
                case "subscribeParameterUpdates":
                    names, old = read_names(words), viewer.follows
                    everything = not names or old == set()
                    viewer.follows = set() if everything else names | (old or set())
                    return
                case "unsubscribeParameterUpdates":
                    names = read_names(words)
                    rest = (viewer.follows or set()) - names
                    viewer.follows = rest if names and rest else None
                    return
                case "setParameters":
                    given = read_values(words)
                    change = partial(write_parameters, self._stream.fabric, given)
                    await self._stream.in_thread(change)
                    names = set(given)
                case _:
                    names = read_names(words)
            rows = pack_rows(await self._settings(), names)
            number = {"id": words["id"]} if "id" in words else {}
            viewer.send(wire.pack_text("parameterValues", parameters=rows, **number))
        except RemsError as error:
            viewer.say(str(error))

    async def _settings(self) -> Parameters:
        read = partial(read_parameters, self._stream.fabric)
        return await self._stream.in_thread(read)

    async def _follow(self) -> None:
        """Send the settings that have changed to the viewers that follow them."""
        if all(one.follows is None for one in self._viewers):
            self._known = {}
            return
        before, self._known = self._known, await self._settings()
        new = {k: v for k, v in self._known.items() if before.get(k) != v}
        for viewer in self._viewers:
            if viewer.follows is None or not before:
                continue
            if rows := pack_rows(new, viewer.follows):
                viewer.send(wire.pack_text("parameterValues", parameters=rows))

    async def _call(
        self, viewer: Viewer, service: int, call: int, given: bytes
    ) -> None:
        """Do what a button of the page does, or call a verb; and answer."""
        requests = self._stream.requests
        try:
            name = SERVICES.get(service)
            if name == "stop":  # before any robot is asked
                await asyncio.to_thread(requests.put_stop)
            if name == "call":
                wanted = wire.read_call(given)
                do = partial(self._stream.fabric.call, *wanted)
            else:
                do = partial(requests.do, {"do": name})
            result = await self._stream.in_thread(do)
            viewer.send(wire.pack_answer(service, call, result))
        except RemsError as error:
            words: dict[str, Any] = {"serviceId": service, "callId": call}
            viewer.send(
                wire.pack_text("serviceCallFailure", message=str(error), **words)
            )


def chosen(_: Any, offered: Sequence[Any]) -> Any:
    """Return the subprotocol of a viewer; None for the page, which names none."""
    return next((one for one in wire.SUBPROTOCOLS if one in offered), None)


def _services() -> list[dict[str, Any]]:
    """Return the services, whose arguments and results are in JSON."""
    json_of = {"encoding": "json", "schemaEncoding": "jsonschema"}
    json_of |= {"schema": json.dumps({"type": "object"})}
    called = {"schema": json.dumps(wire.CALL)}
    return [
        {
            "id": number,
            "name": f"/{name}",
            "type": f"rems_msgs/srv/{name.capitalize()}",
            "request": {
                **(json_of | called if name == "call" else json_of),
                "schemaName": f"{name}_request",
            },
            "response": {**json_of, "schemaName": f"{name}_response"},
        }
        for number, name in SERVICES.items()
    ]
