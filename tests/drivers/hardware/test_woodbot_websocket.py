"""The driver of the class's first firmware, and that firmware, over real sockets."""

import csv
import http.server
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net import Definition, Experiment, In, Out, Schema
from rems_net.agents.robot import combine
from rems_net.defdict import angle, angular_velocity, length
from rems_net.drivers.hardware import woodbot_websocket as driver
from rems_net.drivers.hardware.websocket import WebSocket
from rems_net.drivers.hardware.woodbot_websocket import OriginalFirmware
from rems_net.emulators import woodbot_websocket as firmware
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.websocket import WebSocketPort
from rems_net.emulators.woodbot_websocket import QUIRKS, OriginalWoodbot
from rems_net.errors import AgentError, FabricError, SchemaError
from rems_net.robots.woodbot import Woodbot
from tests.agents.runs import calm, until
from tests.drivers import alone

pytest.importorskip("websockets", reason="websockets is not installed")

Robot = combine(Woodbot, OriginalFirmware)
STAND, AHEAD = (90, 90), (0, 0)
TOP = 7.3
#: a driver that knows the servos
KNOWN = {"dead_band": 45 / 800, "saturation": 450 / 800}


@contextmanager
def emulated(*mended: str) -> Iterator[Any]:
    device = OriginalWoodbot(mended=mended)
    with Emulator(device, WebSocketPort()) as emulator:
        yield emulator


def opened(url: str, **options: Any) -> AbstractContextManager[Any]:
    return alone.opened(Robot("w", options={"url": url, **options}))


def drive(robot: Any, left: float, right: float, seconds: float = 0.05) -> None:
    """Tell it so again and again, as a host would."""
    alone.keep_for(robot, {"wheel/left": left, "wheel/right": right}, seconds)


def keep(robot: Any, until_true: Callable[[], Any], seconds: float = 30.0) -> None:
    """Drive it ahead until something is so."""
    end = calm() + seconds
    while not until_true():
        assert calm() < end, robot.figures()
        drive(robot, TOP, TOP)


def test_its_first_row_is_where_it_begins(tmp_path: Path) -> None:
    """The first tick of a free-running robot may come later than an output's."""
    begins = {"x": 0.25, "y": -0.5, "heading": 1.5}
    with emulated() as emulator:
        lab = Experiment("lab", dt="50 ms", duration="0.1 s", pace=1, record=False)
        where = {"url": emulator.where}
        lab.robot("w", "woodbot", "woodbot-ws", initial=begins, options=where)
        lab.output("log", "csv")
        lab.run(tmp_path)
    with (tmp_path / "w.csv").open(encoding="utf-8", newline="") as file:
        first, *_ = csv.DictReader(file)
    values = [float(first[f"state/{name}"]) for name in ("x [m]", "y [m]")]
    assert [*values, float(first["state/heading [rad]"])] == [*begins.values()]


@pytest.mark.parametrize("mended", [(), tuple(QUIRKS)])
def test_obeys_and_stands_at_the_end(
    mended: tuple[str, ...], capfd: pytest.CaptureFixture[str]
) -> None:
    """With all its quirks, and with none of them."""
    with emulated(*mended) as emulator:
        device = emulator.device
        with opened(emulator.where, **KNOWN) as robot:
            keep(robot, lambda: robot.state.x > 0.03)
            assert device.driven[0] == STAND
            assert device.driven[-1] == (90 - 51, 90 - 51)  # saturated, at 56 %
            drive(robot, -TOP / 2, TOP / 2, 0.3)
            drive(robot, 0.0, 0.0, 0.2)
            # What it reckons is where it is: it knows its servos.
            assert robot.state.x == pytest.approx(device.state.x, abs=0.015)
            assert robot.state.heading == pytest.approx(device.state.heading, abs=0.15)
            assert robot.sensors == Woodbot.sensors.schema()
        assert device.driven[-1] == STAND
    assert (
        "warning: robot/w reckons its state from its commands. It drives on where "
        "Wi-Fi fails, so stay near its switch\n"
    ) in capfd.readouterr().err


def test_the_angles_are_those_of_the_class_within_a_degree() -> None:
    """+100 % is 0, standing 90, -100 % 180. The class cuts fractions off."""
    robot: Any = Robot("w", options={"url": "ws://192.168.8.200"})
    robot.prepare()
    off = set()
    for percent in range(-100, 101):
        robot.command = {"wheel/left": percent / 100 * TOP, "wheel/right": 0.0}
        (angle,) = robot._servo(robot.command, "left")
        assert robot._servo(robot.command, "right") == bytes([90])
        off.add(angle - int(90 * (-percent / 100) + 90))
        if percent % 50 == 0:
            assert angle == 90 - percent * 90 // 100
    assert off == {0, 1}, "docs/hardware.md tells by how much they differ"


def test_another_client_leaves_and_it_goes_on() -> None:
    """The firmware stops for all then; within an exchange it is told again."""
    client = pytest.importorskip("websockets.sync.client")
    with emulated() as emulator, opened(emulator.where) as robot:
        device = emulator.device
        keep(robot, lambda: device.driven[-1:] == [AHEAD])
        with client.connect(emulator.where, proxy=None) as other:
            assert other.recv(timeout=5) == "Connected to "
            device.driven.clear()
        keep(robot, lambda: STAND in device.driven)
        keep(robot, lambda: device.driven[-1] == AHEAD)
        assert robot.figures()["reconnects"] == 0


