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

import time
from threading import Event
from typing import Any, Self

from rems_net.client.answers import (
    Awaited,
    read_begun,
    read_rows,
    read_schemas,
    read_told,
)
from rems_net.client.client import BUSY, NOBODY, PAUSE, Client
from rems_net.client.proxy import Proxy
from rems_net.client.stopping import Receipt, release, stop, take
from rems_net.client.why import why
from rems_net.defdict import Schema
from rems_net.errors import ExperimentError, FabricError, nearest, some
from rems_net.events import warn
from rems_net.router.find import chosen, open_session, others
from rems_net.router.keys import full_key
from rems_net.router.session import Session


def join(fabric: str = "", at: str = "") -> Fabric:
    """Join the running fabric, found as `rems list` finds it; close it by `with`.

    fabric: its name; without one, this user's own where something runs on it, and else
    the one that is everybody's.
    It warns (`rems_net.events`) of answers that are none and are passed over, of agents
    that do not answer, of robots that are stopped, and of runs beside this one.
    at: where it is, an endpoint or a port of this machine ("7448"); without it
    REMS_ROUTER says so, or it is the run that was started last. Raises FabricError if
    there is no fabric.
    """
    session = open_session(fabric, at)
    if not at and not chosen() and (more := others(session)):
        ports = " or ".join(f"--at {where.rpartition(':')[2]}" for where in more)
        warn(
            "several",
            f"{len(more) + 1} runs are here; this is the newest, at "
            f"{session.link.endpoint}. For another, say which: {ports}",
        )
    return Fabric(session)


class Fabric:
    """Everything that lives on a fabric, from outside."""

    def __init__(self, session: Session):
        self.session = session
        self._client = Client(session)

    def __repr__(self) -> str:
        return f"<fabric {self.session.fabric!r} at {self.session.link.endpoint}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()

    def agents(self) -> list[dict[str, Any]]:
        """Who is there: agent, kind, host, rate [Hz], seen [s ago], tick.

        A run that has just been started is waited for, while its agents come. Raises
        FabricError where a router runs, but no experiment.
        """
        ask, newest, since = self._client.ask, Awaited([]), 0.0
        while True:
            told = ask("clock/roster?format=json;begun", read_begun, NOBODY)
            if not isinstance(told, Awaited):
                return told
            if told != newest or not since:
                newest, since = told, time.monotonic()
            elif time.monotonic() > since + BUSY:
                warn("waiting", f"the run waits for {some(told.agents, 5)}")
                return ask("clock/roster?format=json", read_rows, NOBODY)
            Event().wait(PAUSE)

    def robot(self, name: str) -> Proxy:
        """The robot of this name. Raises FabricError if there is none."""
        return self.agent(f"robot/{name}")

    def agent(self, key: str) -> Proxy:
        """Any agent, such as `process/follow`. Raises FabricError if there is none."""
        return Proxy(self._client, key, self.schemas(key))

    def schemas(self, key: str) -> dict[str, Schema]:
        """The schemas of an agent's ports, by name. Raises FabricError as `agent`."""
        return self._client.ask(f"{key}/@schema", read_schemas)

    def get(self, key: str) -> dict[str, Any]:
        """What lives at a key or glob, by full key: tick, time and values with units.

        `{"rems/robot/sim/state": {"tick": 7, "time": 0.7, "values": {"x": {"value":
        0.1, "unit": "m"}}}}`; empty where nothing lives. Raises ExperimentError for
        what is no key.
        """
        key = full_key(key, self.session.fabric)
        found = self._client.every(f"{key}?format=json", read_told)
        return dict(sorted(found.items()))

    def why(self, key: str) -> list[str]:
        """Why a value is missing, old or dropped: what is known of a port, or an agent.

        key: `robot/sim/command`, `robot/sim`. Raises ExperimentError for what is not
        there, FabricError where there is no clock.
        """
        fabric = self.session.fabric
        short = full_key(key, fabric).removeprefix(f"{fabric}/")
        agent = "/".join(short.split("/")[:2])
        rows = self.agents()
        if "*" in short or agent not in {row["agent"] for row in rows}:
            raise self.nothing_at(key)
        return list(why(self._client, short, rows, self.schemas(agent)))

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

    def stop(self) -> list[Receipt]:
        """Stop every robot, until `release()`: what each of them says about it.

        It is put before anybody is asked, and again until all stand; after 1 s it
        returns what has been said. Needs no clock. Raises FabricError where there is
        no robot.
        """
        return stop(self._client)

    def take(self, robot: str) -> str:
        """Take `robot/wood` back from the run elsewhere that drives it by a lease.

        It stands then, and another run may have it. Returns the name of the run that
        had it; "" if none had. Raises DeniedError for a user who may not, FabricError
        if there is no such robot.
        """
        return take(self._client, robot)

    def release(self) -> list[str] | bool:
        """Let the robots obey again: those that the clock has released.

        Without a clock: whether the router held a STOP. Raises FabricError where
        nobody keeps one.
        """
        return release(self._client)

    def clock(self, verb: str, *args: Any) -> Any:
        """Tell the clock: "pause", "resume", "step", "pace", "end".

        Returns the pace, or the newest tick: of "step", when all of them are made.
        """
        said = self.call("clock", verb, args, {})
        if verb == "step":
            return self._reached(said + (args[0] if args else 1))
        return said

    def _reached(self, n: int) -> int:
        """Wait until tick n is made; the newest tick, also where it is none."""
        now, newest, since = -1, -1, time.monotonic()
        while now < n:
            try:
                told = self._client.ask("clock/tick?format=json", read_told, NOBODY)
            except FabricError:
                if newest < 0:
                    raise
                warn("ended", f"the run ended after tick {newest}")
                return newest
            now = int(told["n"])
            if now > newest:
                newest, since = now, time.monotonic()
            elif time.monotonic() > since + BUSY:
                warn("held", f"tick {now + 1} is held; the run says by whom")
                return now
            Event().wait(PAUSE)
        return now

    def call(self, key: str, verb: str, args: tuple[Any, ...], kwargs: Any) -> Any:
        """Call a verb of an agent by value; raises AgentError with what it raised."""
        return self._client.call(key, verb, args, kwargs)
