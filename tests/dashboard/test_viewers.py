"""Viewers of others at the page's port: what they see, and how they drive."""

from __future__ import annotations

import json
import math
import re
import socket
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from rems_net.cli import INTERRUPTED
from rems_net.client import Fabric, join
from rems_net.dashboard.viewers.grip import Echo
from rems_net.dashboard.viewers.wire import ABLE, SUBPROTOCOLS, read_stick, read_topic
from rems_net.errors import WireError
from tests.agents.runs import until
from tests.commands import fetched
from tests.dashboard.test_drive_page import stands
from tests.dashboard.test_page import Lab
from tests.firmware.posix.valve import Valve
from tests.interrupts import APART, interrupt

BOT = "/robot/bot/command"
TWIST = "geometry_msgs/Twist"


class Viewed(Lab):
    """A run, and its page with an address for viewers."""

    def _begin(self, folder: Path) -> str:
        self._run()
        page = self.start("dashboard", "--no-qr", "--viewers", stdout=subprocess.PIPE)
        self._started.append(page)
        assert page.stdout is not None
        found = (re.search(r"ws://\S+", line) for line in page.stdout)
        return next(one for one in found if one).group()


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewed]:
    made = Viewed(tmp_path_factory.mktemp("viewed"))
    try:
        yield made
    finally:
        made.close()


@pytest.fixture(scope="module")
def here(lab: Viewed) -> Iterator[Fabric]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(lab.folder / "rt"))
        with join() as fabric:
            yield fabric


class Viewer:
    """A program that speaks the protocol, with what it has received."""

    def __init__(self, link: ClientConnection):
        self.link = link
        self.channels: dict[str, dict[str, Any]] = {}
        self.values: dict[int, tuple[int, bytes]] = {}
        self.said: list[str] = []
        self.time = 0
        self.answers: list[Any] = []
        self._thread = Thread(target=self._hear)
        self._thread.start()

    def _hear(self) -> None:
        with suppress(Exception):
            for message in self.link:
                self._take(message)

    def _take(self, message: Any) -> None:
        if isinstance(message, bytes):
            if message[0] == 1:
                _, number, t = struct.unpack_from("<BIQ", message)
                self.values[number] = t, message[13:]
            elif message[0] == 2:
                self.time = struct.unpack_from("<BQ", message)[1]
            else:
                self.answers.append(json.loads(message[17:]))
            return
        words = json.loads(message)
        if words["op"] == "advertise":
            self.channels |= {one["topic"]: one for one in words["channels"]}
        elif words["op"] == "status":
            self.said.append(words["message"])
        elif words["op"] in ("serviceCallFailure", "parameterValues"):
            self.answers.append(words)

    def send(self, op: str, **words: Any) -> None:
        self.link.send(json.dumps({"op": op, **words}))

    def look(self, topic: str) -> int:
        channel = until(lambda: self.channels.get(topic))
        row = {"id": 70 + channel["id"], "channelId": channel["id"]}
        self.send("subscribe", subscriptions=[row])
        return int(row["id"])

    def name(self, topic: str = BOT, schema: str = TWIST, **more: str) -> None:
        row = {"id": 5, "topic": topic, "encoding": "json", "schemaName": schema}
        self.send("advertise", channels=[row | more])

    def put(self, ahead: float, turn: float = 0.0) -> None:
        plain = {"linear": {"x": ahead, "y": 0, "z": 0}, "angular": {"z": turn}}
        self.link.send(b"\1" + struct.pack("<I", 5) + json.dumps(plain).encode())

    def pushed(self) -> bool:
        """Publish half of full speed; always true."""
        self.put(0.5)
        return True

    def hears(self, sentence: str) -> bool:
        return bool(until(lambda: any(sentence in one for one in self.said)))


@contextmanager
def viewer(url: str, protocol: str = SUBPROTOCOLS[1]) -> Iterator[Viewer]:
    words: dict[str, Any] = {"origin": "https://viewer.example", "compression": None}
    with connect(url, subprotocols=[Subprotocol(protocol)], **words) as link:
        assert link.subprotocol == protocol
        made = Viewer(link)
        try:
            yield made
        finally:
            link.close()
            made._thread.join()


def drive(one: Viewer, here: Fabric, more: float = 0.01) -> None:
    """Drive until the robot is so much farther."""
    bot = here.robot("bot")
    x, y = bot.state.x, bot.state.y

    def there() -> bool:
        one.put(0.5)
        return math.hypot(bot.state.x - x, bot.state.y - y) > more

    until(there)


@pytest.mark.parametrize("protocol", SUBPROTOCOLS)
def test_values_are_read_by_another_decoder(lab: Viewed, protocol: str) -> None:
    dynamic = pytest.importorskip("mcap_ros2._dynamic")
    with viewer(lab.link, protocol) as one:
        number = one.look("/robot/euler/state")
        channel = one.channels["/robot/euler/state"]
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        made = dynamic.generate_dynamic(channel["schemaName"], channel["schema"])
        t, message = until(lambda: one.values.get(number))
        state = made[channel["schemaName"]](message)
        assert state.x != 0.0
        until(lambda: one.values[number][0] > t)
        assert one.time >= t > 0
        one.send("unsubscribe", subscriptionIds=[number])
        before = until(lambda: one.values.pop(number, None))
        assert before


