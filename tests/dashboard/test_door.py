"""The port of the page: who gets in, and what anybody else gets."""

from __future__ import annotations

import json
import random
import socket
import time
from collections.abc import Iterator
from contextlib import suppress
from http.client import HTTPConnection
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.sync.client import ClientConnection, connect

from benchmarks.programs.page import resident
from rems_net.client import join
from rems_net.dashboard.pages import FULL
from rems_net.dashboard.protocol import LARGEST, LONGEST, RATE
from rems_net.dashboard.serving import listening_at
from rems_net.router.find import serve
from tests.agents.runs import until

HELLO = {"hello": "", "version": 1}


class Port:
    """A page's port, and a fabric with a clock behind it."""

    def __init__(self, link: str, session: Any, server: Any, end: Any):
        self.session, self.server, self.end = session, server, end
        parts = urlsplit(link)
        self.netloc, self.token = parts.netloc, parts.fragment
        self.host, self.port = parts.hostname or "", parts.port or 0

    def connect(self, **more: Any) -> Any:
        words: dict[str, Any] = {"origin": f"http://{self.netloc}", "compression": None}
        return connect(f"ws://{self.netloc}/", **(words | more))

    def get(self, path: str, host: str = "") -> tuple[int, dict[str, str], bytes]:
        link = HTTPConnection(self.host, self.port, timeout=10)
        try:
            link.request("GET", path, headers={"Host": host or self.netloc})
            answer = link.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            link.close()

    def hello(self, socket: ClientConnection) -> dict[str, Any]:
        """Send the token; return the welcome."""
        socket.send(json.dumps(HELLO | {"hello": self.token}))
        found: dict[str, Any] = json.loads(socket.recv(10))
        return found

    def watched(self) -> bool:
        """Whether anything on the fabric is subscribed to."""
        put = self.session.publisher("rems/clock/tick")
        put.look()
        put.close()
        return bool(put.watched)


@pytest.fixture
def port(tmp_path: Any) -> Iterator[Port]:
    """A page in this process, which ends with its test."""
    import asyncio

    from rems_net.dashboard.server import Server

    session, note = serve()
    with session, join() as fabric, listening_at("127.0.0.1", [0]) as (sock, door):
        loop = asyncio.new_event_loop()
        ends = asyncio.Event()

        server = Server(fabric, door)

        async def run() -> None:
            async with await server.listen(sock):
                task = asyncio.create_task(server.run())
                await ends.wait()
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task

        thread = Thread(target=loop.run_until_complete, args=(run(),))
        thread.start()

        def end() -> None:
            loop.call_soon_threadsafe(ends.set)
            thread.join()

        try:
            yield Port(door.links()[0], session, server, end)
        finally:
            end()
            loop.close()
            note.unlink(missing_ok=True)


def test_files_come_with_their_guards(port: Port) -> None:
    status, headers, body = port.get("/")
    assert status == 200
    assert b"<title>rems</title>" in body
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Cache-Control"] == "no-store"
    assert port.token.encode() not in body
    for path in ("/../door.py", "/%2e%2e/door.py", "/nothing.js", "//etc/passwd"):
        assert port.get(path)[0] == 404


def test_a_name_that_was_rebound_gets_nothing(port: Port) -> None:
    for host in ("evil.example", f"evil.example:{port.port}", "127.0.0.1"):
        status, _, body = port.get("/", host)
        assert status == 421
        assert b"<title>" not in body


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null"])
def test_a_page_of_another_origin_gets_nothing(port: Port, origin: str | None) -> None:
    with pytest.raises(InvalidStatus), port.connect(origin=origin):
        pass
    assert not port.watched()


@pytest.mark.parametrize(
    "first",
    [
        {"hello": "wrong", "version": 1},
        {"hello": None, "version": 1},
        {"do": "stop"},
        "no JSON",
        b"\x00",
    ],
)
def test_a_program_without_the_token_gets_nothing(port: Port, first: Any) -> None:
    with port.connect() as socket:
        plain = isinstance(first, str | bytes)
        socket.send(first if plain else json.dumps(first))
        with pytest.raises(ConnectionClosed) as closed:
            socket.recv(10)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4401
    assert not port.watched()


def test_nothing_is_subscribed_to_while_no_page_looks(port: Port) -> None:
    assert not port.watched()
    with port.connect() as socket:
        assert port.hello(socket)["welcome"]["fabric"] == "rems"
        until(port.watched)
    until(lambda: not port.watched())


def test_a_page_of_another_version_is_asked_to_load_again(port: Port) -> None:
    with port.connect() as socket:
        socket.send(json.dumps({"hello": port.token, "version": 0}))
        with pytest.raises(ConnectionClosed, match="load the page again"):
            socket.recv(10)


