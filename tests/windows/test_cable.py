"""A cable to a robot: the driver's run is under Wine, the emulated device on Linux.

Wine lets two programs open one port, so Windows' refusal of a port in use is not tried
here; whether any process still has the port open is seen on Linux.
"""

import os
import re
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from rems_net.emulators.create2.device import Create2Device
from rems_net.emulators.dynamixel.robots import DynabotServos
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from tests.agents.runs import alive, relatives, until
from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.timeout(300)]
#: s. The age at which a command is too old, and what the fabric may take besides.
LIMIT = 0.6
#: s. What two busy cores may take besides.
BUSY = 0.5
#: s. STOP is there at once; `rems stop` has to start first.
START = 30.0
PORTS = {"create2": "COM3", "dynabot": "COM4"}
DEVICES: dict[str, Callable[[], Any]] = {
    "create2": lambda: Create2Device(boot=0.2),
    "dynabot": DynabotServos,
}
DRIVES: dict[str, Callable[[Any], bool]] = {
    "create2": lambda device: bool(device.body.left or device.body.right),
    "dynabot": lambda device: bool(device.left.radians or device.right.radians),
}
LAB = """\
experiment = { name = "lab", dt = "50 ms", duration = "600 s", pace = 1 }
input = [{ name = "keys", type = "csv", options.file = "keys.csv", restart = 1 }]
"""
ROBOT = """
[[robot]]
name = "{name}"
definition = "{name}"
driver = "{name}"
command = "input/keys"
restart = 1
options = {{ port = "{port}" }}
"""
KEYS = """\
time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]
600.0,3.0,2.0
"""
#: prints Windows' number of its process, which is `rems run lab.toml`
RUN = """
import os, sys
from rems_net.cli import main
print(os.getpid(), flush=True)
sys.exit(main(["run", "lab.toml"]))
"""


class Bench:
    """Emulated devices at COM3 and COM4, and a run under Wine that drives them."""

    def __init__(
        self, windows: Windows, folder: Path, devices: dict[str, Emulator[Any]]
    ):
        self.windows, self.folder, self.devices = windows, folder, devices
        self.mark = f"CABLE_MARK={folder}"
        lab = LAB + "".join(ROBOT.format(name=n, port=p) for n, p in PORTS.items())
        (folder / "lab.toml").write_text(lab, encoding="utf-8")
        (folder / "keys.csv").write_text(KEYS, encoding="utf-8")
        #: `rems list` looks for runs in a folder of this test
        self.more = {"CABLE_MARK": str(folder), "XDG_RUNTIME_DIR": str(folder / "own")}
        python = windows.root / "python.exe"
        self.run = windows.start(
            python, "-W", "error", "-c", RUN, cwd=folder, **self.more
        )
        #: what it prints
        self.lines: list[str] = []
        self.reader = Thread(target=self._read, daemon=True)
        self.reader.start()
        self.all_drive()

    def _read(self) -> None:
        assert self.run.stdout is not None
        self.lines.extend(self.run.stdout)

    def close(self) -> None:
        """End what is left."""
        self.windows.end()
        self.reader.join()
        self.run.communicate()

    def drives(self, name: str) -> bool:
        return DRIVES[name](self.devices[name].device)

    def all_drive(self) -> None:
        """Wait until all devices are driven."""
        try:
            until(lambda: all(map(self.drives, PORTS)), 60)
        except AssertionError:
            raise AssertionError("".join(self.lines)) from None

    def stood(self, names: tuple[str, ...], since: float) -> float:
        """Wait until these devices stand; return after how many seconds."""
        until(lambda: not any(map(self.drives, names)))
        return time.monotonic() - since

    def rems(self, *words: str) -> str:
        """Run `rems` beside the run."""
        return self.windows.rems(*words, cwd=self.folder, **self.more)

    def pids(self) -> dict[str, str]:
        """Return Windows' number of each agent's process."""
        listed = self.rems("list")
        return dict(re.findall(r"^(\w+/\w+) .*:(\d+) ", listed, re.MULTILINE))

    def kill(self, pid: str) -> float:
        """Kill a process of Windows; return when it was gone."""
        before = relatives(self.mark)
        with self.windows.start("taskkill", "/F", "/PID", pid) as killer:
            while all(map(alive, before)):
                assert killer.poll() is None or not killer.returncode, pid
            gone = time.monotonic()
            killer.communicate()
        return gone

    def users(self) -> list[int]:
        """Return the processes, but this one, that have a device's port open."""
        lines: list[Any] = [device.line for device in self.devices.values()]
        ports = {os.ttyname(line._slave) for line in lines}
        found = []
        for folder in Path("/proc").glob("[0-9]*/fd"):
            try:
                links = {str(link.readlink()) for link in folder.iterdir()}
            except OSError:
                continue
            if folder.parent.name != str(os.getpid()) and ports & links:
                found.append(int(folder.parent.name))
        return found


@pytest.fixture(scope="module")
def bench(
    windows: Windows, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Bench]:
    """One run, to which one thing after another happens; the last test ends it."""
    # Wine's server gets a signal when a terminal goes, and then prints a long list; and
    # it starts its services, which are not of the run.
    windows.end()
    for words in (["wineserver", "-p"], ["wine", "cmd", "/c", "ver"]):
        quiet = subprocess.DEVNULL
        environment = windows.environment
        subprocess.run(words, env=environment, check=True, stdout=quiet, stderr=quiet)
    with ExitStack() as stack:
        devices = {}
        for name, port in PORTS.items():
            link = windows.prefix / "dosdevices" / port.lower()
            link.unlink(missing_ok=True)
            emulator = Emulator(DEVICES[name](), Terminal(link))
            devices[name] = stack.enter_context(emulator)
        bench = Bench(windows, tmp_path_factory.mktemp("cable"), devices)
        stack.callback(bench.close)
        yield bench


def test_a_cable_that_is_pulled_out(bench: Bench) -> None:
    """Servos stop by themselves; a Create 2 has no watchdog (docs/hardware.md)."""
    begun = time.monotonic()
    for device in bench.devices.values():
        device.order("unplug 3")
    assert bench.stood(("dynabot",), begun) < LIMIT + BUSY
    assert bench.drives("create2")
    until(lambda: sum("is back after" in line for line in bench.lines) == len(PORTS))
    bench.all_drive()


def test_stop(bench: Bench) -> None:
    begun = time.monotonic()
    bench.rems("stop")
    assert bench.stood((*PORTS,), begun) < START
    bench.rems("stop", "--release")
    bench.all_drive()


@pytest.mark.parametrize(
    ("agent", "names"),
    [
        ("input/keys", (*PORTS,)),
        ("robot/create2", ("create2",)),
        ("robot/dynabot", ("dynabot",)),
    ],
)
def test_a_process_that_is_killed(
    bench: Bench, agent: str, names: tuple[str, ...]
) -> None:
    """The commander, or a host: it is started again, and opens its port at once."""
    gone = bench.kill(bench.pids()[agent])
    assert bench.stood(names, gone) < LIMIT + BUSY
    bench.all_drive()


def test_a_run_that_is_killed(bench: Bench) -> None:
    """Its other processes end, too, and give the ports back."""
    assert len(bench.users()) > 1
    gone = bench.kill(bench.lines[0].strip())
    assert bench.stood((*PORTS,), gone) < LIMIT + BUSY
    until(lambda: not relatives(bench.mark))
    assert bench.users() == []