def test_frames_of_all_robots(lab: Viewed, here: Fabric) -> None:
    dynamic = pytest.importorskip("mcap_ros2._dynamic")
    with viewer(lab.link) as one:
        number = one.look("/tf")
        channel = one.channels["/tf"]
        name = channel["schemaName"]
        read = dynamic.generate_dynamic(name, channel["schema"])[name]

        def poses() -> dict[str, Any]:
            _, message = one.values.get(number, (0, b""))
            rows = read(message).transforms if message else []
            return {row.child_frame_id: row for row in rows}

        first = until(lambda: poses().get("bot"))
        assert first.header.frame_id == "world"
        one.name()
        drive(one, here)

        def moved() -> bool:
            a, b = first.transform.translation, poses()["bot"].transform.translation
            return math.hypot(b.x - a.x, b.y - a.y) > 0.01

        until(moved)
        assert "/robot/bot/state" in one.channels  # nobody subscribed to it


def test_a_viewer_drives_and_lets_go(lab: Viewed, here: Fabric) -> None:
    with viewer(lab.link) as one:
        one.name()
        drive(one, here)
        assert "robot/bot" in here.drivers()
        stands(here)  # it publishes no more
        until(lambda: "robot/bot" not in here.drivers())  # and gives the robot back
        drive(one, here)
    stands(here)  # it has gone
    until(lambda: "robot/bot" not in here.drivers())


def test_what_is_no_command_is_a_sentence_and_the_robot_stands(
    lab: Viewed, here: Fabric
) -> None:
    with viewer(lab.link) as one:
        one.name(schema="std_msgs/String")
        assert one.hears("publishes 'std_msgs/String' as 'json', and robot/bot stands")
        one.name(topic="/cmd_vel")
        assert one.hears("'/cmd_vel' drives nothing: publish at the topic of a robot")
        one.name(topic="/robot/nobody/command")
        until(lambda: one.pushed() and one.said[2:])
        assert "there is no robot/nobody" in one.said[2]
        one.name(topic="/robot/euler/command")
        until(lambda: one.pushed() and one.said[3:])
        assert "input/wave commands robot/euler there" in one.said[3]
        one.name()
        drive(one, here)
        one.put(float("nan"))
        assert one.hears("nan is no finite number; the robot stands")
        stands(here)
        one.link.send(b"\7")
        assert one.hears("its first byte is 1 or 2")
        one.link.send("[1]")
        assert one.hears('expected {"op": ...}')


@pytest.mark.parametrize("seconds", [0.7, pytest.param(10.0, marks=pytest.mark.slow)])
def test_what_a_network_has_held_up_is_not_obeyed(
    lab: Viewed, here: Fabric, seconds: float
) -> None:
    valve = Valve(lab.link.split("/")[2])
    near = socket.create_connection(("127.0.0.1", int(valve.endpoint.split(":")[1])))
    try:
        with connect(
            lab.link,
            sock=near,
            subprotocols=[Subprotocol(SUBPROTOCOLS[1])],
            compression=None,
        ) as link:
            one = Viewer(link)
            one.name()
            drive(one, here)
            valve.shut()
            end = time.monotonic() + seconds
            until(lambda: one.pushed() and time.monotonic() > end, seconds + 20)
            stands(here)
            before = here.robot("bot").state.get()
            valve.open()
            for state in here.robot("bot").watch("state", 25):
                assert state == before
            drive(one, here)  # and what is new is obeyed again
        one._thread.join()
    finally:
        valve.close()


def test_who_gets_in(lab: Viewed) -> None:
    base, _, token = lab.link.rpartition("/")
    for url in (f"{base}/", f"{base}/{token[:-1]}", f"{base}/{'x' * len(token)}"):
        with pytest.raises(InvalidStatus), viewer(url):
            pass
    with pytest.raises(InvalidStatus), viewer(f"{base}?token={token}"):
        pass
    near = lab.link.split("/")[2].replace("127.0.0.1", "localhost")
    with viewer(f"ws://{near}/viewer/{token}"):
        pass
    with ExitStack() as stack:
        for _ in range(4):
            stack.enter_context(viewer(lab.link))
        with pytest.raises(InvalidStatus) as refused, viewer(lab.link):
            pass
        assert refused.value.response.body == b"4 viewers look already.\n"


def test_it_ends_while_viewers_leave(lab: Viewed) -> None:
    words = "dashboard", "--no-qr", "--viewers"
    page = lab.start(*words, stdout=subprocess.PIPE, **APART)
    try:
        assert page.stdout is not None
        found = (re.search(r"ws://\S+", line) for line in page.stdout)
        url = next(one for one in found if one).group()
        with viewer(url) as one, viewer(url) as other:
            one.look("/tf")
            other.look("/tf")
        interrupt(page)  # their tasks are being cancelled
        assert page.wait(20) == INTERRUPTED
    finally:
        page.kill()
        page.communicate()


