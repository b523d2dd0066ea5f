"""The gate: who is let through to Zenoh, and what happens when one side ends."""

import socket
import subprocess
import sys
import time

import pytest

from rems_net.errors import FabricError
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.relay.gate import Gate
from rems_net.router.relay.handshake import UNSUPPORTED, framed
from rems_net.router.relay.scouts import Scouts
from rems_net.router.stop_store import class_router
from tests.agents.runs import free_port, until
from tests.router.relay.conftest import Shared
from tests.router.relay.raw import CLIENT, PEER, ROUTER, init_syn

#: a frame, and in it the subscriber 1 to rems/a
SUBSCRIBES = bytes((0x25, 0, 0x1E, 0x22, 1, 0, 6)) + b"rems/a"


@pytest.mark.parametrize("mode", [ROUTER, PEER])
def test_only_clients_are_let_in(router: Shared, mode: int) -> None:
    with router.raw() as client:
        assert client.join(mode=mode) == UNSUPPORTED
    word = ("router", "peer")[mode]
    until(lambda: f"it came as a {word}, and only clients are let in" in router.screen)


@pytest.mark.parametrize(
    "words",
    [
        b"GET / HTTP/1.0\r\n\r\n",
        framed(b""),
        framed(b"\x05 a frame before anything"),
        framed(init_syn(b"robot", CLIENT)[:-1]),
        framed(init_syn(b"robot", CLIENT) + b"more"),
        framed(init_syn(b"robot", 3)),
        framed(init_syn(b"robot")) + framed(init_syn(b"robot")),
        b"\xff\xff" + bytes(65_535),
    ],
)
def test_what_is_no_handshake_never_reaches_zenoh(router: Shared, words: bytes) -> None:
    with router.raw() as client:
        client.socket.sendall(words)
        assert client.closed
    until(lambda: "127.0.0.1 was disconnected once" in router.screen)


def test_a_client_that_is_killed_is_seen_at_once(router: Shared) -> None:
    token = "rems/robot/alice/@alive"
    code = (
        "import sys; from rems_net.router.session import Session;"
        "from rems_net.router.settings import Link;"
        f"s = Session(Link({router.endpoint!r})); s.open();"
        f"s.present({token!r}); sys.stdin.read()"
    )
    with router.session() as watcher:
        child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)
        try:
            until(lambda: watcher.who(token))
        finally:
            child.kill()
            child.communicate()
        begun = time.monotonic()
        until(lambda: not watcher.who(token))
        assert time.monotonic() - begun < 1.0


def test_what_a_client_sends_last_arrives(router: Shared) -> None:
    box = Mailbox()
    # Small enough that a router does not drop it, however busy the machine is.
    payload = bytes(range(256)) * 200
    with router.session() as watcher:
        watcher.watch("rems/a", box)
        watcher.who("rems/none", timeout=1)  # answered after that was declared
        with router.session() as client:
            client.put("rems/a", payload)
        mail = box.get(5.0)
        assert isinstance(mail, Mail)
        assert mail.payload == payload


def test_a_client_that_reads_nothing_delays_nobody(router: Shared) -> None:
    box = Mailbox()
    with router.session() as sender, router.session() as reader, router.raw() as stuck:
        assert stuck.join() == -1
        stuck.send(SUBSCRIBES)
        reader.watch("rems/b", box)
        lost, seen = sender.publisher("rems/a", block=False), sender.publisher("rems/b")
        until(lambda: lost.watched and seen.watched)
        for i in range(40):  # 20 MB; what the system keeps for a connection is 1 MB
            lost.put(bytes(500_000))
            seen.put(b"%d" % i)
            mail = box.get(1.0)
            assert isinstance(mail, Mail)
            assert mail.payload == b"%d" % i


@pytest.mark.parametrize(
    ("endpoint", "why"),
    [
        ("tcp/{}:{}", "another program has this port"),
        ("tcp/203.0.113.5:{1}", "Cannot be the router at tcp/203.0.113.5:.* assign"),
        ("udp/{}:{}", "A router for others can't listen at udp/"),
        ("tcp/{}:{}#iface=lo", "A router for others can't listen at tcp/.*#iface=lo"),
    ],
)
def test_a_port_that_can_not_be_had_is_explained(endpoint: str, why: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        there = endpoint.format(*other.getsockname())
        with pytest.raises(FabricError, match=why), class_router(there):
            pass


def test_a_scout_gets_the_public_endpoint() -> None:
    scouts = Scouts("tcp/127.0.0.1:7000", "a1b2")
    hello = scouts.answer("127.0.0.1")
    assert hello == bytes((0x22, 9, 0x10, 0xB2, 0xA1, 1, 18)) + b"tcp/127.0.0.1:7000"


def test_a_gate_that_fails_ends_the_router(monkeypatch: pytest.MonkeyPatch) -> None:
    port = free_port()

    def fail(self: Gate, now: float) -> None:
        raise RuntimeError("on purpose")

    monkeypatch.setattr(Gate, "_look", fail)
    with (
        pytest.raises(FabricError, match="gate has ended by a mistake of its own"),
        class_router(f"tcp/127.0.0.1:{port}"),
    ):
        until(lambda: False)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), 1.0)
