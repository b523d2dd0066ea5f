"""Real sessions on the loopback: publish, watch, ask, answer, presence."""

import json
import signal
import threading
from collections.abc import Iterator
from math import inf

import pytest

from rems_net.errors import FabricError, WireError
from rems_net.router.mail import MAX_PAYLOAD, Mail, Mailbox, Presence, Question
from rems_net.router.message import UNSTAMPED, Stamp, pack, pack_stamp
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until

#: a router and a client of it
Pair = tuple[Session, Session]


@pytest.fixture
def pair() -> Iterator[Pair]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with (
        Session(Link(endpoint, serve=True)) as router,
        Session(Link(endpoint)) as client,
    ):
        yield router, client


def letter(box: Mailbox) -> Mail:
    mail = box.get(20.0)
    assert isinstance(mail, Mail)
    return mail


def sent(pair: Pair, payload: bytes, stamp: bytes | None = None) -> Mail:
    """Return what the router gets of a value that the client publishes."""
    router, client = pair
    box = Mailbox()
    router.watch("rems/a", box)
    publisher = client.publisher("rems/a")
    until(lambda: publisher.watched)
    publisher.put(payload, stamp)
    return letter(box)


def test_a_value_arrives_with_its_tick_and_schema(pair: Pair) -> None:
    router, client = pair
    box = Mailbox()
    router.watch("rems/robot/*/state", box)
    publisher = client.publisher("rems/robot/a/state", "cart.state@12ab")
    until(lambda: publisher.watched)
    publisher.put(b"\x80", pack_stamp(7, 0.7))
    mail = letter(box)
    assert (mail.key, mail.payload) == ("rems/robot/a/state", b"\x80")
    assert (mail.schema, mail.stamp()) == ("cart.state@12ab", Stamp(7, 0.7, 0, 7))


def test_a_publisher_knows_whether_it_is_watched(pair: Pair) -> None:
    router, client = pair
    publisher = client.publisher("rems/robot/a/state")
    assert publisher.watched is False
    watch = router.watch("rems/robot/a/state", Mailbox())
    until(lambda: publisher.watched is True)
    watch.close()
    until(lambda: publisher.watched is False)


def test_a_value_without_a_stamp_has_no_tick(pair: Pair) -> None:
    router, client = pair
    box = Mailbox()
    router.watch("rems/a", box)
    client.put("rems/a", b"\x01")
    mail = letter(box)
    assert (mail.stamp(), mail.schema) == (UNSTAMPED, "")


@pytest.mark.parametrize(
    "stamp",
    [b"\xc1", b"\x93\x01\x02\x03", b"\xa1x", pack([inf, 0.0]), pack([1, inf])],
)
def test_a_stamp_of_nonsense_is_refused(pair: Pair, stamp: bytes) -> None:
    mail = sent(pair, b"\x01", stamp)
    with pytest.raises(WireError):
        mail.stamp()


def test_ask_and_answer(pair: Pair) -> None:
    router, client = pair
    box = Mailbox()
    router.answer("rems/robot/a/**", box)

    def answer() -> None:
        question = box.get(20.0)
        assert isinstance(question, Question)
        with question:
            assert question.parameters == {"format": "json"}
            assert question.covers("rems/robot/a/state")
            question.answer("rems/robot/a/state", b"{}", "s@1", pack_stamp(1, 0.1))

    thread = threading.Thread(target=answer)
    thread.start()
    (mail,) = until(lambda: client.ask("rems/robot/*/state?format=json", timeout=20.0))
    thread.join()
    assert (mail.key, mail.payload) == ("rems/robot/a/state", b"{}")
    assert (mail.schema, mail.stamp()) == ("s@1", Stamp(1, 0.1, 0, 1))


def test_a_refusal_is_raised_with_its_own_words(pair: Pair) -> None:
    router, client = pair
    box = Mailbox()
    router.answer("rems/clock/@join", box)

    def refuse() -> None:
        question = box.get(20.0)
        assert isinstance(question, Question)
        with question:
            question.refuse("There is a robot/sim already.")

    thread = threading.Thread(target=refuse)
    thread.start()
    with pytest.raises(FabricError, match="There is a robot/sim already"):
        until(lambda: client.ask("rems/clock/@join", b"x", timeout=20.0))
    thread.join()


