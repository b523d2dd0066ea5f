"""A running fabric from outside: robots as ordinary objects, values by their key.

with rems_net.join() as fabric:
    robot = fabric.robot("sim")
    robot.command["wheel/left"] = "50 percent"
    print(robot.state.x)
    robot.reset()
    for state in robot.watch("state"):
        print(state)
"""

import time
from contextlib import suppress
from threading import Event
from typing import Any, Self

from rems_net.client.answers import (
    NONSENSE,
    Awaited,
    read_begun,
    read_holder,
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
from rems_net.router.keys import agent_of, full_key
from rems_net.router.session import Session
from rems_net.system.interrupts import CLOSING


def join(fabric: str = "", at: str = "") -> "Fabric":
    """Join the running fabric, found as `rems list` finds it; close it by `with`.

    Without `with` it is closed when the program ends.

    fabric: its name; without one, this user's own if anything runs on it, else the
    shared one. The client warns (`rems_net.events`) of unreadable answers, of agents
    that do not answer, of stopped robots, and of other runs on this machine.
    at: an endpoint or a port of this machine ("7448"); without it REMS_ROUTER, else the
    run that was started last. Raises FabricError if there is no fabric.
    """
    session = open_session(fabric, at)
    CLOSING.add(session)
    if not at and not chosen() and (more := others(session)):
        ports = " or ".join(f"--at {where.rpartition(':')[2]}" for where in more)
        warn(
            "several",
            f"{len(more) + 1} runs are here; this is the newest, at "
            f"{session.link.endpoint}. For another, name it: {ports}",
        )
    return Fabric(session)


class Fabric:
    """Client of a fabric: everything that lives on it, from outside."""

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
        """Return a row per agent: agent, kind, host, rate [Hz], seen [s ago], tick.

        If a run has just been started, wait while its agents come. Raises FabricError
        if a router runs, but no experiment.
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
        """Return the robot of this name. Raises FabricError if there is none."""
        return self.agent(f"robot/{name}")

    def agent(self, key: str) -> Proxy:
        """Return an agent: `process/follow`. Raises FabricError if there is none."""
        return Proxy(self._client, key, self.schemas(key))

    def schemas(self, key: str) -> dict[str, Schema]:
        """Return the schemas of an agent's ports, by name. Raises FabricError."""
        return self._client.ask(f"{key}/@schema", read_schemas)

    def get(self, key: str) -> dict[str, Any]:
        """Return what lives at a key or glob, by full key: tick, time, values, units.

        `{"rems/robot/sim/state": {"tick": 7, "time": 0.7, "values": {"x": {"value":
        0.1, "unit": "m"}}}}`; empty if nothing lives there. Raises ExperimentError if
        the key is not valid.
        """
        key = full_key(key, self.session.fabric)
        found = self._client.every(f"{key}?format=json", read_told)
        return dict(sorted(found.items()))

    def why(self, key: str) -> list[str]:
        """Explain why a value of a port or an agent is missing, old or dropped.

        key: `robot/sim/command`, `robot/sim`. Raises ExperimentError if it does not
        exist, FabricError if there is no clock.
        """
        fabric = self.session.fabric
        short = full_key(key, fabric).removeprefix(f"{fabric}/")
        agent = "/".join(short.split("/")[:2])
        rows = self.agents()
        if "*" in short or agent not in {row["agent"] for row in rows}:
            raise self.nothing_at(key)
        return list(why(self._client, short, rows, self.schemas(agent)))

    def nothing_at(self, key: str) -> ExperimentError:
        """Return the error for a key at which nothing lives; it names the nearest."""
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
        return ExperimentError(
            f"Nothing lives at {short!r}.{hint or ' Type: rems list'} (R0602)"
        )

    def drivers(self) -> dict[str, str]:
        """Return who drives each robot that a person drives, or a run elsewhere.

        By agent, such as {"robot/sim": "anna on laptop-3"}.
        """
        found: dict[str, str] = {}
        for mail in self.session.ask(self.session.key("*", "*", "@driver"), None, 0.5):
            with suppress(*NONSENSE):  # any program can answer there
                found[agent_of(mail.key)] = read_holder(mail)
        return found

    def warn_if_stopped(self, robot: str) -> None:
        """Warn once that `robot/sim` is stopped, and again after each new STOP."""
        self._client.commands.tell_if_stopped(robot)

    def is_there(self, agent: str) -> bool:
        """Return whether an agent is present: `robot/sim`."""
        return self._client.is_there(agent)

    def stop(self) -> list[Receipt]:
        """Stop every robot until `release()`; return a receipt of each.

        STOP is put before any robot is asked, and again until all stand; the call
        returns after at most 1 s. It needs no clock.
        """
        return stop(self._client)

    def take(self, robot: str) -> str:
        """Take `robot/wood` back from the run elsewhere that drives it by a lease.

        The robot then stands, and another run may have it. Returns the name of the run
        that had it, or "". Raises DeniedError for a user without this right,
        FabricError if there is no such robot.
        """
        return take(self._client, robot)

    def release(self) -> list[str] | bool:
        """Let the robots obey again; return those that the clock has released.

        Without a clock, return whether the router held a STOP. Raises FabricError if
        neither a clock nor a router keeps STOP.
        """
        return release(self._client)

    def clock(self, verb: str, *args: Any) -> Any:
        """Command the clock: "pause", "resume", "step", "pace", "end".

        Returns the pace, or the newest tick. "step" waits for its ticks; if a tick is
        held for 3 s, or the run ends, it warns and returns earlier.
        """
        said = self.call("clock", verb, args, {})
        if verb == "step":
            return self._reached(said + (args[0] if args else 1))
        return said

    def _reached(self, n: int) -> int:
        """Wait until tick n is made; return the newest tick, also if it is older."""
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
                warn("held", f"tick {now + 1} is held; the run shows by whom")
                return now
            Event().wait(PAUSE)
        return now

    def call(self, key: str, verb: str, args: tuple[Any, ...], kwargs: Any) -> Any:
        """Call a verb of an agent by value. Raises AgentError with the verb's error."""
        return self._client.call(key, verb, args, kwargs)
