"""`restart = 3` and `rems agent start --restart 3`: who crashed is started again."""

import os
from pathlib import Path

from tests.agents.runs import WAS_KILLED, free_port, until
from tests.cli.conftest import LAB, fabric, robot, row, text, ticks
from tests.commands import Run, Start
from tests.signals import KILL, KILLED


def test_on_an_open_fabric(start: Start) -> None:
    start("router", "serve", "--listen", f"tcp/127.0.0.1:{free_port()}")
    with fabric() as here:
        alice = robot(start, "alice", "--restart", "1")
        ticks(here, "robot/alice")

        def pid() -> int:
            found = row(here, "robot/alice")
            return int(found["host"].rpartition(":")[2]) if found else 0

        first = until(pid)
        os.kill(first, KILL)
        second = until(lambda: pid() not in (0, first) and pid())
        ticks(here, "robot/alice")
        os.kill(second, KILL)
        _, said = alice.communicate(timeout=30)
    assert alice.returncode == 1
    assert said.splitlines()[-2:] == [
        f"robot/alice crashed ({KILLED}); started again, 1 of 1",
        f"rems: robot/alice: {WAS_KILLED} (R0522)",
    ]


def test_ctrl_c_while_it_waits_to_start_again(start: Start) -> None:
    start("router", "serve", "--listen", f"tcp/127.0.0.1:{free_port()}")
    with fabric() as here:
        alice = robot(start, "alice", "--restart", "3")
        found = until(lambda: row(here, "robot/alice"))
        os.kill(int(found["host"].rpartition(":")[2]), KILL)
        said = alice.stderr
        assert said is not None
        until(lambda: "1 of 3" in said.readline())
        assert "Traceback" not in text(alice)


def test_in_a_file(folder: Path, rems: Run) -> None:
    twice = LAB.replace('name = "model"\n', 'name = "model"\nrestart = "twice"\n')
    (folder / "lab.toml").write_text(twice)
    done = rems("check", "lab.toml")
    assert done.returncode == 2
    assert done.stderr == (
        "rems: lab.toml, [[robot]] \"model\": restart is 'twice'; expected how often "
        "it is started again after a crash, such as 3. (R0408)\n"
    )
    (folder / "lab.toml").write_text(twice.replace('"twice"', "2"))
    assert rems("check", "lab.toml").returncode == 0
