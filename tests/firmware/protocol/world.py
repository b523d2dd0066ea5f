"""A fabric, and emulated Woodbots on it: the core, a real link, a real clock."""

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.serving import serve
from rems_net.client import Fabric
from rems_net.errors import FabricError
from rems_net.events import Event, listening
from rems_net.firmware.robot import EmulatedRobot, running
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Router, until

#: seconds that anything may take on a busy machine
LONG = 40.0


class World:
    """Everything at one router; ended by `with`."""

    def __init__(self) -> None:
        self.router = Router()
        self.endpoint = self.router.endpoint
        #: what the clocks said
        self.said: list[Event] = []
        self._clocks: list[tuple[Clock, threading.Thread]] = []
        self._robots = ExitStack()
        self._sessions: list[Session] = []

    def end(self) -> None:
        self._robots.close()
        for fabric in list({clock.session.fabric for clock, _ in self._clocks}):
            self.end_clock(fabric)
        for session in self._sessions:
            session.close()

    def session(self, fabric: str = "rems") -> Session:
        session = Session(Link(self.endpoint, fabric=fabric, timeout=10.0))
        session.open()
        self._sessions.append(session)
        return session

    def clock(self, fabric: str = "rems", dt: float = 0.02) -> Clock:
        """An open fabric's, which ticks in a thread of its own."""
        begun = threading.Event()
        clocks: list[Clock] = []

        def begin(clock: Clock) -> None:
            clocks.append(clock)
            begun.set()

        session = self.session(fabric)
        thread = threading.Thread(target=serve, args=(session, dt, 1.0, begin))
        thread.start()
        assert begun.wait(LONG)
        self._clocks.append((clocks[0], thread))
        return clocks[0]

    def end_clock(self, fabric: str) -> None:
        """It ends, and its session with it: nobody answers for it any more."""
        for clock, thread in self._clocks:
            if clock.session.fabric == fabric:
                clock.pacing.end()
                thread.join(LONG)
                clock.session.close()
        self._clocks = [c for c in self._clocks if c[0].session.fabric != fabric]

    def robot(self, name: str = "w7", **settings: str) -> EmulatedRobot:
        settings = {"name": name, "router": self.endpoint, **settings}
        robot = EmulatedRobot(settings)
        self._robots.enter_context(running([robot]))
        return robot

    def fabric(self, name: str = "rems") -> Fabric:
        return Fabric(self.session(name))


@contextmanager
def world() -> Iterator[World]:
    made = World()
    with made.router, listening(made.said.append):
        try:
            yield made
        finally:
            made.end()


def row(fabric: Fabric, name: str = "w7") -> dict[str, Any] | None:
    """What the clock says of a robot that it has heard of a tick from."""
    try:
        rows = fabric.agents()
    except FabricError:
        return None
    return next(
        (r for r in rows if r["agent"] == f"robot/{name}" and r["tick"] > 0), None
    )


def figures(fabric: Fabric, name: str = "w7") -> dict[str, Any]:
    found: dict[str, Any] = fabric.call(f"robot/{name}", "figures", (), {})
    return found


def drive(fabric: Fabric, name: str = "w7", left: float = 3.0) -> None:
    """Tell it again and again, until it obeys."""
    robot = fabric.robot(name)

    def obeys() -> bool:
        robot.command = {"wheel/left": left, "wheel/right": 2.0}
        return bool(robot.command["wheel/left"] == left)

    until(obeys, LONG)
