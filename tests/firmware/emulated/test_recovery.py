"""It never gives up: the same faults as of the posix port, over a session from Python.

What is promised is held by the slow tests, on a quiet machine; the others print it. Its
Wi-Fi and its names are this machine's own: they are tested on the posix port alone.
"""

import sys
from pathlib import Path

import pytest

from tests.firmware.posix.faults import BACK, FAULTS, STANDS, trial, wait_until_listed
from tests.firmware.posix.scene import Scene

SHORT = ("router killed", "router frozen 10 s", "router at another address")
LONG = ("router frozen 60 s", "half-open", "dropped")
#: how often the router is killed by the long test, and how many bytes and things open
#: the robot may have more in the end
TIMES, GROWTH, OPEN = 100, 4_000_000, 4

linux = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="Only Linux tells what it takes."
)


def endure(scene: Scene, name: str, *, times: int = 1, strict: bool = True) -> None:
    """Do it so often, and print how long it took."""
    for _ in range(times):
        found = trial(scene, FAULTS[name])
        print(f"{name}: stood after {found.stood:.2f} s, back in {found.back:.2f} s")
        if strict:
            assert found.stood <= STANDS
            assert found.back <= BACK


@pytest.mark.parametrize("name", SHORT)
def test_it_stands_still_and_is_back(scene: Scene, name: str) -> None:
    FAULTS[name].prepare(scene)
    endure(scene, name, strict=False)
    wait_until_listed(scene)


@pytest.mark.slow
@linux
@pytest.mark.parametrize("name", [*SHORT, *LONG])
def test_as_soon_as_promised(scene: Scene, name: str) -> None:
    FAULTS[name].prepare(scene)
    endure(scene, name)
    wait_until_listed(scene)


def opened(pid: int) -> int:
    """How many threads and files a process has."""
    folder = Path(f"/proc/{pid}")
    return len([*(folder / "task").iterdir()]) + len([*(folder / "fd").iterdir()])


@pytest.mark.slow
@pytest.mark.timeout(3600)
@linux
def test_killed_a_hundred_times(scene: Scene) -> None:
    FAULTS["router killed"].prepare(scene)
    endure(scene, "router killed", times=TIMES // 10)
    robot = scene.robot
    before = robot.resident(), opened(robot.process.pid)
    endure(scene, "router killed", times=TIMES - TIMES // 10)
    after = robot.resident(), opened(robot.process.pid)
    print(f"bytes, threads and files: {before}; in the end {after}")
    assert after[0] < before[0] + GROWTH
    assert after[1] <= before[1] + OPEN
