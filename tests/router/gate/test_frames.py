"""Reading what clients send: held against what real sessions of Zenoh really sent."""

import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import pytest
import zenoh

from rems_net.router.gate import messages
from rems_net.router.gate.frames import MESSAGES, Reader
from rems_net.router.gate.wire import number
from rems_net.router.relay.handshake import hello
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until
from tests.router.gate.wire import Wire, wire

#: bytes that look like wildcards and headers, wherever they stand
ODD = b"a/**/a$*b*/@\x05\x1d\x9e\xff" * 9
#: of a message with a sequence number: a reliable frame
FRAME = b"\x25\x01"


@contextmanager
def router() -> Iterator[tuple[Session, int]]:
    """Yield a router and its port."""
    port = free_port()
    with Session(Link(f"tcp/127.0.0.1:{port}", serve=True)) as session:
        yield session, port


def judge() -> Callable[[bytes], str | None]:
    return Reader().feed


@contextmanager
def client(relay: Wire) -> Iterator[zenoh.Session]:
    link = Link(relay.endpoint)
    with zenoh.open(zenoh.Config.from_json5(link.to_wire())) as session:
        yield session


def _is_watched(publisher: Any) -> bool:
    return bool(publisher.matching_status.matching)


def talk(one: zenoh.Session, other: zenoh.Session) -> tuple[set[str], set[str]]:
    """Send one of everything; return the keys sent, and the keys that came."""
    sent, came = set(), set()
    kept: list[object] = []

    def file(sample: zenoh.Sample) -> None:
        came.add(str(sample.key_expr))

    def answer(query: zenoh.Query) -> None:
        with query:
            if "fail" in query.parameters:
                query.reply_err(ODD)
            else:
                query.reply("rems/robot/sim/found", ODD, attachment=ODD)

    for key in ("rems/robot/*/state/**", "rems/ca$*/x", "rems/big", "rems/plain/*"):
        sent.add(key)
        kept.append(one.declare_subscriber(key, zenoh.handlers.Callback(file)))
    kept.append(one.declare_queryable("rems/robot/sim/**", answer, complete=True))
    kept.append(one.liveliness().declare_token("rems/robot/sim/@alive"))
    alive = "rems/*/*/@alive"
    kept.append(one.liveliness().declare_subscriber(alive, file, history=True))
    sent |= {"rems/robot/sim/**", "rems/robot/sim/@alive", "rems/*/*/@alive"}
    until(lambda: "rems/robot/sim/@alive" in came)
    encoding = zenoh.Encoding("application/msgpack;state@1f2e")
    publisher = other.declare_publisher("rems/robot/sim/state", encoding=encoding)
    known = other.declare_keyexpr("rems/robot/known/state")
    until(lambda: _is_watched(publisher))
    block = zenoh.CongestionControl.BLOCK
    for n, priority in enumerate(
        (
            zenoh.Priority.REAL_TIME,
            zenoh.Priority.INTERACTIVE_HIGH,
            zenoh.Priority.DATA,
            zenoh.Priority.BACKGROUND,
        )
    ):
        key = f"rems/robot/sim/state/{n}"
        other.put(
            key,
            ODD,
            express=True,
            priority=priority,
            congestion_control=block,
            timestamp=other.new_timestamp(),
            attachment=ODD,
        )
        sent.add(key)
    for size in (0, 1, 42, 300):
        publisher.put(ODD[:1] * size)
    other.put(known, b"*")
    other.put("rems/robot/*/state/**", b"", congestion_control=block)
    other.put("rems/cat/x", b"/**/")
    other.put("rems/big", ODD * 5_000, congestion_control=block)
    other.delete("rems/robot/sim/state/gone", attachment=ODD)
    # a key of 42 bytes: its length looks like a star
    other.declare_publisher("rems/plain/" + "k" * 31).put(b"")
    other.put("rems/plain/" + "k" * 31, b"", congestion_control=block)
    sent |= {"rems/robot/sim/state", "rems/robot/known/state", "rems/cat/x"}
    sent |= {"rems/robot/sim/state/gone", "rems/plain/" + "k" * 31}
    for selector in (
        "rems/robot/sim/found?a=1;b=**",
        "rems/robot/*/found?" + "x" * 10_000,
        "rems/robot/sim/*?fail",
    ):
        sent.add(selector.partition("?")[0])
        (reply,) = other.get(
            selector,
            target=zenoh.QueryTarget.ALL,
            payload=ODD,
            attachment=ODD,
            encoding=encoding,
            timeout=5,
        )
        key = str(reply.ok.key_expr) if reply.ok else ""
        assert key == ("" if "fail" in selector else "rems/robot/sim/found")
        sent |= {key} - {""}
    list(other.declare_querier("rems/robot/*/found").get())
    list(other.liveliness().get("rems/**"))
    sent.add("rems/**")
    until(lambda: {"rems/big", "rems/robot/sim/state/gone", "rems/cat/x"} <= came)
    other.undeclare(known)
    return sent, came


