"""`rems board provision`: what a teacher types, and what the robot keeps of it."""

import os
import sys
from pathlib import Path

import pytest

from rems_net.cable.provision import for_a_robot
from rems_net.errors import FabricError
from rems_net.router.finding import remembered
from tests.commands import Done, begun, command, finished, inside
from tests.firmware.console.robot import TIMEOUT, Robot

serial = pytest.importorskip("serial", reason="pyserial is not installed.")

SECRET = "correct horse"


def rems(*words: str, password: str | None = SECRET, said: str = "") -> Done:
    told = {} if password is None else {"REMS_WIFI_PASSWORD": password}
    done = inside("board", "provision", *words, typed=said, folder=None, **told)
    assert SECRET not in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done


def kept(robot: Robot) -> dict[str, str]:
    lines = robot.settings.read_bytes()[10:].decode().splitlines()
    return dict(line.split("=", 1) for line in lines)


def test_a_robot_is_told_all_at_once(robot: Robot) -> None:
    done = rems(
        *("--port", robot.port, "--name", "woodbot-7", "--fabric", "class"),
        *("--ssid", "lab-net", "--source", "input/keys"),
        *("--router", "192.168.1.20", "--router", "lab-pc"),
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        f"{robot.port}: woodbot, rems_net woodbot 0.1.0 on posix",
        "router: tcp/192.168.1.20:7447, tcp/lab-pc:7447",
        "fabric: class",
        "source: input/keys",
        "name: woodbot-7",
        "wifi: trying lab-net ...",
        "wifi: joined lab-net",
        "robot/woodbot-7 on class",
        "wifi: up",
    ]
    told = kept(robot)
    assert (told["name"], told["fabric"]) == ("woodbot-7", "class")
    assert (told["ssid"], told["password"]) == ("lab-net", SECRET)
    assert told["router"] == "tcp/192.168.1.20:7447"
    assert (told["router2"], told["router3"]) == ("tcp/lab-pc:7447", "")


def test_a_network_that_takes_a_user(robot: Robot) -> None:
    words = ("--port", robot.port, "--ssid", "eduroam", "--user", "anna@example.org")
    done = rems(*words, password="anna's own")
    assert (done.returncode, done.stderr) == (0, "")
    assert kept(robot)["user"] == "anna@example.org"


def test_names_are_utf8(robot: Robot) -> None:
    done = rems("--port", robot.port, "--ssid", "Büro", password="ümläut 7")
    assert (done.returncode, done.stderr) == (0, "")
    assert "wifi: joined Büro" in done.stdout


def test_a_wrong_password_is_told_as_the_robot_says_it(robot: Robot) -> None:
    done = rems("--port", robot.port, "--ssid", "lab-net", password="wrong horse")
    assert done.returncode == 2
    assert done.stderr == (
        "rems: lab-net refuses: the password, or the user, is wrong. The robot sees "
        "it; its settings are as they were. Try again. (R0706)\n"
    )
    assert kept(robot)["password"] == ""


@pytest.mark.parametrize(("ssid", "password"), [("lab-net", ""), ("open-net", SECRET)])
def test_a_network_of_another_security(robot: Robot, ssid: str, password: str) -> None:
    done = rems("--port", robot.port, "--ssid", ssid, password=password)
    assert done.stderr == (
        f"rems: {ssid} has another security: a password is missing, or one "
        "too many. The robot sees it; its settings are as they were. Try again. "
        "(R0706)\n"
    )


def test_a_network_that_is_not_there(robot: Robot) -> None:
    done = rems("--port", robot.port, "--ssid", "lab-nte")
    assert done.stderr == (
        "rems: lab-nte is not to be found here. The robot sees: lab-net, eduroam, "
        "open-net, Büro. It sees 2.4 GHz only, as every ESP32. (R0706)\n"
    )


def test_the_router_that_was_joined_is_the_robots(robot: Robot) -> None:
    remembered.remember("tcp/192.168.1.30:7447")
    done = rems("--port", robot.port, "--name", "woodbot-8")
    assert (done.returncode, done.stderr) == (0, "")
    assert "router: tcp/192.168.1.30:7447\n" in done.stdout
    assert kept(robot)["router"] == "tcp/192.168.1.30:7447"
    # one that only this laptop can reach is not passed on
    remembered.remember("tcp/127.0.0.1:7447")
    done = rems("--port", robot.port, "--name", "woodbot-8")
    assert kept(robot)["router"] == "tcp/192.168.1.30:7447"
    done = rems("--port", robot.port, "--router", "")
    assert "router: it looks for one by itself\n" in done.stdout
    assert kept(robot)["router"] == ""


