"""Requests of the page to a fabric, and acts there. Everything here may wait.

Each method runs in a thread of its own, so that a frozen robot delays no frame. STOP is
put by a thread that does nothing else.
"""

import json
import math
import time
from collections.abc import Callable, Iterator, Set
from contextlib import suppress
from typing import Any, TypeVar

from rems_net.agents.about.scenery import scene_by
from rems_net.agents.agent import PHASES
from rems_net.agents.protocol.limits import check_pace
from rems_net.client import Fabric
from rems_net.client.answers import NONSENSE, read_rows, read_schemas, read_told
from rems_net.client.client import Gathered
from rems_net.client.doctor import examine_joined
from rems_net.client.stopping import standings, stop_each, stop_that_holds
from rems_net.client.watcher import Watcher
from rems_net.dashboard.feed import Channel
from rems_net.dashboard.protocol import described
from rems_net.defdict import Schema
from rems_net.errors import FabricError, RemsError, WireError
from rems_net.packing import UNPACK_ERRORS, unpack
from rems_net.router.gate.stops import who_stopped
from rems_net.router.keys import agent_of, is_name
from rems_net.router.mail import Mail
from rems_net.router.message import machine
from rems_net.router.session import Session

T = TypeVar("T")

#: s. A question for the state of the run waits this long.
SHORT = 1.0
#: robots whose places and outlines are asked for, and bytes of an answer
MOST, LARGEST = 200, 1 << 20
#: s. A tick that is older is reported as held.
HELD = 1.0
#: s. An agent whose last message is older is late.
LATE = 1.0
#: s. The roster is asked for again after so long for each agent in it: to read a row
#: costs some microseconds, and a crowd has a thousand.
EACH = 0.002