def test_presence_comes_and_goes() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with Session(Link(endpoint, serve=True)) as router:
        box = Mailbox()
        router.watch_presence("rems/*/*/@alive", box)
        with Session(Link(endpoint)) as client:
            client.present("rems/robot/a/@alive")
            assert box.get(20.0) == Presence("rems/robot/a/@alive", True)
            until(lambda: router.who("rems/*/*/@alive") == ["rems/robot/a/@alive"])
        assert box.get(20.0) == Presence("rems/robot/a/@alive", False)


def test_a_thousand_agents_that_are_known_already_block_nothing(pair: Pair) -> None:
    """Their answers come before the question returns: more than Zenoh's queue holds."""
    one, other = pair
    keys = [other.key("robot", f"r{i:03d}", "@alive") for i in range(1000)]
    for key in keys:
        other.present(key)
    box = Mailbox()
    one.watch_presence(one.key("*", "*", "@alive"), box)
    until(lambda: one.who(one.key("*", "*", "@alive")) == keys)


def test_no_router_says_what_to_start() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with pytest.raises(FabricError) as caught:
        Session(Link(endpoint, timeout=0.2)).open()
    assert str(caught.value).startswith(f"No router answers at {endpoint}. Start one")


def test_a_taken_port_is_said(pair: Pair) -> None:
    router, _ = pair
    with pytest.raises(
        FabricError,
        match=r"^Cannot be the router at .*: another program has this port, ",
    ):
        Session(Link(router.link.endpoint, serve=True)).open()


def test_closing_twice_is_fine_and_using_after_is_said() -> None:
    session = Session(Link(f"tcp/127.0.0.1:{free_port()}", serve=True))
    session.open()
    session.close()
    session.close()
    with pytest.raises(FabricError, match="This session is closed"):
        session.put("rems/a", b"")


def test_settings_on_the_wire_are_a_star_without_multicast() -> None:
    client = json.loads(Link("tcp/10.0.0.1:7447", lease=2.0).to_wire())
    assert client["mode"] == "client"
    assert client["connect"]["endpoints"] == ["tcp/10.0.0.1:7447"]
    assert client["scouting"]["multicast"]["enabled"] is False
    assert client["transport"]["link"]["tx"]["lease"] == 2000
    router = json.loads(Link("tcp/0.0.0.0:7447", serve=True).to_wire())
    assert router["mode"] == "router"
    assert router["listen"]["endpoints"] == ["tcp/0.0.0.0:7447"]
    assert router["transport"]["unicast"]["accept_pending"] == 500
    assert "connect" not in router
    assert router["scouting"]["delay"] == 0  # else it opens half a second later
    # what is shared is behind a gate, which answers those who look for it
    inner = "tcp/127.0.0.1:7448"
    shared = Link("tcp/0.0.0.0:7447", serve=True, behind=inner).to_wire()
    assert json.loads(shared)["listen"]["endpoints"] == [inner]
    assert json.loads(shared)["scouting"]["multicast"]["enabled"] is False


def test_a_payload_beyond_the_bound_is_not_read(pair: Pair) -> None:
    mail = sent(pair, bytes(MAX_PAYLOAD + 1))
    with pytest.raises(WireError, match="16777217 bytes came; expected at most"):
        _ = mail.payload


def test_a_thread_of_zenoh_keeps_its_python_state(pair: Pair) -> None:
    """Otherwise Python makes a new one for each message, which costs many ticks."""
    router, client = pair
    kept = threading.local()
    seen: list[tuple[int, int]] = []

    def count(_: Question) -> None:
        kept.calls = getattr(kept, "calls", 0) + 1
        seen.append((threading.get_ident(), kept.calls))

    router.answer_at_once("rems/asked", count)
    for _ in range(40):
        client.ask("rems/asked")
    for thread in {thread for thread, _ in seen}:  # a shared router has several
        calls = [n for who, n in seen if who == thread]
        assert calls == list(range(1, len(calls) + 1))
    assert len(seen) == 40


def test_ctrl_c_in_a_callback_is_not_lost(pair: Pair) -> None:
    """What a session tells itself is answered in the thread that asks."""
    router, _ = pair
    asked = []

    def answer(question: Question) -> None:
        asked.append(threading.current_thread() is threading.main_thread())
        signal.raise_signal(signal.SIGINT)

    router.answer_at_once("rems/robot/a/state", answer)

    def ask() -> None:
        router.ask("rems/robot/a/state", timeout=0.2)
        threading.Event().wait(20)

    with pytest.raises(KeyboardInterrupt):
        ask()
    assert asked == [True]
