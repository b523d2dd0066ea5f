"""Key expressions that would stop or end a shared router: only their sender is cut."""

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import zenoh

from rems_net.router.mail import Mailbox
from rems_net.router.settings import Link
from tests.agents.runs import until
from tests.router.gate.wire import wire
from tests.router.relay.conftest import PASSWORDS, Shared

#: s in which a message comes through; without the gate, 33 s, or never again
SOON = 1.0


@contextmanager
def sender(port: int, user: str) -> Iterator[zenoh.Session]:
    """Yield a plain session of Zenoh, which knows nothing of our rule."""
    link = Link(f"tcp/127.0.0.1:{port}", user=user, password=PASSWORDS.get(user, ""))
    with zenoh.open(zenoh.Config.from_json5(link.to_wire())) as session:
        yield session


def attack(
    router: Shared, key: str, put: str, user: str = "", letter: bytes = b""
) -> None:
    """Subscribe and put; check how long others wait meanwhile.

    letter: stands on the wire in place of each Q, which no session of Zenoh would send.
    """
    box = Mailbox()
    spoiled = wire(
        router.port, lambda: lambda _: None, lambda b: b.replace(b"Q", letter)
    )
    other = "teacher" if user else ""
    with router.session(other) as one, router.session(other) as two, spoiled as bad:
        one.watch("rems/clock/tick", box)
        until(lambda: two.who("rems/none", timeout=1) == [])
        port = bad.port if letter else router.port
        # Two, since one would match its own put with its own subscription.
        with sender(port, user) as listener, sender(port, user) as putter:
            listener.declare_subscriber(key, lambda _: None)
            putter.put(put, b"", congestion_control=zenoh.CongestionControl.BLOCK)
            for _ in range(5):
                begun = time.monotonic()
                two.put("rems/clock/tick", b"")
                assert box.get(10.0) is not None
                assert time.monotonic() - begun < SOON
            until(lambda: "the key expression" in router.screen)


def test_two_messages_stop_nobody(router: Shared) -> None:
    attack(router, "team1" + "/**/a" * 6, "team1" + "/a" * 60)
    assert "sent the key expression '/**/a/**/a" in router.screen
    assert "which has `**` elsewhere than at its end" in router.screen


def test_nor_do_a_guests(closed: Shared) -> None:
    key = f"rems/robot/{'$*a' * 12}/command"
    attack(closed, key, f"rems/robot/{'a' * 50}b/command", user="anna")
    assert "which has more than one `*` in a chunk" in closed.screen


@pytest.mark.parametrize("letter", [b"#", b"*", b"$"])
def test_one_message_that_is_no_key_ends_no_router(
    router: Shared, letter: bytes
) -> None:
    attack(router, "rems/xQ/b", "rems/y", letter=letter)
    assert "one of `$#?`" in router.screen


@pytest.mark.parametrize(
    "unicast",
    [
        {"compression": {"enabled": True}},
        {"lowlatency": True, "qos": {"enabled": False}},
    ],
)
def test_no_client_can_hide_what_it_sends(
    router: Shared, unicast: dict[str, object]
) -> None:
    config = zenoh.Config.from_json5(Link(router.endpoint).to_wire())
    config.insert_json5("transport/unicast", json.dumps(unicast))
    with zenoh.open(config) as session:
        session.declare_subscriber("rems/**/a/**/b", lambda _: None)
        until(lambda: "`**` elsewhere" in router.screen)