class Requests:
    """Questions and requests of all pages, over one session."""

    def __init__(self, fabric: Fabric):
        self.fabric = fabric
        self._watcher = Watcher(fabric, self._schemas)
        #: rows of the agents, and s, when they are asked for again
        self._rows: list[dict[str, Any]] = []
        self._due = 0.0
        #: verb of a page's request -> method
        self.deeds: dict[str, Callable[[dict[str, Any]], Any]] = {
            "stop": lambda _: [*map(str, self.fabric.stop())],
            "release": lambda _: self.fabric.release(),
            "pause": lambda _: self.fabric.clock("pause"),
            "resume": lambda _: self.fabric.clock("resume"),
            "step": self._step,
            "pace": self._pace,
            "why": lambda one: self.fabric.why(str(one.get("key", ""))[:256]),
            "settings": self._settings,
            "adjust": self._adjust,
            "doctor": self._doctor,
        }

    # -- what pages ask for -------------------------------------------------------

    def put_stop(self) -> None:
        """Put STOP, and wait for nothing."""
        stop_each(self.fabric.session, [self.fabric.session.fabric])

    def do(self, request: dict[str, Any]) -> Any:
        """Do what a page asks for. Raises RemsError with a sentence for its user."""
        deed = self.deeds.get(str(request.get("do")))
        if deed is None:
            known = ", ".join(self.deeds)
            raise WireError(
                f"The page asks for an unknown deed; known are {known}. (R1003)"
            )
        return deed(request)

    def _step(self, request: dict[str, Any]) -> Any:
        count: Any = request.get("count", 1)
        if type(count) is not int or not 0 < count <= 1000:
            raise WireError(f"A step is 1 to 1000 ticks, not {count!r:.40}. (R1003)")
        return self.fabric.clock("step", count)

    def _pace(self, request: dict[str, Any]) -> Any:
        return self.fabric.clock("pace", check_pace(request.get("pace")) or "fast")

    def _settings(self, request: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the settings of an agent; none if it does not list them."""
        session = self.fabric.session
        key = session.key(_agent(request), "@settings")
        for mail in session.ask(key, timeout=SHORT, first=True):
            with suppress(*NONSENSE):
                return read_settings(mail)
        return []

    def _adjust(self, request: dict[str, Any]) -> list[dict[str, Any]]:
        """Change settings by a call, which outputs record; return all settings."""
        values: Any = request.get("values")
        if not isinstance(values, dict):
            raise WireError("Settings are a map of names and values. (R1003)")
        self.fabric.call(_agent(request), "adjust", (), values)
        return self._settings(request)

    def _doctor(self, _: dict[str, Any]) -> list[tuple[bool, str]]:
        found = examine_joined(self.fabric.session)
        return [(one.well, one.sentence) for one in found]

    # -- what the page always shows ---------------------------------------------------

    def status(self) -> dict[str, Any]:
        """Return the agents, the clock, and which robots stand, as plain values."""
        session = self.fabric.session
        found = look_at(session, self._roster())
        for name in ("tick", "t"):  # they come with the values
            del found[name]
        return found | {
            "router": session.connected,
            "here": machine(),
            "robots": self._standing(found["stopped"]),
            "by": self._stopper(found["stopped"]),
            "drivers": self.fabric.drivers(),
        }

    def _roster(self) -> list[dict[str, Any]]:
        """Return a row for each agent, as it was asked for last."""
        now = time.monotonic()
        if now >= self._due:
            self._rows = _rows(self.fabric.session)
            self._due = now + EACH * len(self._rows)
        return self._rows

    def _stopper(self, holds: bool) -> str:
        """Return the author of the STOP that holds; "" if that is not known."""
        said = who_stopped(self.fabric.session) if holds else None
        return said.by if said is not None else ""

    def _standing(self, holds: bool) -> dict[str, str]:
        """Return what is not well with robots that have to stand; "" for the others."""
        # A program that never answers may keep the question open for so long.
        timeout = SHORT if holds else SHORT / 4
        found = standings(self.fabric.session, holds=holds, timeout=timeout)
        return {one.robot: "" if one.stands else str(one) for one in found}

    def schema(self, channel: Channel, payload: bytes) -> list[dict[str, Any]] | None:
        """Return the fields of a channel's values; None if no agent describes them."""
        kind, name, port = [*channel.key.split(" ")[0].split("/"), ""][:3]
        if kind == "clock":
            return None
        with suppress(*UNPACK_ERRORS, RemsError, StopIteration):
            if name == "@crowd":  # every member has the same one
                name = next(iter(unpack(payload, longest_list=0, largest_map=100_000)))
            found = self._watcher.schema(f"{kind}/{name}", port, channel.schema)
            return None if found is None else described(found)
        return None

    def _schemas(self, agent: str) -> dict[str, Schema]:
        """Return the schemas of an agent's ports; none if it does not answer soon.

        There may be a thousand agents that never answer.
        """
        key = self.fabric.session.key(agent, "@schema")
        for mail in self.fabric.session.ask(key, timeout=SHORT, first=True):
            return read_schemas(mail)
        return {}

    def scenes(self, agents: Set[str]) -> dict[str, Any]:
        """Return the places and outlines of worlds and robots, by agent.

        agents: those that are present. Robots that describe only their ports, as boards
        do, look like the built-in definition with the same ports.
        """
        found = {
            agent: scene
            for kind in ("world", "robot")
            for agent, scene in self._each(kind, "@scene", _read_map)
        }
        robots = {a for a in agents if a.startswith("robot/") and not a.endswith("/*")}
        if robots - found.keys():
            for agent, schemas in self._each("robot", "@schema", read_schemas):
                if agent in robots and agent not in found:
                    found[agent] = scene_by(schemas)
        return found

    def _each(
        self, kind: str, question: str, read: Callable[[Mail], T]
    ) -> Iterator[tuple[str, T]]:
        """Yield the readable answers of all agents of a kind, each with its agent."""
        gathered = Gathered(read)
        key = self.fabric.session.key(kind, "*", question)
        for mail in self.fabric.session.ask(key, timeout=SHORT):
            if len(gathered.values) < MOST:
                gathered.hear(mail)
        for full, value in gathered.values.items():
            yield agent_of(full), value


def look_at(
    session: Session, rows: list[dict[str, Any]] | None = None
) -> dict[str, Any]:
    """Return agents, late agents, the clock, the tick, and whether STOP holds.

    rows: of the agents, if they are known
    """
    if rows is None:
        rows = _rows(session)
    clock = _asked(session, "clock/@why", _read_map)
    tick = _asked(session, "clock/tick?format=json", read_told)
    stopped = bool(clock and clock.get("stopped"))
    if not clock:
        with suppress(RemsError):
            stopped = bool(stop_that_holds(session))
    told = None
    if clock and tick:
        told = {"pace": tick.get("pace"), "paused": clock.get("paused") is True}
        if not told["paused"] and clock.get("age", 0.0) > HELD:
            told["held"] = str(clock.get("waits_for") or "nobody")[:500]
    return {
        "agents": [[row["agent"], row["kind"], row["host"]] for row in rows],
        "late": [row["agent"] for row in rows if row["seen"] > LATE],
        "clock": told,
        "tick": int(tick["n"]) if tick else 0,
        "t": float(tick["t"]) if tick else 0.0,
        "stopped": stopped,
    }


def _rows(session: Session) -> list[dict[str, Any]]:
    return _asked(session, "clock/roster?format=json", read_rows) or []


def _asked(session: Session, key: str, read: Callable[[Mail], Any]) -> Any:
    """Return the first readable answer; None if there is none."""
    try:
        answers = session.ask(session.key(key), timeout=SHORT, first=True)
    except FabricError:
        return None
    for mail in answers:
        with suppress(*NONSENSE):
            return read(mail)
    return None


def _agent(request: dict[str, Any]) -> str:
    """Return the agent that a page names. Raises WireError."""
    agent = request.get("agent")
    kind, _, name = str(agent).partition("/")
    if kind not in PHASES or not is_name(name):
        raise WireError(f"{agent!r:.80} is no agent, such as robot/sim. (R1003)")
    return f"{kind}/{name}"


def read_settings(mail: Mail) -> list[dict[str, Any]]:
    """Return the settings in an agent's answer. Raises WireError."""
    found = json.loads(mail.payload) if mail.size <= LARGEST else None
    if not isinstance(found, list) or not all(isinstance(r, dict) for r in found):
        raise WireError("This answer is no list of settings. (R1003)")
    return found[:MOST]


def _read_map(mail: Mail) -> dict[str, Any]:
    found = json.loads(mail.payload) if mail.size <= LARGEST else None
    if not isinstance(found, dict) or not math.isfinite(found.get("age", 0.0)):
        raise WireError("This answer is no map of finite numbers. (R1003)")
    return found
