"""A Woodbot at a USB cable: told where it belongs, or by the cable alone."""

import time
from contextlib import suppress
from pathlib import Path

import pytest

import rems_net
from rems_net.errors import FabricError
from tests.firmware.posix.scene import NAME, Scene
from tests.firmware.posix.test_driven import here
from tests.reliability.rig.programs import Program, until

pytest.importorskip("serial", reason="pyserial is not installed.")
#: each starts half a dozen processes, one after the other
pytestmark = pytest.mark.timeout(400)

SECRET = "correct-horse"


def port(process: Program) -> str:
    return process.wait_for(r"^console (\S+)$")[1]


def test_it_is_told_by_provision_and_is_there(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No name, no network, no router at the start; no recompiling, no restart."""
    scene.serve()
    kept = tmp_path / "settings"
    words = ["--settings", str(kept), "--console", "pty", "--control", "-"]
    words += ["--do", f"air lab-net {SECRET}"]
    robot = scene.rig.start("robot", [str(scene.program), *words])
    monkeypatch.setenv("REMS_WIFI_PASSWORD", "wrong-horse")
    told = (
        "board",
        "board",
        "provision",
        "--port",
        port(robot),
        "--name",
        NAME,
        "--ssid",
        "lab-net",
    )
    refused = provision(scene, *told)
    assert "lab-net refuses: the password, or the user, is wrong." in refused.text()
    monkeypatch.setenv("REMS_WIFI_PASSWORD", SECRET)
    # the test's router is on this machine alone: `rems board provision` would not have
    # it
    say(scene, port(robot), f"set router {scene.endpoint}")
    joined = provision(scene, *told)
    assert "wifi: joined lab-net" in joined.text()
    assert SECRET not in joined.text() + robot.text()
    until(lambda: listed(scene), "the robot", 60.0)
    # a wrong password, later on, is told too, and what worked comes back
    monkeypatch.setenv("REMS_WIFI_PASSWORD", "wrong-horse")
    assert "lab-net refuses" in provision(scene, *told).text()
    until(lambda: listed(scene), "the robot", 60.0)
    # it is stored: it comes back by itself
    robot.kill()
    scene.rig.start("again", [str(scene.program), *words])
    until(lambda: listed(scene), "the robot", 60.0)


def listed(scene: Scene) -> bool:
    with suppress(FabricError), rems_net.join(at=scene.endpoint) as fabric:
        return here(fabric)
    return False


def provision(scene: Scene, *words: str) -> Program:
    done = scene.rig.rems(*words)
    done.process.wait(60.0)
    return done


def say(scene: Scene, at: str, line: str) -> None:
    assert (
        "error"
        not in provision(
            scene, "board", "provision", "--port", at, "--ask", line
        ).text()
    )


def test_the_cable_is_its_network(scene: Scene) -> None:
    """Joined, driven, standing still when the bridge is killed, and back with it.

    The robot has a Wi-Fi, as the board has, and no network of it is stored.
    """
    scene.serve()
    robot = scene.start("--console", "pty", "--do", "air off", router="cable")
    at = port(robot.process)
    bridge = scene.rig.rems("board", "bridge", at, scene.endpoint)
    scene.drive()
    for _ in range(2):
        then = time.monotonic()
        bridge.kill()
        assert robot.stood(then) - then <= 0.6
        bridge = scene.rig.rems("board", "bridge", at, scene.endpoint)
        robot.moved(time.monotonic(), 60.0)
    # frozen: what is in the cable is late, and obeyed by nobody
    then = time.monotonic()
    bridge.freeze()
    assert robot.stood(then) - then <= 0.6
    bridge.thaw()
    robot.moved(time.monotonic(), 60.0)