def test_its_echoes_break_a_strict_client() -> None:
    """What the driver survives: another library, which is as strict as it may be."""
    client = pytest.importorskip("websockets.sync.client")
    closed = pytest.importorskip("websockets.exceptions").ConnectionClosedError
    with emulated() as emulator, client.connect(emulator.where, proxy=None) as other:
        other.send(b"\x7e\xb4\xb4")  # 100 % back
        greeting = [other.recv(timeout=5) for _ in range(2)]
        assert greeting == ["Connected to ", "My_Great_Woodbot"]
        with pytest.raises(closed) as caught:
            other.recv(timeout=5)
        assert caught.value.sent.code == 1007


def test_a_robot_that_starts_anew() -> None:
    with emulated("starting") as emulator, opened(emulator.where) as robot:
        device = emulator.device
        keep(robot, lambda: device.driven[-1:] == [AHEAD])
        emulator.order("brownout 0.3")
        keep(robot, lambda: not robot.figures()["connected"])
        device.driven.clear()
        keep(robot, lambda: robot.figures()["reconnects"] == 1)
        assert device.driven[0] == STAND
        keep(robot, lambda: device.driven[-1] == AHEAD)


def test_it_waits_for_a_robot_that_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(firmware, "STARTING", 0.8)  # 6 s of it are dear
    with emulated() as emulator:
        emulator.order("reset")
        until(lambda: not emulator.device._answers)
        with opened(emulator.where, hostname="My_Great_Woodbot"):
            assert emulator.device._answers


def test_reset_puts_the_path_back() -> None:
    with emulated() as emulator, opened(emulator.where) as robot:
        keep(robot, lambda: robot.state.x > 0.02)
        drive(robot, 0.0, 0.0, 0.2)
        robot.reset()
        drive(robot, 0.0, 0.0, 0.1)
        assert robot.state == Woodbot.state.schema()


# -- bad input ---------------------------------------------------------------------


def failure(url: str, **options: Any) -> str:
    with pytest.raises(AgentError) as caught, opened(url, **options):
        pass
    return str(caught.value)


def test_nobody_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver, "STARTING", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    said = failure(f"ws://127.0.0.1:{port}")
    assert said.startswith(
        "robot/w: there is no connection to its device: no Woodbot answers at "
        f"ws://127.0.0.1:{port}: "
    )
    assert "3. that it is there: ping 127.0.0.1; 4. that the port is right" in said
    with pytest.raises(TimeoutError):  # a machine so busy that no time is left
        WebSocket.connect("ws://127.0.0.1:1", -0.1, socket.create_connection)


def test_something_else_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """A web server; and a WebSocket server that echoes."""
    monkeypatch.setattr(driver, "STARTING", 1.0)
    web = http.server.HTTPServer(("127.0.0.1", 0), http.server.BaseHTTPRequestHandler)
    with web:
        threading.Thread(target=web.serve_forever, daemon=True).start()
        said = failure(f"ws://127.0.0.1:{web.server_port}")
        web.shutdown()
    assert "what answers there is no WebSocket: " in said

    class Echo(OriginalWoodbot):
        def hear(self, portion: bytes) -> list[bytes]:
            answers = super().hear(portion)
            return answers[:1] if b"Connected" in b"".join(answers) else [portion]

    with Emulator(Echo(), WebSocketPort()) as emulator:
        said = failure(emulator.where)
    assert "is no Woodbot with the class's first firmware" in said
    assert "it sent b'S'. Check the address" in said


def test_another_robot_is_there() -> None:
    with emulated() as emulator:
        said = failure(emulator.where, hostname="Team_7")
        assert "is 'My_Great_Woodbot', and 'Team_7' is meant" in said
        assert emulator.device.driven in ([], [STAND]), "it was not driven"


@pytest.mark.parametrize(
    "url",
    ["", "192.168.8.200", "http://192.168.8.200", "ws://", "ws://a:b", "ws://:80"],
)
def test_urls_that_are_none(url: str) -> None:
    robot = Robot("w", options={"url": url})
    with pytest.raises(SchemaError, match="expected where the robot is, such as opt"):
        robot.prepare()


def test_options_that_cannot_be() -> None:
    robot = Robot("w", options={"url": "ws://a", "dead_band": 0.4, "saturation": 0.3})
    with pytest.raises(SchemaError, match="expected a dead_band below saturation"):
        robot.prepare()


class Bare(Definition):
    command = In(Schema("bare.command", {"wheel/left": angular_velocity()}))
    state = Out(
        Schema("bare.state", {"x": length(), "y": length(), "heading": angle()})
    )


def test_definitions_that_cannot_be_driven_so() -> None:
    robot = combine(Bare, OriginalFirmware)("w", options={"url": "ws://a"})
    with pytest.raises(SchemaError, match=r"Bare has no derivative\(state, command\)"):
        robot.prepare()

    class Rolling(Bare):
        def derivative(self, state: Any, command: Any) -> dict[str, float]:
            return {}

    robot = combine(Rolling, OriginalFirmware)("w", options={"url": "ws://a"})
    with pytest.raises(SchemaError, match="has 'wheel/left' without that unit"):
        robot.prepare()


def test_a_port_that_is_taken() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as taken,
        pytest.raises(FabricError, match=r"use\. Give another port, such as --port"),
    ):
        WebSocketPort(port=taken.getsockname()[1])
