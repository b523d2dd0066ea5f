"""Robots of another process as ordinary objects; the clock told from outside."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import zenoh

from rems_net import Experiment
from rems_net.agents.host.outlet import CROWD
from rems_net.agents.protocol.plan import HERE
from rems_net.client import Fabric, Proxy, join
from rems_net.errors import AgentError, FabricError, RemsError, UnknownFieldError
from rems_net.events import Event, listening
from rems_net.packing import unpack_short
from tests.agents.runs import PARTS, calm, until


def try_join() -> Fabric | None:
    try:
        return join()
    except FabricError:
        return None


def moved(robot: Proxy) -> bool:
    return bool(robot.state.x > 0.1)


def tick(fabric: Fabric) -> int:
    return int(fabric.get("clock/tick")["rems/clock/tick"]["n"])


@contextmanager
def plain(fabric: Fabric) -> Iterator[Any]:
    """A session as a program in plain Zenoh has one."""
    config = {
        "mode": "client",
        "connect": {"endpoints": [fabric.session.link.endpoint]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))) as session:
        yield session


def heard_at(fabric: Fabric, glob: str, count: int) -> set[str]:
    """The keys at which something is heard, once they are enough."""
    heard: set[str] = set()
    with plain(fabric) as session:
        session.declare_subscriber(f"rems/{glob}", lambda s: heard.add(str(s.key_expr)))
        until(lambda: len(heard) >= count)
    return heard


def heard_of_all(fabric: Fabric, port: str, count: int) -> dict[str, Any]:
    """What hosts say of all their robots at once, as soon as that many were named."""
    heard: dict[str, Any] = {}
    with plain(fabric) as session:
        session.declare_subscriber(
            f"rems/robot/@crowd/{port}",
            lambda sample: heard.update(unpack_short(sample.payload.to_bytes())),
        )
        until(lambda: len(heard) >= count)
    return heard


@pytest.fixture
def fabric(tmp_path: Path) -> Iterator[Fabric]:
    """A fabric at real time with one robot that nobody in it commands."""
    lab = Experiment("proxy", dt=0.02, duration="60 s", pace=1, folder=PARTS)
    lab.robot("free", "parts.py:Cart", "parts.py:Gripping", host=HERE)
    thread = threading.Thread(target=lambda: lab.run(tmp_path))
    thread.start()
    found: Fabric = until(try_join)
    with found:
        until(lambda: found.get("robot/free/state"))
        yield found
        found.clock("end")
        thread.join()


def test_ports_behave_as_defdicts(fabric: Fabric) -> None:
    robot = fabric.robot("free")
    assert robot.state == {"x": 0.0, "y": 0.0, "heading": 0.0}
    assert list(robot.state) == ["x", "y", "heading"]
    robot.command["speed"] = "50 percent"
    until(lambda: robot.state.x > 0.01)
    robot.command = {"speed": 0.25, "turn": "10 deg/s"}
    until(lambda: robot.command["turn"] == pytest.approx(0.17453292519943295))
    with pytest.raises(RemsError, match="speed"):
        robot.command.speed = 7.0
    with pytest.raises(UnknownFieldError, match="Did you mean 'speed'"):
        robot.command["sped"] = 0.1
    with pytest.raises(UnknownFieldError, match="Did you mean 'command'"):
        robot.comand = {"speed": 0.1}


def test_of_two_fields_set_one_after_the_other_none_is_lost(fabric: Fabric) -> None:
    robot = fabric.robot("free")
    fabric.clock("pause")  # so it obeys nothing in between
    robot.command.speed = 0.5
    robot.command["turn"] = "-1 rad/s"
    fabric.robot("free").command = {"speed": 0.25}
    assert robot.command == {"speed": 0.0, "turn": 0.0}  # what it obeys
    fabric.clock("step", 2)
    assert robot.command == {"speed": 0.25, "turn": -1.0}
    fabric.clock("resume")
    for i in range(1, 20):
        robot.command.speed = i / 20
        robot.command.turn = -i / 20
        until(partial(robot.command.__eq__, {"speed": i / 20, "turn": -i / 20}))


def test_what_was_obeyed_is_not_said_again(fabric: Fabric) -> None:
    robot = fabric.robot("free")
    robot.command.speed = 1.0
    until(lambda: robot.command.speed == 1.0)
    until(lambda: robot.command.speed == 0.0)  # told nothing more, it stopped
    robot.command.turn = 0.5
    until(lambda: robot.command.turn == 0.5)
    assert robot.command.speed == 0.0


def test_an_out_is_not_written_from_outside(fabric: Fabric) -> None:
    robot = fabric.robot("free")
    sentence = (
        "robot/free/state is an Out, and only robot/free itself writes it. "
        "Set the command of the robot: speed, turn. (R0619)"
    )
    with pytest.raises(FabricError) as caught:
        robot.state.x = 1.0
    assert str(caught.value) == sentence
    with pytest.raises(FabricError) as caught:
        robot.state = {"x": 1.0}
    assert str(caught.value) == sentence


def test_verbs_are_methods_called_by_value(fabric: Fabric) -> None:
    robot = fabric.robot("free")
    robot.command.speed = 1.0
    until(lambda: robot.state.x > 0.1)
    assert robot.reset() is None
    assert robot.state.x < 0.1
    assert robot.grip(0.02, firmly=True) == {"width": 0.02, "firmly": True}
    with pytest.raises(AgentError) as caught:
        robot.grip(-1.0)
    assert str(caught.value) == "robot/free: ValueError: no hand is that small"
    with pytest.raises(AgentError) as caught:
        robot.gripp(0.1)
    assert str(caught.value) == (
        "robot/free: there is no verb 'gripp'; there is grip, reset. "
        "Did you mean 'grip'?"
        " (R0513)"
    )
    with pytest.raises(RemsError, match="cannot travel over the fabric"):
        robot.grip(object())
    assert robot.state.x == 0.0 or robot.state.x < 0.2  # it goes on


def test_a_port_that_is_misspelt(fabric: Fabric) -> None:
    """It was taken for a verb: "'function' object is not subscriptable"."""
    robot = fabric.robot("free")
    said = (
        "robot/free has no port 'stat'; it has command, state. "
        "Did you mean 'state'? (R0620)"
    )
    with pytest.raises(UnknownFieldError) as caught:
        robot.stat["x"]
    assert str(caught.value) == said
    with pytest.raises(UnknownFieldError) as caught:
        robot.stat.x  # noqa: B018
    assert str(caught.value) == said
    assert repr(robot.stat) == "<robot/free.stat(), if it has that verb>"


def test_watching_a_port_gives_defdicts(fabric: Fabric) -> None:
    robot = fabric.robot("free")
    robot.command.speed = 1.0
    seen = [state.x for state in robot.watch("state", count=5)]
    assert len(seen) == 5
    assert seen == sorted(seen)


def test_nobody_of_that_name(fabric: Fabric) -> None:
    with pytest.raises(FabricError, match="there is no robot/fre"):
        fabric.robot("fre")


def test_pause_step_resume_and_pace(fabric: Fabric) -> None:
    at = fabric.clock("pause")
    assert tick(fabric) == at
    assert fabric.get("robot/free/state")["rems/robot/free/state"]["tick"] == at
    assert fabric.clock("step", 3) == tick(fabric) == at + 3
    state = fabric.get("robot/free/state")["rems/robot/free/state"]
    assert state["tick"] == at + 3
    fabric.clock("resume")
    until(lambda: tick(fabric) > at + 5)
    assert fabric.clock("pace", 10.0) == 10.0
    begun, first = calm(), tick(fabric)
    until(lambda: tick(fabric) > first + 250)  # 5 s of fabric time
    assert calm() - begun < 4.0
    with pytest.raises(AgentError) as caught:
        fabric.clock("pace", "fst")
    assert str(caught.value) == (
        "clock: pace is 'fst'; expected \"fast\" or a factor of real time, 0.001 to "
        "10000, such as 1.0. Did you mean 'fast'?"
        " (R0408)"
    )


def test_stop_latches_until_released(fabric: Fabric) -> None:
    robot = fabric.robot("free")
    robot.command.speed = 1.0
    until(lambda: robot.state.x > 0.05)
    fabric.stop()
    until(lambda: robot.command.speed == 0.0)
    at = robot.state.x
    robot.command.speed = 1.0
    first = tick(fabric)
    until(lambda: tick(fabric) > first + 10)
    assert robot.state.x == at
    released = fabric.release()
    assert isinstance(released, list)
    assert "robot/free" in released

    def moves() -> bool:
        robot.command.speed = 1.0
        return bool(robot.state.x > at)

    until(moves)


def test_who_commands_a_stopped_robot_is_told(fabric: Fabric) -> None:
    told: list[Event] = []
    sentence = (
        "robot/free is stopped: it stands still, and obeys no command, until it is "
        "released. Type: rems stop --release"
    )
    event = Event("warning", 0, "", "stop", sentence)
    with listening(told.append), join() as other:
        robot = other.robot("free")
        robot.command.speed = 1.0
        assert told == []
        for count in (1, 2):
            fabric.stop()  # of somebody else

            def commanded(count: int = count) -> bool:
                robot.command.speed = 1.0
                return len(told) == count

            until(commanded)
            robot.command.speed = 0.5
            robot.reset()
            assert told == [event] * count  # once for each STOP
            fabric.release()

            def drives() -> bool:
                robot.command.speed = 1.0
                return bool(robot.command.speed == 1.0)

            until(drives)
        assert told == [event] * 2
    with listening(told.append), join() as late:
        fabric.stop()
        late.call("robot/free", "reset", (), {})
        assert told == [event] * 3


def test_one_of_a_crowd_is_asked_as_any_other(tmp_path: Path) -> None:
    """Hosts of more than 16 agents answer for all of them at once."""
    lab = Experiment("crowds", dt=0.05, duration="60 s", pace=1, folder=PARTS)
    lab.record = False
    for i in range(2 * (CROWD + 1)):
        host = "process" if i % 2 else HERE
        lab.robot(f"r{i}", "parts.py:Cart", "parts.py:Gripping", host=host)
    thread = threading.Thread(target=lambda: lab.run(tmp_path))
    thread.start()
    with until(try_join) as fabric:
        for one in ("robot/r6/state", "robot/r7/state"):  # of each host
            until(partial(fabric.get, one))
        assert list(fabric.get("robot/r7/state/x")) == ["rems/robot/r7/state/x"]
        assert len(fabric.get("robot/r7/*")) == len(("command", "state"))
        assert len(fabric.get("robot/*/state")) == 2 * (CROWD + 1)
        assert len(fabric.get("robot/*/state/heading")) == 2 * (CROWD + 1)
        assert fabric.get("robot/r7/stat") == fabric.get("robot/r999/state") == {}
        for glob, count in (("robot/r6/state", 1), ("robot/*/state", 2 * (CROWD + 1))):
            assert len(heard_at(fabric, glob, count)) == count
        together = heard_of_all(fabric, "state", 2 * (CROWD + 1))
        assert together["r7"] == {"x": 0.0, "y": 0.0, "heading": 0.0}
        assert together.keys() == {f"r{i}" for i in range(2 * (CROWD + 1))}
        for name in ("r0", "r1"):
            robot = fabric.robot(name)
            assert robot.grip(0.02) == {"width": 0.02, "firmly": False}
            robot.command.speed = 1.0
            until(partial(moved, robot))
        with pytest.raises(FabricError, match="there is no robot/r999"):
            fabric.robot("r999")
        fabric.clock("end")
    thread.join()
