"""`rems lend` to whom it can't be, and what programs may ask: a sentence each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.protocol.messages import Loan
from rems_net.errors import FabricError
from rems_net.fabric import join
from rems_net.router.message import pack
from tests.agents.runs import until
from tests.cli.lending.conftest import HERS, drive, lend
from tests.commands import Run, Running, Start

#: waiting for real clocks, too much for every run of the tests
pytestmark = pytest.mark.slow


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
