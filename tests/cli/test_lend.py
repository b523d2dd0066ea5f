"""`rems lend` and `rems return`: a robot belongs to one fabric at a time."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.protocol.messages import Loan
from rems_net.errors import FabricError
from rems_net.fabric import Fabric, join
from rems_net.router.message import pack
from tests.agents.runs import Router, until
from tests.commands import Done, Run, Running, Start
from tests.drivers.hardware.cart import Device

#: a minute and a half of waiting for real clocks, too much for every run of the tests
pytestmark = pytest.mark.slow


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


def test_lent_and_returned(alice: Running, start: Start, rems: Run) -> None:
    start("serve", "--fabric", "team3", "--dt", "40 ms")
    until(lambda: "there is" not in lend(rems).stderr)
    assert where(rems) == ["rems:team3", "team3:"]
    assert "lent: team3" in rems("list", "--fabric", "rems").stdout
    with join("rems") as home, join("team3") as team:
        # She obeys who has her, and nobody else.
        drive(team)
        with pytest.raises(FabricError, match=r"it is lent to 'team3': --fabric team3"):
            _ = home.robot("alice").state.x
        assert rems("get", "robot/alice/state/x").stderr == (
            "rems: robot/alice is lent to 'team3'; say so: --fabric team3\n"
        )
        # STOP of either stops her...
        assert stands(home)
        still = pose(team)
        with pytest.raises(AssertionError):
            until(lambda: pose_when_told(team) != still, 1.0)
        home.release()
        drive(team)
        assert stands(team)
        # ...and that of her borrower stays there.
        done = rems("return", "robot/alice", "--fabric", "team3")
        assert (done.returncode, done.stdout) == (0, "robot/alice is back on 'rems'.\n")
        assert where(rems) == ["rems:"]
        here = pose(home)
        with pytest.raises(AssertionError):  # nothing that she was told there counts
            until(lambda: pose(home) != here, 1.0)
        drive(home)
    assert said(alice).splitlines()[1:] == [
        "warning: robot/alice is lent to 'team3'",
        "warning: robot/alice is back on 'rems': it was asked for",
    ]


def lend(rems: Run, *more: str) -> Done:
    return rems("lend", "robot/alice", "team3", *more)


def pose(fabric: Fabric) -> float:
    return float(fabric.robot("alice").state.x)


def pose_when_told(fabric: Fabric) -> float:
    fabric.robot("alice").command["wheel/left"] = "3 rad/s"
    return pose(fabric)


def test_a_run_that_names_her_has_her_until_it_ends(
    alice: Running, start: Start, rems: Run, folder: Path
) -> None:
    (folder / "hers.toml").write_text(HERS)
    words = ("run", "hers.toml", "--fabric", "team3", "--elsewhere", "robot/alice")
    run = start(*words)
    until(lambda: lend(rems, "--to", "command=input/keys").returncode == 0)
    _, error = run.communicate(timeout=60)
    assert run.returncode == 0, error
    until(lambda: where(rems) == ["rems:"])
    with join("rems") as home:
        drive(home)
    rows = (folder / "runs" / "hers" / "alice.csv").read_text().splitlines()
    assert len(rows) > 50
    assert (
        "warning: robot/alice is back on 'rems': the run that it was lent to is over"
        in (said(alice))
    )


def test_a_borrower_that_dies_gives_her_back(
    alice: Running, start: Start, rems: Run
) -> None:
    team = start("serve", "--fabric", "team3")
    until(lambda: lend(rems).returncode == 0)
    team.kill()
    until(lambda: where(rems) == ["rems:"])
    with join("rems") as home:
        drive(home)
    assert "back on 'rems': the clock is out of sight for " in said(alice)


def test_a_run_whose_robot_is_taken_back_says_so(
    alice: Running, start: Start, rems: Run, folder: Path
) -> None:
    (folder / "hers.toml").write_text(HERS.replace('"2 s"', '"60 s"'))
    words = ("run", "hers.toml", "--fabric", "team3", "--elsewhere", "robot/alice")
    run = start(*words)
    until(lambda: lend(rems).returncode == 0)
    # Before its first tick the run would wait for her to come again.
    listed = ("list", "--fabric", "team3", "--json")
    until(lambda: re.search(r'"tick": [1-9]', rems(*listed).stdout))
    assert rems("return", "robot/alice").returncode == 0
    _, error = run.communicate(timeout=60)
    assert run.returncode == 1
    assert "robot/alice: was returned to 'rems'" in error


def test_a_home_that_is_gone_calls_her_back(
    start: Start, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        home = start("serve")
        team = start("serve", "--fabric", "team3")
        alice = start("agent", "robot", "woodbot", "kinematic", "--name", "alice")
        until(lambda: lend(rems).returncode == 0)
        home.kill()
        home.communicate()
        start("serve")
        until(lambda: where(rems) == ["rems:"])
        with join("rems") as fabric:
            drive(fabric)
        lines = said(alice)
        assert "joining again" in lines
        assert "passed over" not in lines
        team.send_signal(signal.SIGINT)
        out, _ = team.communicate(timeout=20)
    assert "robot/alice: its own fabric, 'rems', is gone\n" in out


def test_mistakes(alice: Running, start: Start, rems: Run, folder: Path) -> None:
    def refused(*words: str) -> str:
        done = rems(*words)
        assert (done.returncode, done.stdout) == (2, "")
        return done.stderr.removeprefix("rems: ")

    at = f"At {join('rems').session.link.endpoint}"
    assert refused("lend", "robot/alise", "rems2") == (
        f"{at}: there is no robot/alise. Did you mean 'robot/alice'?\n"
    )
    assert refused("lend", "robot/alice", "team3") == (
        f"robot/alice: there is no fabric 'team3' {at.lower()}; there is rems.\n"
    )
    assert refused("lend", "robot/alice", "rems") == (
        "robot/alice: it is on 'rems', and not lent\n"
    )
    assert refused("return", "robot/alice") == (
        "robot/alice: it is on 'rems', and not lent\n"
    )
    for glob in ("robot/*", "alice", "input/keys", "robot/"):
        assert refused("lend", glob, "team3") == (
            f"{glob!r} is no robot; expected one, such as robot/woodbot-7.\n"
        )
    # A closed run keeps its robots, and takes none that it does not name.
    (folder / "hers.toml").write_text(HERS.replace('"2 s"', '"60 s"'))
    start("run", "hers.toml", "--fabric", "team3")
    until(lambda: "already" in lend(rems).stderr)
    assert refused("lend", "robot/alice", "team3") == (
        "robot/alice: there is a robot/alice on 'team3' already; start one of the two "
        "with another name\n"
    )
    assert refused("lend", "robot/alice", "rems", "--fabric", "team3") == (
        f"{at}: robot/alice can't be lent: it is part of a run. What can is a robot "
        "that was started by itself, by `rems agent robot`.\n"
    )
    start("agent", "robot", "woodbot", "kinematic", "--name", "bob")
    until(lambda: "robot/bob" in rems("list").stdout)
    assert refused("lend", "robot/bob", "team3") == (
        "robot/bob: 'team3' does not take it: this run is closed, and has no place for "
        "robot/bob; it waits for nobody. A run takes it that was started with "
        "`--elsewhere robot/bob`.\n"
    )
    assert refused("lend", "robot/bob", "a/b") == (
        "the fabric's name is 'a/b'; a name has 1 to 63 letters, digits, '_', '-' or "
        "'.', and begins with a letter or a digit.\n"
    )
    # She is where she was.
    with join("rems") as home:
        drive(home)


def test_who_asks_for_all_or_for_nonsense(
    alice: Running, start: Start, rems: Run
) -> None:
    """A program of one's own can ask anything; she lives on."""
    start("serve", "--fabric", "team3")
    until(lambda: "there is no fabric" not in rems("list", "--fabric", "team3").stderr)
    with join("rems") as home:
        session = home.session
        for payload in (b"", b"\xc1", pack(3), pack({"fabric": "a/b", "sources": {}})):
            with pytest.raises(FabricError):
                session.ask("rems/robot/alice/@lend", payload)

        def lent() -> bool:
            try:
                told = session.ask("rems/robot/*/@lend", Loan("team3", {}).to_wire())
            except FabricError:  # there is no clock yet
                return False
            return [mail.key for mail in told] == ["rems/robot/alice/@lend"]

        until(lent)
        for payload in (b"", pack({"fabric": 1, "sources": {}})):
            with pytest.raises(FabricError):
                session.ask("rems/robot/alice/@lend", payload)
        assert home.take_back("robot/alice") == "rems"
        drive(home)


