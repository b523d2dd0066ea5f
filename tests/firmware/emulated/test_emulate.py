"""`rems board emulate` as a user has it: robots like any other, from a shell."""

import json
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rems_net.firmware import port
from tests.agents.runs import WAS_KILLED, alive, until
from tests.commands import begun, command, inside as rems
from tests.firmware.emulated.scene import Serve, compiled, ported
from tests.interrupts import interrupt
from tests.signals import KILL


@pytest.fixture
def serve(monkeypatch: pytest.MonkeyPatch) -> Iterator[Serve]:
    compiled()
    with Serve() as serve:
        monkeypatch.setenv("REMS_ROUTER", serve.endpoint)
        yield serve


class Emulate:
    """`rems board emulate` in a process of its own, and what it prints."""

    def __init__(self, *args: str, how: tuple[str, ...] = ("--library",)):
        self.process = begun(command("board", "emulate", *args, *how))

    def end(self) -> tuple[str, str]:
        """Ctrl+C; and all that it said."""
        interrupt(self.process)
        return self.process.communicate(timeout=30)


@pytest.fixture
def emulate() -> Iterator[Callable[..., Emulate]]:
    running: list[Emulate] = []

    def start(*args: str) -> Emulate:
        running.append(Emulate(*args))
        return running[-1]

    yield start
    for one in running:
        if one.process.poll() is None:
            one.end()


def listed() -> dict[str, Any]:
    rows = json.loads(rems("list", "--json").stdout or "[]")
    return {row["agent"]: row for row in rows}


def value(path: str) -> float:
    found = json.loads(rems("get", path, "--json").stdout)
    return float(next(iter(found.values()))["value"])


def test_it_is_a_robot_like_any_other(
    serve: Serve, emulate: Callable[..., Emulate]
) -> None:
    running = emulate("woodbot", "--name", "woodbot-7")
    until(lambda: "robot/woodbot-7" in listed(), 30)
    assert "rad" in rems("get", "robot/woodbot-7/state").stdout
    assert rems("call", "robot/woodbot-7", "blink").returncode == 0
    assert re.search(
        r"^robot/woodbot-7 received the newest tick at most \d+ ms after it was made; "
        r"its own clock is \d+\.\d{3} s (behind|ahead of) the fabric's time\.$",
        rems("why", "robot/woodbot-7").stdout,
        re.MULTILINE,
    )
    stopped = rems("stop")
    assert stopped.returncode == 0, stopped.stderr
    assert "woodbot-7" in stopped.stdout
    assert rems("stop", "--release").returncode == 0
    taken = rems("board", "emulate", "woodbot", "--name", "woodbot-7", "--library")
    assert taken.returncode == 2
    assert "There is a robot/woodbot-7 already, on 'rems'" in taken.stderr
    out, error = running.end()
    assert out.splitlines() == ["woodbot-7    is on the fabric"]
    assert error == (
        f"rems: 1 Woodbot at {serve.endpoint}, by the shared library; Ctrl+C ends it\n"
    )
    assert running.process.returncode == 0


def test_it_runs_over_zenoh_pico_where_that_is(serve: Serve) -> None:
    ported()  # which builds it: nobody waits for that, and says so
    running = Emulate("woodbot-fleet", "-n", "2", how=())
    names = {"robot/woodbot-1", "robot/woodbot-2"}
    until(lambda: names <= listed().keys(), 30)
    assert rems("call", "robot/woodbot-2", "blink").returncode == 0
    out, error = running.end()
    assert running.process.returncode == 0
    assert sorted(out.splitlines()) == [
        f"woodbot-{i}    is on the fabric" for i in (1, 2)
    ]
    assert error == (
        f"rems: 2 Woodbots at {serve.endpoint}, over zenoh-pico; Ctrl+C ends them\n"
    )


def test_without_cmake_there_is_no_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert port.program() is None


def test_a_fleet_has_numbers(serve: Serve, emulate: Callable[..., Emulate]) -> None:
    running = emulate("woodbot-fleet", "-n", "3", "--together", "2")
    names = {f"robot/woodbot-{i}" for i in (1, 2, 3)}
    until(lambda: names <= listed().keys(), 30)
    out, error = running.end()
    # The last may be listed before it has said so.
    told = {f"woodbot-{i}    is on the fabric" for i in (1, 2, 3)}
    assert len(told & {*out.splitlines()}) >= 2
    assert told >= {*out.splitlines()}
    assert "warning" not in error


def children(pid: int) -> list[int]:
    text = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii")
    return [int(one) for one in text.split()]


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="Only Linux tells of children.")
def test_a_crash_spreads_no_further_than_its_process(
    serve: Serve, emulate: Callable[..., Emulate]
) -> None:
    running = emulate("woodbot-fleet", "-n", "2", "--together", "1")
    names = {"robot/woodbot-1", "robot/woodbot-2"}
    until(lambda: names <= listed().keys(), 30)
    first, second = children(running.process.pid)
    os.kill(first, KILL)
    assert running.process.stdout is not None
    line = ""
    while "ended" not in line:
        line = running.process.stdout.readline()
        assert line
    assert line == f"woodbot-1    ended: the process {WAS_KILLED}\n"
    assert alive(second)
    running.end()
    assert running.process.returncode == 1
    until(lambda: not alive(second))


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="Only Linux tells of children.")
def test_nobody_is_left_behind(serve: Serve, emulate: Callable[..., Emulate]) -> None:
    running = emulate("woodbot-fleet", "-n", "2", "--together", "1")
    pids = until(lambda: len(p := children(running.process.pid)) == 2 and p, 30)
    running.process.kill()
    running.process.communicate()
    until(lambda: not any(map(alive, pids)))


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("woodbot-fleet", "-n", "0"), "-n is 0; expected 1 to 1000 robots."),
        (
            ("woodbot", "-n", "3"),
            "-n is for a fleet: rems board emulate woodbot-fleet -n 3",
        ),
        (("woodbot", "--name", "a b"), "--name is 'a b'; a name has 1 to 63"),
        (("woodbot-fleet", "--name", "x" * 32), "a Woodbot keeps 32 letters"),
        (("woodbot-fleet", "--together", "0"), "--together is 0; expected at least 1."),
        (("woodbot", "--to", "keys"), "--to is 'keys'"),
        (("woodbots",), "cannot be emulated; expected one of woodbot, woodbot-fleet, "),
        (("woodbot", "--port", "COM3"), "a woodbot is on the fabric."),
    ],
)
def test_mistakes(args: tuple[str, ...], says: str) -> None:
    done = rems("board", "emulate", *args)
    assert done.returncode == 2
    assert says in done.stderr


def test_without_a_fabric() -> None:
    done = rems("board", "emulate", "woodbot")
    assert done.returncode != 0
    assert "No fabric 'rems' is running on this machine." in done.stderr
