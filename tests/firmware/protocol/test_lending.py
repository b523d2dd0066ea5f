"""A Woodbot of a class is lent to a team, and comes back by itself."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rems_net.agents.protocol.messages import Loan
from rems_net.errors import FabricError
from rems_net.fabric import Fabric
from rems_net.router.message import pack
from tests.agents.runs import until
from tests.commands import command
from tests.firmware.golden import schemas
from tests.firmware.protocol.world import LONG, World, drive, figures, row


def lent(home: Fabric) -> str:
    seen = row(home)
    return "" if seen is None else str(seen["lent"])


def both(here: World) -> tuple[Fabric, Fabric]:
    """A robot on the class's fabric, and a team's beside it."""
    here.clock()
    here.clock("team3", dt=0.04)
    here.robot()
    home, team = here.fabric(), here.fabric("team3")
    until(lambda: row(home), LONG)
    return home, team


def test_lent_and_returned(here: World) -> None:
    home, team = both(here)
    drive(home)
    assert home.lend("robot/w7", "team3") == "team3"
    until(lambda: lent(home) == "team3", LONG)
    until(lambda: row(team), LONG)
    drive(team)
    with pytest.raises(FabricError, match=r"it is lent to 'team3': --fabric team3"):
        home.robot("w7").state.get()
    assert home.schemas("robot/w7") == schemas()
    with pytest.raises(FabricError, match=r"lent already. Type: rems return robot/w7"):
        home.lend("robot/w7", "team4")
    # STOP of either stops it...
    until(lambda: all(one.stands for one in home.stop()), LONG)
    until(lambda: figures(team)["safe"] == "stopped", LONG)
    home.release()
    drive(team)
    until(lambda: all(one.stands for one in team.stop()), LONG)
    # ...and that of its borrower stays there.
    assert home.take_back("robot/w7") == "rems"
    until(lambda: lent(home) == "", LONG)
    drive(home)
    until(lambda: row(team) is None, LONG)
    with pytest.raises(FabricError, match="it is on 'rems', and not lent"):
        home.take_back("robot/w7")


def test_it_keeps_its_seat_at_home(here: World) -> None:
    home, team = both(here)
    home.lend("robot/w7", "team3")
    before = row(home)
    assert before is not None
    until(lambda: (row(home) or before)["tick"] > before["tick"] + 20, LONG)
    assert team.take_back("robot/w7") == "rems"
    until(lambda: lent(home) == "", LONG)


def test_nobody_takes_it(here: World) -> None:
    here.clock()
    here.robot()
    home = here.fabric()
    until(lambda: row(home), LONG)
    with pytest.raises(FabricError, match="there is no fabric 'nobody'"):
        home.lend("robot/w7", "nobody")
    drive(home)
    answers = home.session.asking(
        home.session.key("robot", "w7", "@lend"), pack({"fabric": "a b", "sources": {}})
    )
    with answers:
        assert "expected a loan" in str(answers.next())
    globbed = Loan("team3", {"command": "input/*"}).to_wire()
    with pytest.raises(FabricError, match="each source without a glob"):
        home.session.ask(home.session.key("robot", "w7", "@lend"), globbed)


def test_it_comes_back_from_who_is_gone(here: World) -> None:
    home, team = both(here)
    home.lend("robot/w7", "team3")
    drive(team)
    here.end_clock("team3")
    until(lambda: lent(home) == "", LONG)
    drive(home)


def test_a_name_that_is_taken_there(here: World) -> None:
    home, team = both(here)
    here.robot(fabric="team3")
    until(lambda: row(team), LONG)
    refused = (
        r"'team3' does not take it: there is a robot/w7 already.*--elsewhere robot/w7"
    )
    with pytest.raises(FabricError, match=refused):
        home.lend("robot/w7", "team3")
    until(lambda: lent(home) == "", LONG)
    drive(home)


RUN = """\
[experiment]
name = "hers"
dt = "20 ms"
duration = "3 s"
pace = 1.0

[[input]]
name = "keys"
type = "csv"
file = "keys.csv"

[[robot]]
name = "w7"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"

[[output]]
name = "log"
type = "csv"
"""
KEYS = """\
time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]
1.0,3.0,3.0
2.9,3.0,3.0
"""


@contextmanager
def run(
    here: World, folder: Path, *more: str
) -> Iterator[Callable[[], tuple[int, str]]]:
    """A team's experiment, in lock-step, in a process of its own.

    Gives what waits for its end: its exit status, and what it said.
    """
    (folder / "hers.toml").write_text(RUN)
    (folder / "keys.csv").write_text(KEYS)
    words = "run", "hers.toml", "--fabric", "hers", "--elsewhere", "robot/w7"
    running = subprocess.Popen(
        command(*words, *more),
        cwd=folder,
        env=os.environ | {"REMS_ROUTER": here.endpoint},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )

    def ended() -> tuple[int, str]:
        out, _ = running.communicate(timeout=90)
        return running.returncode, out

    try:
        yield ended
    finally:
        running.kill()
        running.communicate()


def borrow(home: Fabric) -> bool:
    try:
        return home.lend("robot/w7", "hers", {"command": "input/keys"}) == "hers"
    except FabricError:  # the run begins only now
        return False


def test_a_run_borrows_it(here: World, tmp_path: Path) -> None:
    """A closed one: its robot obeys an input, is recorded, and comes home."""
    here.clock()
    here.robot()
    home = here.fabric()
    until(lambda: row(home), LONG)
    with run(here, tmp_path) as ended:
        until(lambda: borrow(home), LONG)
        status, said = ended()
    assert status == 0, said
    until(lambda: lent(home) == "", LONG)
    drive(home)
    rows = (tmp_path / "runs" / "hers" / "w7.csv").read_text().splitlines()
    assert len(rows) > 100
    names, last = rows[0].split(","), rows[-1].split(",")
    values = dict(zip(names, map(float, last), strict=True))
    (far,) = (value for name, value in values.items() if name.startswith("state/x"))
    assert 0.05 < far < 0.3  # 3 rad/s of 20 mm wheels for some seconds


def test_a_run_whose_robot_is_taken_back_says_so(here: World, tmp_path: Path) -> None:
    here.clock()
    here.robot()
    home = here.fabric()
    until(lambda: row(home), LONG)
    with run(here, tmp_path, "--pace", "0.2") as ended:
        until(lambda: borrow(home), LONG)
        team = here.fabric("hers")
        until(lambda: row(team), LONG)
        assert home.take_back("robot/w7") == "rems"
        status, said = ended()
    assert status == 1
    assert "robot/w7: was returned to 'rems'" in said
    drive(home)