def test_nothing_said_shows_the_robot(robot: Robot) -> None:
    done = rems("--port", robot.port)
    assert done.stdout.splitlines()[1:] == [
        "robot/woodbot on rems",
        "wifi: off",
        "sees lab-net (-48 dBm)",
        "sees eduroam (-55 dBm)",
        "sees open-net (-60 dBm, open)",
        "sees Büro (-80 dBm)",
    ]
    assert not robot.settings.exists()
    done = rems("--port", robot.port, "--ask", "test servos", "--ask", "get name")
    assert done.stdout.splitlines()[1:] == ["servos: all there", "name woodbot"]


def test_the_robots_own_sentences(robot: Robot) -> None:
    done = rems("--port", robot.port, "--name", "wood bot")
    assert (done.returncode, done.stderr) == (
        2,
        "rems: the robot does not take this name: expected 1 to 32 letters, digits, "
        "'_', '-' or '.', first a letter or a digit (R0706)\n",
    )


# -- the password -------------------------------------------------------------


def test_the_password_is_a_line_of_the_input(robot: Robot) -> None:
    words = ("--port", robot.port, "--ssid", "lab-net")
    done = rems(*words, password=None, said=f"{SECRET}\n")
    assert done.returncode == 0, done.stderr
    done = rems(*words, password=None)
    assert "set REMS_WIFI_PASSWORD" in done.stderr


def test_the_password_is_not_echoed(robot: Robot) -> None:
    pty = pytest.importorskip("pty", reason="There are no pseudo-terminals here.")
    master, slave = pty.openpty()
    words = command("board", "provision", "--port", robot.port, "--ssid", "lab-net")
    process = begun(words, screen=slave)  # getpass asks there, not where tests are
    os.close(slave)
    shown = b""
    while b"Password of lab-net" not in shown:
        shown += os.read(master, 4096)
    os.write(master, f"{SECRET}\n".encode())
    while b"wifi: up" not in shown:
        shown += os.read(master, 4096)
    assert process.wait(TIMEOUT) == 0
    os.close(master)
    assert SECRET.encode() not in shown


@pytest.mark.parametrize(
    ("words", "password", "sentence"),
    [
        (("--ssid", "x"), "short", "a password of a Wi-Fi network has at least 8"),
        (("--ssid", "x"), "x" * 65, "a password has 64 bytes at most"),
        (("--ssid", ""), SECRET, "a network's name has 1 to 32 bytes"),
        (("--user", "anna"), SECRET, "--user is of a network: write --ssid, too"),
        (("--router", "127.0.0.1"), SECRET, "means this laptop only on this laptop"),
        (("--router", "tls/lab-pc"), SECRET, "a robot speaks plain tcp only"),
        (("--router", "a") * 4, SECRET, "a robot remembers 3 routers at most"),
        (("--fabric", "a/b"), SECRET, "--fabric is 'a/b'"),
    ],
)
def test_mistakes_are_told_before_a_port_is_opened(
    words: tuple[str, ...], password: str, sentence: str
) -> None:
    done = rems("--port", "/dev/none", *words, password=password)
    assert done.returncode == 2
    assert sentence in done.stderr


def test_addresses_for_a_robot() -> None:
    assert for_a_robot("192.168.1.20") == "tcp/192.168.1.20:7447"
    assert for_a_robot("tcp/lab-pc:1#iface=eth0") == "tcp/lab-pc:1"
    assert for_a_robot("cable") == "cable"
    with pytest.raises(FabricError, match="no address of a router"):
        for_a_robot("a b")


# -- the port -----------------------------------------------------------------


def test_ports_are_listed() -> None:
    done = rems("--name", "w7")
    assert done.returncode == 2
    assert done.stderr.startswith("rems: the port is missing; write --port. There ")


def test_a_port_that_is_not_there() -> None:
    done = rems("--port", "/dev/ttyUSB99")
    assert done.returncode == 2
    assert done.stderr.startswith("rems: there is no port /dev/ttyUSB99. There ")


def test_a_port_that_is_in_use(robot: Robot) -> None:
    with serial.Serial(robot.port, exclusive=True):
        done = rems("--port", robot.port)
    assert f"another program uses {robot.port}: a serial monitor" in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such groups.")
def test_a_port_that_is_not_permitted(tmp_path: Path) -> None:
    port = tmp_path / "port"
    port.touch()
    port.chmod(0)
    code = (
        "import os, sys; from rems_net.cable.port import open_port; import serial\n"
        "os.geteuid() or os.setuid(65534)  # root may open everything\n"
        "open_port(sys.argv[1])"
    )
    done = finished([sys.executable, "-c", code, port])
    assert f"you may not open {port}. " in done.stderr
    assert "ask who runs this machine for `sudo " in done.stderr


def test_nobody_answers() -> None:
    pty = pytest.importorskip("pty", reason="There are no pseudo-terminals here.")
    master, slave = pty.openpty()
    port = os.ttyname(slave)
    done = rems("--port", port)
    os.close(master)
    os.close(slave)
    assert done.stderr.startswith(f"rems: no robot answers at {port}. Is it the Wood")
