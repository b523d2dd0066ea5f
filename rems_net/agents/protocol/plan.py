"""A plan for one agent: plain data from which its own process builds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rems_net.agents import parts, registry
from rems_net.agents.agent import Agent
from rems_net.agents.robot import Robot, join
from rems_net.agents.runtime import RUNTIME, runtime
from rems_net.defdict import Schema

#: the kinds of the two classes of a robot
ROBOT = ("definition", "driver")


@dataclass(slots=True)
class Plan:
    """Which class, under which name, with which settings, connected to what."""

    kind: str
    name: str
    classes: list[type]
    options: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    initial: Mapping[str, Any] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    every: int = 1
    #: the process it lives in; its own by default
    host: str = ""
    #: the first tick it takes part in
    since: int = 1
    #: how often its process may be started again after a crash
    restart: int = 0
    seed: int = 0
    #: the machine that shall bring it; "" for the run's own
    machine: str = ""
    folder: Path = Path()
    out: Path = Path()

    @property
    def key(self) -> str:
        return f"{self.kind}/{self.name}"

    @property
    def world(self) -> str:
        """The key of the world that it shares, or is: the process is the world's."""
        return self.host if self.host.startswith("world/") else ""

    def build(self) -> Agent:
        """Construct the agent; stores only. Raises RemsError for a wrong setting."""
        common: dict[str, Any] = {
            "options": self.options,
            "folder": self.folder,
            "out": self.out,
            "every": self.every,
        }
        cls: Callable[..., Agent] = self.classes[0]
        if self.kind == "robot":
            common |= {"parameters": self.parameters, "initial": self.initial}
            if len(self.classes) == 2:
                cls = join(*self.classes)
        agent = cls(self.name, **common)
        if RUNTIME in vars(agent):  # no __init__ of the user's own forgot it
            runtime(agent).seed = self.seed
        return agent

    def to_wire(self, agent: Agent) -> dict[str, Any]:
        """Plain data. Settings go as they were checked on `agent`, built from this."""
        plain: dict[str, Any] = {
            "kind": self.kind,
            "name": self.name,
            "classes": [registry.reference(c) for c in self.classes],
            "options": agent.options.encode(),
            "sources": self.sources,
            "every": self.every,
            "since": self.since,
            "seed": self.seed,
            "folder": str(self.folder),
            "out": str(self.out),
        }
        # Ins that have the schema of what they are connected to.
        taken = {port: agent.schemas().get(port) for port in agent.ins()}
        plain["taken"] = {
            port: schema.to_wire()
            for port, schema in taken.items()
            if schema and type(agent).ports()[port].is_open
        }
        if isinstance(agent, Robot):
            plain["parameters"] = agent.parameters.encode()
            start = agent.initial_schema(agent.initial)
            plain["initial"] = start.encode() if agent.initial else b""
        return plain

    @staticmethod
    def load(plain: Mapping[str, Any]) -> list[type]:
        """Import the classes of a plan. Raises RemsError."""
        kinds = ROBOT if plain["kind"] == "robot" else (plain["kind"],)
        return [
            parts.checked(kind, registry.load(one, Path(plain["folder"])))
            for kind, one in zip(kinds, plain["classes"], strict=False)
        ]

    @classmethod
    def from_wire(cls, plain: Mapping[str, Any]) -> tuple[Agent, dict[str, str]]:
        """The agent, built here, and what its Ins are connected to."""
        plan = cls(
            plain["kind"],
            plain["name"],
            cls.load(plain),
            every=plain["every"],
            seed=plain["seed"],
            folder=Path(plain["folder"]),
            out=Path(plain["out"]),
        )
        agent = plan.build()
        agent.options = type(agent).options.schema.decode(plain["options"])
        for port, schema in plain["taken"].items():
            agent.settle(port, Schema.from_wire(schema))
        if isinstance(agent, Robot):
            agent.parameters = type(agent).parameters.schema.decode(plain["parameters"])
            if plain["initial"]:
                agent.prepare()  # for the schema; the host prepares it with its value
                agent.initial = dict(agent.initial_schema.decode(plain["initial"]))
        return agent, plain["sources"]


def robot_classes(definition: object, driver: object, folder: Path) -> list[type]:
    """The two classes a robot is made of. Raises ExperimentError."""
    return [
        parts.find("definition", definition, folder),
        parts.find("driver", driver, folder),
    ]
