"""A Woodbot's cable: `rems board` is under Wine, the compiled firmware on Linux."""

import os
import subprocess
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rems_net.router.finding.address import host_and_port
from rems_net.router.mail import Mailbox
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Router, until
from tests.firmware.console.cable import BadCable
from tests.firmware.console.robot import CONSOLE, Robot, build
from tests.firmware.console.test_bridge import heard, opened
from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.timeout(300)]

PORT = "COM5"
CABLE = "cable/cable.c", "cable/console_side.c", "cable/cable_socket.c"
#: carries a robot's sessions, as `rems board bridge` does once it knows the robot
BRIDGE = """
import sys
from rems_net.cable.bridge import Bridge
from rems_net.cable.port import open_port
line = open_port(sys.argv[1])
print("open", flush=True)
try:
    Bridge(line, (sys.argv[2], int(sys.argv[3])), lambda t: print(t, flush=True)).run()
except OSError as error:
    print("broken", flush=True)
"""


@contextmanager
def plugged(windows: Windows, port: str) -> Iterator[None]:
    """Give a pseudo-terminal the name of a port of Windows."""
    link = windows.prefix / "dosdevices" / PORT.lower()
    link.unlink(missing_ok=True)
    link.symlink_to(port)
    yield
    link.unlink()


@pytest.fixture
def robot(windows: Windows, tmp_path: Path) -> Iterator[Robot]:
    """A robot's console at the port."""
    made = Robot(build(tmp_path, "test_console", CONSOLE), tmp_path / "settings")
    try:
        with plugged(windows, made.port):
            yield made
    finally:
        made.close()


def test_the_console(windows: Windows, robot: Robot, tmp_path: Path) -> None:
    """What answers is listed, is told its settings, and then goes by the cable."""
    board = ["board", "provision", "--port", PORT]
    assert "Woodbot woodbot (rems_net" in windows.rems("board", "ports", PORT)
    refused = windows.rems("board", "bridge", PORT, cwd=tmp_path, fails=True)
    assert f"the robot at {PORT} goes by Wi-Fi. For the cable, type: " in refused
    told = windows.rems(*board, "--name", "w7", "--router", "cable", cwd=tmp_path)
    assert "name: w7\n" in told
    assert "robot/w7 on rems" in told
    with windows.begin("board", "bridge", PORT, "localhost", cwd=tmp_path) as bridge:
        assert bridge.stdout is not None
        line = bridge.stdout.readline()
        assert line == f"{PORT} <-> tcp/localhost:7447; Ctrl+C ends it\n"
        bridge.kill()


def test_a_session_goes_through(windows: Windows, tmp_path: Path) -> None:
    """Both ways, and beside lines of its console; then the cable is pulled out."""
    core = "settings/crc32", "console/improv"
    program = build(tmp_path, "test_cable", core, *CABLE)
    robot, middle, other, here = ends = (*os.openpty(), *os.openpty())
    for end in (middle, here):
        tty.setraw(end)
    cable = BadCable((middle, other), loss=0.0)
    with (
        Router() as router,
        plugged(windows, os.ttyname(here)),
        subprocess.Popen(
            [program], stdin=robot, stdout=robot, stderr=subprocess.PIPE, text=True
        ) as process,
    ):
        host, port = host_and_port(router.endpoint)
        words = windows.exe, "-W", "error", "-c", BRIDGE, PORT, host, str(port)
        with windows.start(*words) as bridge:
            assert bridge.stdout is not None
            assert bridge.stdout.readline() == "open\n"
            assert process.stderr is not None
            locator = process.stderr.readline().strip()
            with Session(Link(router.endpoint)) as a, opened(locator) as b:
                assert "session goes through" in bridge.stdout.readline()
                there, back = Mailbox(), Mailbox()
                a.watch("rems/robot/w7/state", there)
                b.watch("rems/robot/w7/command", back)
                heard(there, b, "rems/robot/w7/state", b"\xc0\xdb" * 50)
                heard(back, a, "rems/robot/w7/command", b"\xdb\xdc\xc0" * 50)
                heard(there, b, "rems/robot/w7/state", bytes(range(256)) * 15)
            assert "a session is over" in bridge.stdout.readline()
            cable.close()
            for end in ends:
                os.close(end)
            # Wine may list its handles when a terminal goes.
            assert bridge.communicate(timeout=60)[0].endswith("broken\n")
    until(lambda: process.returncode == 0)
