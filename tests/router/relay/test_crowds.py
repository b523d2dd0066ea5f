"""Connections of one laptop, or ten, keep nobody out."""

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress

import pytest

from rems_net.errors import FabricError
from rems_net.router.relay import limits
from rems_net.router.relay.descriptors import EACH, REST, fitting, room
from rems_net.router.relay.handshake import TOO_MANY, framed
from tests.agents.runs import until
from tests.router.relay.conftest import PASSWORDS, Shared, many_addresses
from tests.router.relay.raw import Raw, init_syn

resource = pytest.importorskip("resource")
pytestmark = many_addresses
#: s in which a teacher's STOP has gone through
SOON = 1.0
#: s in which a robot that lost its Wi-Fi is back
BACK = 5.0
#: how often a busy machine may be late for reasons of its own
TRIES = 3
ONE = ["127.0.0.2"]
TEN = [f"127.0.0.{i}" for i in range(2, 12)]
#: what is sent before a connection falls silent: nothing, half of the handshake's
#: first message, all of it
SILENT, SLOW, HALF = b"", b"\x13\x00\x01", framed(init_syn(b"a guest of ours"))


@contextmanager
def crowd(port: int, count: int, hosts: list[str], words: bytes) -> Iterator[None]:
    """So many connections that say no more than `words`."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 2 * count + soft), hard))
    with ExitStack() as stack:
        for i in range(count):
            source = (hosts[i % len(hosts)], 0)
            to = ("127.0.0.1", port)
            one = socket.create_connection(to, 5.0, source_address=source)
            stack.enter_context(one)
            one.sendall(words)
        yield


def joins_soon(router: Shared, host: str, user: str = "") -> None:
    """Be let in, say STOP and leave, at once, in one of some tries."""
    lasted: list[float] = []
    while not lasted or min(lasted) > SOON:
        assert len(lasted) < TRIES, lasted
        begun = time.monotonic()
        with router.session(user, host) as newcomer:
            newcomer.put(f"{newcomer.fabric}/stop", b"\xc3")
            assert newcomer.connected
        lasted.append(time.monotonic() - begun)


#: opens connections without an end, and keeps the last 300
STORM = """
import collections, socket, sys
port, host, words = int(sys.argv[1]), sys.argv[2], bytes.fromhex(sys.argv[3])
kept = collections.deque(maxlen=300)
while True:
    try:
        kept.append(socket.create_connection(("127.0.0.1", port), 1.0, (host, 0)))
        kept[-1].sendall(words)
    except OSError:
        pass
"""


@contextmanager
def storm(port: int, host: str, words: bytes) -> Iterator[None]:
    """Connections without an end, as fast as one process can."""
    told = [str(port), host, words.hex()]
    with subprocess.Popen([sys.executable, "-c", STORM, *told]) as attack:
        try:
            yield
        finally:
            attack.kill()


@pytest.mark.parametrize("words", [SILENT, HALF], ids=["silent", "half"])
def test_a_robot_is_back_while_connections_rain(closed: Shared, words: bytes) -> None:
    with closed.raw(host="127.0.0.3") as lost:
        assert lost.join("anna", PASSWORDS["anna"]) == -1
        with (
            storm(closed.port, "127.0.0.2", words),
            closed.raw(lost.zid, "127.0.0.3") as back,
        ):
            until(lambda: "127.0.0.2 opened connections" in closed.screen)
            begun = time.monotonic()
            assert back.join("anna", PASSWORDS["anna"]) == -1
            assert time.monotonic() - begun < BACK
            joins_soon(closed, "127.0.0.1", "teacher")


@pytest.mark.parametrize("words", [SILENT, SLOW, HALF], ids=["silent", "slow", "half"])
def test_six_hundred_of_one_laptop_keep_nobody_out(
    router: Shared, words: bytes
) -> None:
    with crowd(router.port, 600, ONE, words):
        joins_soon(router, "127.0.0.3")
        joins_soon(router, "127.0.0.1")
    until(lambda: "127.0.0.2 opened connections and did not join" in router.screen)


@pytest.mark.slow
@pytest.mark.parametrize("count", [2_100, 10_000])
@pytest.mark.parametrize("hosts", [ONE, TEN], ids=["one", "ten"])
@pytest.mark.parametrize("words", [SILENT, SLOW, HALF], ids=["silent", "slow", "half"])
def test_thousands_keep_nobody_out(
    closed: Shared, count: int, hosts: list[str], words: bytes
) -> None:
    with crowd(closed.port, count, hosts, words):
        joins_soon(closed, "127.0.0.99", "teacher")
        joins_soon(closed, "127.0.0.1", "anna")


def test_a_handshake_has_a_deadline(
    router: Shared, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "HANDSHAKE_TIMEOUT", 0.5)
    begun = time.monotonic()
    with router.raw(host="127.0.0.2") as slow:
        slow.socket.sendall(HALF)
        assert slow.closed
    assert 0.4 < time.monotonic() - begun < 3.0


def test_sessions_of_one_user_are_bounded(
    closed: Shared, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "OF_USER", 3)
    with ExitStack() as stack:

        def join(user: str) -> int:
            client: Raw = stack.enter_context(closed.raw(host="127.0.0.2"))
            return client.join(user, PASSWORDS[user])

        assert [join("anna") for _ in range(5)] == [-1, -1, -1, TOO_MANY, TOO_MANY]
        assert join("ben") == -1
        with pytest.raises(FabricError, match="no room for another session of this"):
            closed.session("anna").open()
    until(lambda: "anna has 3 sessions" in closed.screen)
    until(lambda: _joins(closed, "anna"))


def test_a_process_without_descriptors_goes_on(router: Shared) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with socket.socket() as one:
        resource.setrlimit(resource.RLIMIT_NOFILE, (one.fileno() + 1, hard))
        try:
            with ExitStack() as stack:
                with suppress(OSError):
                    while True:
                        stack.enter_context(socket.socket())
                one.connect(("127.0.0.1", router.port))
                until(lambda: "no room for more connections" in router.screen)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    joins_soon(router, "127.0.0.1")


def test_what_fits_depends_on_the_descriptors() -> None:
    assert room() == fitting(10_000) == (2000, limits.OF_ALL, limits.OF_OURS)
    for few in (1024, 256):
        fits = fitting(few)
        assert min(fits) >= 1
        assert sum(fits) * EACH + REST <= few


def _joins(router: Shared, user: str) -> bool:
    with router.raw() as client:
        return client.join(user, PASSWORDS[user]) == -1