def test_a_run_in_no_time_gets_none(
    alice: Running, start: Start, rems: Run, folder: Path
) -> None:
    fast = HERS.replace("pace = 1.0", "").replace('"2 s"', '"3600 s"')
    (folder / "hers.toml").write_text(fast)
    start("run", "hers.toml", "--fabric", "team3", "--elsewhere", "robot/alice")
    until(lambda: "pace" in lend(rems).stderr)
    assert lend(rems).stderr == (
        "rems: robot/alice: the run on 'team3' is as fast as it can be, and a lent "
        "robot lives in real time; give that run a pace: --pace 1\n"
    )


def test_who_is_lent_is_lent_once(alice: Running, start: Start, rems: Run) -> None:
    start("serve", "--fabric", "team3")
    until(lambda: lend(rems).returncode == 0)
    again: Any = rems("lend", "robot/alice", "team4")
    assert again.stderr == (
        "rems: robot/alice: it is lent to 'team3' already. Type: rems return "
        "robot/alice\n"
    )


def test_a_router_that_restarts(
    start: Start, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """She is at home when it is back, and her clock knows it, which could not hear."""
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        start("serve")
        start("serve", "--fabric", "team3")
        alice = start("agent", "robot", "woodbot", "kinematic", "--name", "alice")
        until(lambda: lend(rems).returncode == 0)
        router.kill()
        assert alice.stderr is not None
        assert any(
            "is back on 'rems': the clock is out" in line for line in alice.stderr
        )
        router.start()
        until(lambda: "rems:" in where(rems))
        with join("rems") as home:
            drive(home)


def test_one_who_ends_while_she_is_lent(
    alice: Running, start: Start, rems: Run
) -> None:
    start("serve", "--fabric", "team3")
    until(lambda: lend(rems).returncode == 0)
    said(alice)
    until(lambda: where(rems) == [])


def test_a_cart_that_is_really_driven(
    start: Start, rems: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stands still in between, at STOP of either, and without either's ticks."""
    parts = Path(__file__).parents[1] / "drivers" / "hardware" / "parts.py"
    with Device(tmp_path) as device, Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        clock = start("serve")
        start("serve", "--fabric", "team3")
        agent = ("agent", "robot", f"{parts}:Cart", f"{parts}:SerialCart")
        start(*agent, "--name", "cart", "--set", f"options.port={device.link}")
        with join("rems") as home, join("team3") as team:
            goes(home, device)
            until(lambda: rems("lend", "robot/cart", "team3").returncode == 0)
            until(lambda: device.speed == 0.0)
            told = len(device.heard())
            until(lambda: len(device.heard()) > told + 20)
            assert {n["heard"][0] for n in device.heard()[told:]} == {0.0}
            goes(team, device)
            assert stands(home, "cart")
            stays(team, device)
            home.release()
            goes(team, device)
            clock.send_signal(signal.SIGSTOP)
            try:
                until(lambda: tell(team) or device.speed == 0.0)
                stays(team, device)
            finally:
                clock.send_signal(signal.SIGCONT)
            goes(team, device)
            assert rems("return", "robot/cart").returncode == 0
            until(lambda: device.speed == 0.0)
            goes(home, device)


def tell(fabric: Fabric) -> bool:
    fabric.robot("cart").command["speed"] = 0.5
    return False


def goes(fabric: Fabric, device: Device) -> None:
    """Tell the cart to go until it does."""

    def told() -> bool:
        try:
            tell(fabric)
        except FabricError:  # it is not there yet
            return False
        return device.speed == 0.5

    until(told)


def stays(fabric: Fabric, device: Device) -> None:
    """Tell it to go, and see that it does not."""
    told = len(device.heard())
    until(lambda: tell(fabric) or len(device.heard()) > told + 30)
    assert {n["heard"][0] for n in device.heard()[told:]} == {0.0}
