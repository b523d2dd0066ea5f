"""What browsers do: Improv's own client from npm, and the page of deploy/provision."""

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.firmware.console.robot import Robot

HERE = Path(__file__).parent
PAGE = HERE.parents[2] / "deploy" / "provision" / "index.html"


def node(script: str, *words: str | Path) -> dict[str, Any]:
    """What a script prints, as JSON."""
    if shutil.which("node") is None:
        pytest.skip("There is no node here, which runs the browser's side.")
    done = subprocess.run(
        ["node", HERE / script, *words],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout)
    return said


def test_improvs_own_client_sets_the_network(client: Path, robot: Robot) -> None:
    said = node("sdk.mjs", client, robot.port)
    assert said["info"] == {
        "firmware": "rems_net woodbot",
        "version": "0.1.0",
        "chipFamily": "posix",
        "name": "woodbot-3",  # as it was set at the end
        "osName": None,
        "osVersion": None,
    }
    assert said["ready"] == 2
    assert said["networks"] == [
        {"name": "Büro", "rssi": -80, "secured": True},
        {"name": "eduroam", "rssi": -55, "secured": True},
        {"name": "lab-net", "rssi": -48, "secured": True},
        {"name": "open-net", "rssi": -60, "secured": False},
    ]
    assert (said["refused"], said["error"]) == ("UNABLE_TO_CONNECT", 3)
    assert said["provisioned"] == 4
    assert said["states"] == [2, 3, 2, 3, 4, 4]
    assert (said["name"], said["bad"]) == ("woodbot-3", "BAD_HOSTNAME")
    assert said["unknown"] == "UNKNOWN_RPC_COMMAND"
    assert said["url"] is None
    assert said["said"] == []
    assert b"ssid=lab-net\n" in robot.settings.read_bytes()


def test_the_page_tells_a_robot_all(robot: Robot) -> None:
    said = node("page.mjs", PAGE, robot.port)
    assert said["info"] == ["rems_net woodbot", "0.1.0", "posix", "woodbot"]
    assert said["networks"][0] == {"ssid": "lab-net", "rssi": -48, "closed": True}
    assert [one["ssid"] for one in said["networks"]] == [
        *("lab-net", "open-net", "eduroam", "Büro")
    ]
    assert said["refused"] == "lab-net refuses: the password, or the user, is wrong"
    again = ["router: tcp/192.168.1.20:7447", "name: woodbot-7"]
    assert said["told"] == [
        *(*again, "wifi: trying lab-net ..."),
        *(*again, "wifi: trying lab-net ...", "wifi: joined lab-net"),
        *("wifi: trying eduroam ...", "wifi: joined eduroam"),
    ]
    assert said["bad"].startswith("the robot does not take this name: expected 1 to 32")
    assert said["broken"] == "no line ends in a value"
    assert said["status"] == ["robot/woodbot-7 on rems", "wifi: up"]
    assert said["sensors"] == ["sensors: all there"]
    assert "horse" not in json.dumps(said)


def test_the_page_needs_nothing_but_itself() -> None:
    """Nothing is loaded from anywhere, and the browser holds it to that."""
    text = PAGE.read_text(encoding="utf-8")
    assert "default-src 'none'" in text
    assert not re.findall(r"https?://|\bsrc=|\bhref=|\bimport\b|\bfetch\(", text)
