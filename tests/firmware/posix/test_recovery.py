"""It never gives up: it stands still when it is cut off, and is back by itself."""

import shutil
import sys
import time
from pathlib import Path
from threading import Event

import pytest

from tests.firmware.posix.faults import (
    BACK,
    FAULTS,
    STANDS,
    TIMEOUT,
    trial,
    wait_until_listed,
)
from tests.firmware.posix.robot import Robot
from tests.firmware.posix.scene import NAME, Scene
from tests.reliability.rig.rig import Rig, missing

#: as a default route would: where multicast goes
ROUTE = ("ip", "route", "add", "224.0.0.0/4", "dev", "eth0")
HUB = "tcp/10.77.0.1:7447"
SLOW = ("router frozen 10 s", "router frozen 60 s")
#: how often the router is killed by the short test, and by the long one
SHORT, LONG = 3, 100
#: bytes of heap by which it may differ from one killed router to another: what is on
#: its way when it is asked, at most two messages
SLACK = 8192


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in FAULTS],
)
def test_it_stands_still_and_is_back(scene: Scene, name: str) -> None:
    if name == "dropped" and not sys.platform.startswith("linux"):
        pytest.skip("only Linux drops who knocks at a full queue")
    fault = FAULTS[name]
    fault.prepare(scene)
    found = trial(scene, fault)
    assert found.stood <= STANDS
    assert found.back <= BACK
    wait_until_listed(scene)


def killed(scene: Scene, times: int) -> None:
    """Kill the router so often; its heap grows no more after the first ones."""
    fault = FAULTS["router killed"]
    fault.prepare(scene)
    heap = []
    for _ in range(times):
        found = trial(scene, fault)
        assert found.stood <= STANDS
        assert found.back <= BACK
        heap.append(scene.robot.heap())
    settled = heap[max(1, times // 10) :]
    assert max(settled) - settled[0] < SLACK, heap


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it asks glibc")
def test_killed_thrice(scene: Scene) -> None:
    killed(scene, SHORT)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it asks glibc")
def test_killed_a_hundred_times(scene: Scene) -> None:
    killed(scene, LONG)


@pytest.mark.root
@pytest.mark.skipif(bool(missing()), reason=missing())
@pytest.mark.skipif(shutil.which("ip") is None, reason="there is no ip (iproute2)")
def test_it_finds_its_router_and_is_cut_off(woodbot: Path, tmp_path: Path) -> None:
    """Told no address, it looks for one; then packets vanish, in both directions."""
    with Rig(tmp_path / "rig") as rig:
        rig.connect("hub", "bot", "desk")
        fabric = rig.rems("router", "serve", "--listen", HUB, "--no-qr", machine="hub")
        fabric.wait_for("^Open fabric", TIMEOUT)
        rig.start("ip", ROUTE, "bot").process.wait()
        robot = Robot(rig, woodbot, NAME, "", machine="bot")
        rig.module("tests.firmware.posix.driver", HUB, NAME, machine="desk")
        robot.moved(0.0, TIMEOUT)
        for _ in range(2):
            at = time.monotonic()
            rig.cut("bot")
            assert robot.stood(at, TIMEOUT) - at <= STANDS
            Event().wait(12.0)
            back = time.monotonic()
            rig.heal("bot")
            assert robot.moved(back, TIMEOUT) - back <= BACK