def answer(socket: ClientConnection) -> dict[str, Any]:
    """The next answer; other messages come between."""
    while True:
        text = socket.recv(10)
        if isinstance(text, str) and "answer" in (found := json.loads(text)):
            said: dict[str, Any] = found["answer"]
            return said


def test_a_request_that_does_not_fit_is_answered_in_a_sentence(port: Port) -> None:
    with port.connect() as socket:
        port.hello(socket)
        for words, sentence in (
            ({"do": "reboot"}, "unknown deed"),
            ({"do": "step", "count": 1e9}, "1 to 1000 ticks"),
            ({"do": "pace", "pace": -1}, "a factor of real time, 0.001 to"),
            ({"put": "robot/a/command", "values": {}}, "unknown deed"),
            ({"do": "pause"}, "no experiment runs"),
            ([1], "no message of the page"),
        ):
            socket.send(json.dumps(words))
            assert sentence in answer(socket)["error"]


def deaf(port: Port) -> socket.socket:
    """Open a page that sends its token, and never reads anything."""
    link = socket.socket()
    link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    link.connect((port.host, port.port))
    key = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + "A" * 22 + "=="
    head = f"GET / HTTP/1.1\r\nHost: {port.netloc}\r\nOrigin: http://{port.netloc}"
    upgrade = "Connection: Upgrade\r\nUpgrade: websocket"
    link.sendall(f"{head}\r\n{upgrade}\r\n{key}\r\n\r\n".encode())
    text = json.dumps(HELLO | {"hello": port.token}).encode()
    # a text of less than 126 bytes, masked by zeros
    link.sendall(bytes([0x81, 0x80 | len(text), 0, 0, 0, 0]) + text)
    return link


def test_a_page_that_reads_nothing_costs_little_and_delays_no_end(port: Port) -> None:
    stream, session = port.server.stream, port.session
    put = session.publisher("rems/world/big/state")
    here = session.present("rems/world/big/@alive")
    link = deaf(port)
    until(lambda: stream.pages)
    (page,) = stream.pages

    def full() -> bool:
        put.put(bytes(60_000))
        return bool(page.is_full)

    until(full, 60.0)
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        full()
        assert page.link.transport.get_write_buffer_size() < FULL + 2 * LARGEST
        time.sleep(0.01)
    begun = time.monotonic()
    port.end()
    assert time.monotonic() - begun < 5.0
    for one in (link, put, here):
        one.close()


def test_a_flood_and_a_giant_end_their_own_page_only(port: Port) -> None:
    with port.connect() as calm, port.connect() as flood, port.connect() as giant:
        for socket in (calm, flood, giant):
            port.hello(socket)
        with suppress(ConnectionClosed):
            for _ in range(int(RATE) * 20):
                flood.send('{"do": "nothing"}')
        with suppress(ConnectionClosed):
            giant.send("x" * (LONGEST + 1))
        for socket, code in ((flood, 4429), (giant, 1009)):
            with suppress(ConnectionClosed):
                while socket.recv(10):
                    pass
            assert socket.close_code == code
        calm.send('{"do": "nothing", "id": 5}')
        assert answer(calm)["id"] == 5


def attack(port: Port, rng: random.Random, seconds: float) -> int:
    """Send nonsense of many kinds to the port for so long; return how often."""
    count, end = 0, time.monotonic() + seconds
    words: list[Any] = [None, True, 0, -1, 1e308, "", "x" * 5000, [], [[]], {}, "\x00"]
    names = ["do", "id", "put", "hello", "version", "count", "pace", "key", "values"]
    while time.monotonic() < end:
        count += 1
        if rng.random() < 0.5:  # not even HTTP, or a broken handshake
            with socket.create_connection((port.host, port.port), 5) as raw:
                head = b"GET / HTTP/1.1\r\nHost: %s\r\n" % port.netloc.encode()
                raw.sendall(rng.choice([b"", head]) + rng.randbytes(rng.randrange(300)))
            continue
        with suppress(WebSocketException, OSError), port.connect() as link:
            if rng.random() < 0.9:
                port.hello(link)
            for _ in range(rng.randrange(20)):
                plain = {rng.choice(names): rng.choice(words) for _ in range(3)}
                kind = rng.randrange(3)
                link.send([json.dumps(plain), rng.randbytes(99), "{" * 4000][kind])
    return count


@pytest.mark.parametrize("seconds", [2.0, pytest.param(60.0, marks=pytest.mark.slow)])
def test_nonsense_never_ends_it(port: Port, seconds: float) -> None:
    with port.connect() as calm:
        port.hello(calm)
        attack(port, random.Random(1), 1.0)  # what is loaded once
        before = resident()
        assert attack(port, random.Random(25), seconds) > 5
        calm.send('{"do": "nothing", "id": 9}')
        assert answer(calm)["id"] == 9
    assert port.get("/")[0] == 200
    # MB, of this process: the server, and all who attack it
    assert not resident() - before > 20
