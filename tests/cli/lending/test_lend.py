"""`rems lend` and `rems return`: a robot belongs to one fabric at a time."""

from __future__ import annotations

import re
import signal
from pathlib import Path

import pytest

from rems_net.errors import FabricError
from rems_net.fabric import Fabric, join
from tests.agents.runs import Router, until
from tests.cli.lending.conftest import HERS, drive, lend, said, stands, where
from tests.commands import Run, Running, Start

#: a minute and a half of waiting for real clocks, too much for every run of the tests
pytestmark = pytest.mark.slow


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
