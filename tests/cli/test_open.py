"""`rems router serve` and `rems agent start`: a fabric that waits for nobody."""

from pathlib import Path

import numpy as np
import pytest

import rems_net
from rems_net.client import Fabric
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.scan import is_whole
from tests.agents.runs import Router, free_port, until
from tests.cli.conftest import fabric, robot, row, text, ticks
from tests.commands import Run, Running, Serve, Start


def test_an_agent_is_there_at_once(start: Start, serve: Serve, rems: Run) -> None:
    served = serve()
    with fabric() as here:
        alice = robot(start, "alice")
        ticks(here, "robot/alice")
        proxy = here.robot("alice")
        proxy.command["wheel/left"] = "1 rad/s"
        proxy.command["wheel/right"] = "1 rad/s"

        def drive() -> bool:
            proxy.command["wheel/left"] = "1 rad/s"
            return float(proxy.state.x) > 0.001

        until(drive)
        done = rems("get", "robot/alice/state/x")
        assert (done.returncode, done.stderr) == (0, "")
        assert text(alice).endswith("robot/alice: Ctrl+C ends it\n")
        until(lambda: row(here, "robot/alice") is None, 1.0)
    said = text(served).splitlines()
    assert [line.partition(" on ")[0] for line in said if "alice" in line] == [
        "robot/alice",
        "robot/alice",
    ]
    assert any(line.endswith(" is here") for line in said)
    assert any(line.endswith(" has left") for line in said)


def test_a_recording_of_who_comes(start: Start, serve: Serve, tmp_path: Path) -> None:
    """An output of type mcap, which is there before the robot is."""
    serve()
    path = tmp_path / "rec" / "run.mcap"
    with fabric() as here:
        recorder = start(
            "agent", "start", "output", "mcap", "--out", str(tmp_path / "rec")
        )
        ticks(here, "output/mcap")
        alice = robot(start, "alice")
        ticks(here, "robot/alice")
        # It can be read while it is written, up to the last second.
        until(lambda: McapFile(path).counts.get("robot/alice/state", 0) >= 15)
        assert not is_whole(path)
        text(alice)
        text(recorder)
    assert is_whole(path)
    times = rems_net.read(path)["alice"]["time"].value
    file = McapFile(path)
    ports = [key for key in file.channels if key.startswith("robot/alice/")]
    # On a busy machine a value of one port may miss a tick that another has.
    came = {round(t / 1e9, 6) for key in ports for t in file.times(key)}
    assert {*np.round(times, 6)} <= came
    assert len(times) >= 15
    assert (np.diff(times) > 0).all()


def test_a_served_fabric_comes_back_and_so_do_its_agents(
    start: Start, serve: Serve
) -> None:
    first = serve()
    with fabric() as here:
        alice = robot(start, "alice")
        ticks(here, "robot/alice")
        text(first, Running.kill)
        second = serve()
        ticks(here, "robot/alice")
        assert "joining again" in text(alice)
    assert "robot/alice on " in text(second)


def test_a_released_stop_does_not_come_back_with_the_clock(
    start: Start, serve: Serve
) -> None:
    served = serve()
    with fabric() as here:
        robot(start, "alice")
        until(lambda: row(here, "robot/alice"))
        for _ in range(2):
            assert all(one.stands for one in here.stop())
            assert here.release() == ["robot/alice"]
            drive(here)
            served.kill()
            served.communicate()
            served = serve()
            ticks(here, "robot/alice")
            drive(here)


def drive(here: Fabric) -> None:
    """Drive robot/alice until she has turned."""
    alice = here.robot("alice")
    begun = float(alice.state.heading)

    def turned() -> bool:
        alice.command["wheel/left"] = "1 rad/s"
        return abs(float(alice.state.heading) - begun) > 0.01

    until(turned)


def test_who_comes_first_waits_for_the_clock(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        alice = robot(start, "alice")
        assert alice.stderr is not None
        said = [alice.stderr.readline() for _ in range(2)]
        assert said[1] == f"warning: no clock at {router.endpoint} yet; waiting\n"
        start("router", "serve")
        with fabric() as here:
            ticks(here, "robot/alice")


def test_a_fabric_in_no_time(rems: Run) -> None:
    done = rems(
        "router", "serve", "--pace", "fast", "--listen", f"tcp/127.0.0.1:{free_port()}"
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        "rems: the clock of an open fabric does not wait for agents, so it needs a "
        "pace; expected one above 0, such as 1."
        " (R0433)"
    )