@pytest.fixture(scope="module")
def real() -> tuple[list[bytes], set[str], set[str]]:
    """What two real sessions sent, batch by batch, and the keys sent and received."""
    with router() as (_, port), wire(port, judge) as relay:
        with client(relay) as one, client(relay) as other:
            sent, came = talk(one, other)
        assert relay.refused == []
        return [batch for batches in relay.sent for batch in batches], sent, came


def test_all_that_a_real_session_sends_is_read_and_let_through(
    real: tuple[list[bytes], set[str], set[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    batches, sent, came = real
    ids: dict[int, str] = {}
    read: set[str] = set()
    key, is_wild = messages._key, messages._is_wild

    def spy_key(data: bytes, at: int, flags: int, wild: set[int]) -> int:
        end = key(data, at, flags, wild)
        scope, at = number(data, at)
        start = ids.get(scope, "")
        named = flags & 0x20
        read.add(start + data[number(data, at)[1] : end].decode() if named else start)
        return end

    def spy_id(data: bytes, at: int, flags: int) -> bool:
        length, start = number(data, at + 1)
        ids[data[at - 1]] = data[start : start + length].decode()
        return is_wild(data, at, flags)

    monkeypatch.setattr(messages, "_key", spy_key)
    monkeypatch.setattr(messages, "_is_wild", spy_id)
    reader = Reader()
    assert [reader.feed(batch) for batch in batches] == [None] * len(batches)
    assert came <= read
    # The sessions may use ids that the router has declared, which are not read here.
    assert sent - read <= {key for key in sent if key in came}
    assert {key for key in read if key.startswith("rems")} - sent <= {
        *ids.values(),
        *(f"rems/{rest}" for rest in ("robot", "robot/sim", "plain")),
    }
    assert any(b"*" in key.encode() for key in read)


def put(key: bytes, scope: int = 0) -> bytes:
    return FRAME + bytes([0x3D, scope, len(key)]) + key + b"\x01\x00"


@pytest.mark.parametrize(
    ("batch", "why"),
    [
        (put(b"team1/**/a/**/a"), "which has `**` elsewhere than at its end"),
        (put(b"/**/a/**/a", 3), "`**` elsewhere"),
        (put(b"**/a", 3), "more than one"),
        (put(b"/".join([b"a"] * 13)), "13 chunks"),
        (put(b"\xff\xfe"), "is no text"),
        (put(b"a\x1b[2J#"), r"'a\x1b[2J#'"),
        (put(b"rems/x")[:-3], "cut off"),
        (FRAME + b"\x1d\x00\x01\x00", "without a key"),
        (FRAME + b"\x3d\x00\x80\x08" + b"a" * 1024 + b"\x01\x00", "of 1024 bytes"),
        # subscribers, queryables, tokens, interests, questions and answers
        (FRAME + b"\x1e\x22\x01\x00\x04**/a", "`**` elsewhere"),
        (FRAME + b"\x1e\x24\x01\x00\x04a**b", "more than one"),
        (FRAME + b"\x1e\x26\x01\x00\x02a#", "one of"),
        (FRAME + b"\x1e\x83\x01\x5f\x06\x01\x00**/a", "`**` elsewhere"),
        (FRAME + b"\x79\x01\x32\x00\x04**/a", "`**` elsewhere"),
        (FRAME + b"\x3c\x01\x00\x04**/a\x03", "`**` elsewhere"),
        (FRAME + b"\x3b\x01\x00\x04**/a\x04\x01\x00", "`**` elsewhere"),
        # ids for wildcards and more, and ids by the help of ids
        (FRAME + b"\x1e\x20\x05\x00\x04**/a", "`**` elsewhere"),
        (FRAME + b"\x1e\x20\x05\x04\x02/a", "by the help of another"),
        (FRAME + b"\x1e\x00\x05\x04\x1a\x01", "by the help of another"),
        # what is not known: an extension, shared memory, gossip, a second handshake
        (FRAME + b"\xbd\x00\x01a\x47\x01\x01\x01\x00", "extension 0x47"),
        (FRAME + b"\x3d\x00\x01a\x81\x12\x00", "extension 0x12"),
        (FRAME + b"\xbd\x00\x01a\x42\x05\x01\x01\x01\x01\x00", "of a wrong length"),
        (FRAME + b"\x1f\x01", "unknown kind"),
        (b"\x01\x09\x00", "unknown kind"),
        (b"\x1d\x00", "unknown kind"),
        (b"\x04" * 65, "too many"),
        (FRAME + b"\x1a\x01" * (MESSAGES + 1), "too many"),
        # a message in fragments: its first piece has the whole key
        (b"\xe6\x01\x02\x3d\x00\x0f**/", "cut off"),
        (b"\xe6\x01\x02\x3d\x00\x04**/a\x01\x00", "`**` elsewhere"),
        (b"\xe6\x01\x02\x1e\x22\x01\x00\x01a", "unknown kind"),
    ],
)
def test_what_would_hurt_the_router_is_refused(batch: bytes, why: str) -> None:
    assert why in str(Reader().feed(batch))


def test_nothing_follows_an_id_that_may_stand_for_wildcards() -> None:
    declared, gone = b"\x1e\x20\x05\x00\x03a/*", b"\x1e\x01\x05"
    again = b"\x1e\x20\x05\x00\x01b"
    below, theirs = b"\x7d\x05\x02/*\x01\x00", b"\x3d\x05\x02/*\x01\x00"
    assert Reader().feed(FRAME + again + below) is None
    reader = Reader()
    assert reader.feed(FRAME + declared + b"\x5d\x05\x01\x00" + theirs) is None
    # The router may have dropped the frame with the second meaning.
    assert reader.feed(FRAME + gone + again) is None
    assert "in two pieces" in str(reader.feed(FRAME + below))
    many = (b"\x1e\x20%c%c\x00\x01*" % (0x80 | n & 0x7F, n >> 7) for n in range(1001))
    assert "more than 1000 ids" in str(Reader().feed(FRAME + b"".join(many)))


def test_fragments_need_marks() -> None:
    first, later = b"\xe6\x01\x02" + put(b"rems/x")[2:], b"\x66\x02**/a/**/a"
    marked = Reader()
    assert (marked.feed(first), marked.feed(later)) == (None, None)
    plain = Reader(marks=False)
    assert "before 1.1" in str(plain.feed(later))
    assert plain.feed(put(b"rems/x")) is None


@pytest.mark.parametrize(
    ("patch", "marks"),
    [(b"", False), (b"\x00", False), (b"\x01", True), (b"\x80\x02", False)],
)
def test_marks_are_what_zenoh_takes_for_them(patch: bytes, marks: bool) -> None:
    """Zenoh reads the lowest byte of the number: 256 means none."""
    header, extension = (b"\x81", b"\x27") if patch else (b"\x01", b"")
    syn = header + b"\x09\x02" + b"\x07" + extension + patch
    assert hello(syn).marks is marks


def mutated(batch: bytes, draw: random.Random) -> bytes:
    """Return a batch with some of its bytes replaced, put in, or taken out."""
    found = bytearray(batch)
    for _ in range(draw.randrange(1, 4)):
        at = draw.randrange(min(len(found), 400))
        piece = bytes(
            [draw.choice((*b"*$#?/\x00\x05\x1d\x9e\xff", draw.randrange(256)))]
        )
        found[at : at + draw.randrange(2)] = piece * draw.randrange(3)
        if not found:
            return b"\x04"
    return bytes(found)


def test_nothing_that_is_sent_makes_the_reader_raise_or_dwell(
    real: tuple[list[bytes], set[str], set[str]],
) -> None:
    draw = random.Random(2)
    passed = slowest = 0.0
    for _ in range(5_000):
        batch = mutated(draw.choice(real[0]), draw)
        begun = time.thread_time()
        passed += Reader().feed(batch) is None
        slowest = max(slowest, time.thread_time() - begun)
    assert passed > 500
    assert slowest < 0.05


def _more(came: list[str], than: int) -> bool:
    return len(came) > than


def spoil(count: int, seed: int) -> None:
    """Let a router have what the reader lets through of spoiled messages."""
    draw = random.Random(seed)
    came: list[str] = []
    with router() as (_, port), wire(port, judge) as good, client(good) as witness:
        witness.declare_subscriber("rems/here", lambda s: came.append(str(s.key_expr)))
        with wire(port, judge, lambda batch: mutated(batch, draw)) as bad:
            for n in range(count):
                with client(bad) as session:
                    session.declare_subscriber(f"rems/a{n}/b", lambda _: None)
                    session.declare_publisher(f"rems/k{n}/*")
                    session.put(f"rems/a{n}/b", b"1")
                witness.put("rems/here", b"")
                until(partial(_more, came, n))


def test_what_the_reader_lets_through_leaves_the_router_alive() -> None:
    spoil(40, 5)


@pytest.mark.slow
def test_much_that_the_reader_lets_through_leaves_the_router_alive() -> None:
    spoil(1_000, 6)