def test_stop_is_a_service(lab: Viewed) -> None:
    with viewer(lab.link) as one:

        def call(service: int) -> Any:
            one.link.send(struct.pack("<BIII", 2, service, 9, 4) + b"json{}")
            return until(lambda: one.answers and one.answers.pop())

        assert "result" in call(1)
        assert lab.stopped()
        assert "result" in call(2)
        assert not lab.stopped()
        assert "unknown deed" in call(77)["message"]


def test_verbs_are_called(lab: Viewed, here: Fabric) -> None:
    with viewer(lab.link) as one:

        def call(plain: Any) -> Any:
            words = json.dumps(plain).encode()
            one.link.send(struct.pack("<BIII", 2, 5, 9, 4) + b"json" + words)
            return until(lambda: one.answers and one.answers.pop())

        one.name()
        drive(one, here)
        stands(here)
        assert call({"agent": "robot/bot", "verb": "reset"}) == {"result": None}
        until(lambda: here.robot("bot").state.x == 0)
        wrong = {"agent": "robot/bot", "verb": "fly", "args": [1]}
        assert "there is no verb 'fly'" in call(wrong)["message"]
        others: list[Any] = [{"agent": "robot/bot"}, [], wrong | {"agent": "*/*"}]
        for words in others:
            assert "This calls no verb; expected" in call(words)["message"]


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_twist_in_cdr(order: str) -> None:
    channel = {"topic": BOT, "encoding": "cdr", "schemaName": TWIST}
    assert read_topic(channel) == "robot/bot"
    head = b"\0\1\0\0" if order == "<" else b"\0\0\0\0"
    message = head + struct.pack(f"{order}6d", 0.25, -3.0, 0, 0, 0, 0.5)
    assert read_stick(channel, message) == {"ahead": 25, "left": -100, "turn": 50}
    for wrong in (message[:-1], b"", rb"\9" + message, head + b"\xff" * 48):
        with pytest.raises(WireError, match="the robot stands"):
            read_stick(channel, wrong)


def test_an_answer_that_comes_late_locks_the_hand() -> None:
    echo = Echo()
    assert not echo.is_new(10.0)
    number = echo.beat(10.0)
    assert number is not None
    echo.came(number, 10.02)
    assert echo.is_new(10.03)
    assert not echo.is_new(10.6)  # no answer since
    late = echo.beat(10.6)
    assert late is not None
    echo.came(late, 11.4)
    assert not echo.is_new(11.41)
    soon = echo.beat(11.42)  # sent while the old messages are still coming
    assert soon is not None
    echo.came(soon, 11.43)
    assert not echo.is_new(11.44)
    new = echo.beat(11.6)
    assert new is not None
    echo.came(new, 11.62)
    assert echo.is_new(11.63)


PACKAGES = ("@foxglove/ws-protocol", "ws")
CLIENT = """
import protocol from "@foxglove/ws-protocol";
import WebSocket from "ws";
const { FoxgloveClient } = protocol;
const [url, topic] = process.argv.slice(2);
const ws = new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const client = new FoxgloveClient({ ws });
const found = { values: 0, time: 0 };
client.on("error", (e) => { console.error(e); process.exit(1); });
client.on("serverInfo", (e) => { found.capabilities = e.capabilities; });
client.on("time", () => { found.time += 1; });
client.on("message", (e) => { found.values += 1; found.bytes = e.data.byteLength; });
client.on("advertise", (channels) => {
  const one = channels.find((c) => c.topic === topic);
  if (one) { client.subscribe(one.id); }
});
client.on("advertiseServices", (services) => {
  const stop = services.find((s) => s.name === "/pause");
  const data = new TextEncoder().encode("{}");
  client.sendServiceCallRequest(
    { serviceId: stop.id, callId: 3, encoding: "json", data });
});
client.on("serviceCallResponse", (e) => {
  found.answer = new TextDecoder().decode(e.data);
  const back = { serviceId: 4, callId: 4, encoding: "json",
    data: new TextEncoder().encode("{}") };
  if (e.callId === 3) { client.sendServiceCallRequest(back); }
});
let put;
client.on("open", () => {
  const id = client.advertise({ topic: "/robot/bot/command", encoding: "json",
    schemaName: "geometry_msgs/Twist" });
  const data = new TextEncoder().encode(JSON.stringify({ linear: { x: 0.5 } }));
  put = setInterval(() => client.sendMessage(id, data), 50);
});
setTimeout(() => {
  clearInterval(put); client.close(); console.log(JSON.stringify(found));
}, 4000);
"""


@pytest.mark.slow
def test_the_client_library_of_lichtblick(
    lab: Viewed, here: Fabric, tmp_path: Path
) -> None:
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "client.js").write_text(CLIENT)
    fetched(tmp_path, *PACKAGES)
    x = here.robot("bot").state.get()
    said = subprocess.run(
        ["node", "client.js", lab.link, "/robot/euler/state"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(said.stdout)
    assert found["capabilities"] == [*ABLE]
    assert found["values"] > 30
    assert found["time"] > 30
    assert found["bytes"] == 28
    assert json.loads(found["answer"]).keys() == {"result"}
    assert here.robot("bot").state.get() != x
    stands(here)
