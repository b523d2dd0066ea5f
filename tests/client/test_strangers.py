"""Questions from outside, beside programs that keep them open or answer nonsense."""

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import pytest

from rems_net.client import Fabric
from rems_net.errors import AgentError, FabricError
from rems_net.events import listening
from tests.agents.runs import PARTS, calm, until
from tests.client.programs import programs
from tests.client.test_fabric import try_join
from tests.signals import freeze, thaw

SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("live", dt=0.02, duration="600 s", pace=1, folder={str(PARTS)!r})
lab.record = False
lab.robot("free", "parts.py:Cart", "parts.py:Gripping")
lab.robot("other", "parts.py:Cart", "parts.py:Gripping")
lab.robot("third", "parts.py:Cart", "parts.py:Gripping", host="other")
lab.run("out")
"""
NAMES = ("free", "other", "third")
#: seconds an answer may take, whoever else is asked
SOON = 1.0

Start = Callable[..., None]
T = TypeVar("T")


class Lab:
    """A fabric in a process of its own, seen from here."""

    def __init__(self, fabric: Fabric, told: list[str]):
        self.fabric, self.told = fabric, told

    def soon(self, ask: Callable[[], T]) -> T:
        """What `ask` returns, soon."""
        begun = calm()
        found = ask()
        assert calm() - begun < SOON
        return found


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    script = tmp_path / "live.py"
    script.write_text(SCRIPT, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(script)], cwd=tmp_path, stderr=subprocess.DEVNULL
    )
    told: list[str] = []

    try:
        fabric: Fabric = until(try_join)
        with fabric, listening(lambda event: told.append(event.text)):
            until(lambda: len(fabric.get("robot/*/state")) == 3)
            told.clear()
            yield Lab(fabric, told)
    finally:
        process.kill()
        process.communicate()


@pytest.fixture
def stranger(lab: Lab) -> Iterator[Start]:
    """Start a stranger who answers in a way, at all keys or at some."""
    session = lab.fabric.session
    with programs() as started:

        def start(way: str, *keys: str) -> None:
            started("stranger.py", session.link.endpoint, way, *keys)
            # It is heard of a moment later.
            until(lambda: session.ask(f"rems/stranger/{way}", first=True))

        yield start


ALL = ["silent", "complete", "garbage", "maps", "huge", "refuse"]


@pytest.mark.parametrize("way", ALL)
def test_a_stranger_changes_no_answer_and_delays_none(
    lab: Lab, stranger: Start, way: str
) -> None:
    stranger(way)
    fabric, soon = lab.fabric, lab.soon
    rows = soon(fabric.agents)
    assert {row["agent"] for row in rows} == {f"robot/{name}" for name in NAMES}
    one = soon(lambda: fabric.get("robot/free/state"))
    assert one["rems/robot/free/state"]["values"]["x"]["unit"] == "m"
    three = soon(lambda: fabric.get("robot/*/state"))
    assert set(three) == {f"rems/robot/{name}/state" for name in NAMES}
    everything = soon(lambda: fabric.get("**"))
    assert len(everything) == 3 * 2 + 2
    assert soon(lambda: fabric.get("robot/free/stat")) == {}
    assert soon(lambda: fabric.get("robot/ghost/state")) == {}
    robot = soon(lambda: fabric.robot("free"))
    assert soon(lambda: robot.state.x) == 0.0
    assert soon(lambda: robot.grip(0.02)) == {"width": 0.02, "firmly": False}
    with pytest.raises(AgentError, match="no hand is that small"):
        soon(lambda: robot.grip(-1.0))
    assert len(soon(lambda: list(robot.watch("state", count=1)))) == 1
    assert soon(lambda: fabric.clock("pace", 2.0)) == 2.0
    with pytest.raises(FabricError):
        soon(lambda: fabric.robot("ghost"))
    if way in ("silent", "complete"):
        assert lab.told == []
    for sentence in lab.told:
        assert "did not answer" not in sentence
        assert sentence.isprintable()


def test_answers_that_are_none_are_counted(lab: Lab, stranger: Start) -> None:
    stranger("garbage", "robot/free/state")
    # the garbage may come after the answer, which ends the question
    until(lambda: lab.fabric.get("robot/*/state") and lab.told)
    assert lab.told[0].startswith("1 answer is passed over; ") or (
        "answers are passed over; " in lab.told[0]
    )


def test_frozen_agents_are_named(lab: Lab) -> None:
    hosts = {row["agent"]: row["host"] for row in lab.fabric.agents()}
    pid = int(hosts["robot/free"].rpartition(":")[2])
    freeze(pid)
    try:
        found = lab.soon(lambda: lab.fabric.get("robot/*/state"))
        assert set(found) == {
            "rems/robot/other/state",
            "rems/robot/third/state",
        }
        assert set(lab.told) == {
            "robot/free did not answer for 0.5 s; busy, frozen or cut off."
        }
        assert len(lab.soon(lab.fabric.agents)) == 3
    finally:
        thaw(pid)


def test_a_value_that_is_none_ends_no_watching(lab: Lab) -> None:
    fabric = lab.fabric
    robot = fabric.robot("free")

    def spoil() -> None:
        while not over.wait(0.01):
            fabric.session.put("rems/robot/free/state", b"\xc1 no map")

    over = threading.Event()
    beside = threading.Thread(target=spoil)
    beside.start()
    try:
        until(lambda: list(robot.watch("state", count=3)) and lab.told)
    finally:
        over.set()
        beside.join()
    assert lab.told[0].startswith("robot/free/state: ")
