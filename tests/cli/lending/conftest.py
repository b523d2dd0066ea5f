"""robot/alice, whom other fabrics borrow, and what is asked of her."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator

import pytest

from rems_net.fabric import Fabric
from tests.agents.runs import Router, until
from tests.commands import Done, Run, Running, Start

HERS = """\
[experiment]
name = "hers"
dt = "20 ms"
duration = "2 s"
pace = 1.0

[[input]]
name = "keys"
type = "csv"
file = "keys.csv"

[[robot]]
name = "alice"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"

[[output]]
name = "log"
type = "csv"
"""


@pytest.fixture
def alice(
    start: Start, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Running]:
    """robot/alice, on an open fabric at a class's router."""
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        start("serve")
        robot = start("agent", "robot", "woodbot", "kinematic", "--name", "alice")
        until(lambda: where(rems) == ["rems:"])
        yield robot


def where(rems: Run) -> list[str]:
    """On which fabrics robot/alice is, and to which she is lent there."""
    found = json.loads(rems("list", "--all", "--json").stdout or "[]")
    alice = (row for row in found if row["agent"] == "robot/alice")
    return [f"{row['fabric']}:{row['lent']}" for row in alice]


def said(robot: Running) -> str:
    """All that the robot's terminal shows, in the end."""
    robot.send_signal(signal.SIGINT)
    return "".join(robot.communicate(timeout=20))


def drive(fabric: Fabric, more: float = 0.02) -> None:
    """Drive until she is some meters further."""
    alice = fabric.robot("alice")
    begun = float(alice.state.x)

    def further() -> bool:
        for wheel in ("left", "right"):
            alice.command[f"wheel/{wheel}"] = "3 rad/s"
        return float(alice.state.x) > begun + more

    until(further)


def stands(fabric: Fabric, name: str = "alice") -> bool:
    """Whether it comes to stand when it is told to stop."""

    def told() -> bool:
        return any(one.stands for one in fabric.stop() if one.robot == f"robot/{name}")

    return bool(until(told))


def lend(rems: Run, *more: str) -> Done:
    return rems("lend", "robot/alice", "team3", *more)
