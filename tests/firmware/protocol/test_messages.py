"""What the firmware says and hears, held against what a clock and its hosts do."""

import random
from ctypes import byref, c_size_t, c_uint64
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from rems_net.agents.about.wiring import Entry
from rems_net.agents.protocol import messages
from rems_net.agents.tick import Tick, time_of
from rems_net.errors import WireError
from rems_net.router.message import BADGES, LAST_TICK, pack, pack_stamp, read_stamp
from tests.defdict.fuzz import mutate
from tests.firmware.golden import schemas
from tests.firmware.protocol.core import Core, Request, Stamp

TRIES = 3000
RUN, BADGE = 0x9A_1234_5678, 0x9A_1234_5678 << 24 | 7

ticks = st.integers(0, LAST_TICK)
badges = st.integers(0, BADGES - 1)
#: the C library is one for all examples: nothing in it changes
laws = settings(max_examples=300)


# -- what it says -------------------------------------------------------------


@laws
@given(n=ticks, badge=badges, back=st.integers(0, 300), t=st.floats(0, 1e9))
def test_a_stamp_is_pythons(
    core: Core, n: int, badge: int, back: int, t: float
) -> None:
    said = max(0, n - back)
    stamp = Stamp(n, badge, said, t)
    made = core.written("stamp", byref(stamp), room=37)
    assert made == pack_stamp(n, t, badge, said)
    found = core.read("stamp", made)
    assert found is not None
    assert found.words() == stamp.words()
    done = core.written("done", c_uint64(badge), c_uint64(n), room=37)
    assert done == messages.pack_done(badge, n)


@pytest.mark.parametrize("source", ["", "input/keys", "process/drive/told"])
@pytest.mark.parametrize("stopped", [False, True])
def test_a_request_is_one(core: Core, source: str, stopped: bool) -> None:
    ours = Request(b"robot/woodbot-7", 2**53 - 1, source.encode(), stopped)
    made = core.written("request", c_size_t(1700), byref(ours), room=1700)
    asked = messages.read_request(made)
    outs = {port: schema.digest for port, schema in schemas().items()}
    entry = Entry(
        "robot/woodbot-7",
        "robot/woodbot-7",
        outs,
        [source] if source else [],
        lockstep=False,
    )
    wanted = messages.Request(
        "robot/woodbot-7",
        "woodbot-7",
        2**53 - 1,
        "",
        [entry],
        {schema.digest: schema.to_wire() for schema in schemas().values()},
        stopped,
        0,
        asked.numerics,
    )
    assert asked == wanted
    assert made == wanted.to_wire()
    assert asked.numerics.startswith("Woodbot ")


def test_what_does_not_fit_is_not_said(core: Core) -> None:
    ours = Request(b"robot/woodbot-7", 1, b"", False)
    whole = core.written("request", c_size_t(4096), byref(ours))
    for room in (0, 1, 100, len(whole) - 1):
        assert not core.written("request", c_size_t(room), byref(ours), room=room)
    exact = core.written("request", c_size_t(len(whole)), byref(ours), room=len(whole))
    assert exact == whole


def test_a_farewell_is_one(core: Core) -> None:
    wanted = messages.Farewell(BADGE, [], None)
    made = core.written("farewell", c_size_t(300), c_uint64(BADGE), room=300)
    assert messages.read_farewell(made) == wanted
    assert made == wanted.to_wire()


def test_badge_schemas_and_stop(core: Core) -> None:
    made = core.written("badge", c_uint64(BADGE), room=37)
    assert messages.read_badge(made) == BADGE
    told = pack({port: schema.to_wire() for port, schema in schemas().items()})
    assert core.written("schemas", c_size_t(4096)) == told
    assert core.takes("stop_read", messages.STOP)
    assert not any(
        core.takes("stop_read", bad) for bad in (b"", b"\xc2", b"\xc3\xc3", b"\x01")
    )


# -- what it hears ------------------------------------------------------------


def beat(n: int = 412) -> bytes:
    return messages.pack_beat(RUN, Tick(n, time_of(n, 0.02), 0.02, 1.0, 3), 2)


def admission() -> bytes:
    return pack(messages.Admission(BADGE, 17, 0.02, 3, 30.0)._asdict())


def claims() -> list[bytes]:
    return [
        pack((BADGE, "robot/mine of a laptop")),
        pack((1, "")),
        pack((7, "a" * 100)),
    ]


#: message -> some of it that are right, and what Python reads of one
SEEDS: dict[str, tuple[list[bytes], Any]] = {
    "beat": ([beat(), beat(1), beat(LAST_TICK)], messages.read_beat),
    "stamp": (
        [pack_stamp(412, 8.24, BADGE), pack([7, 0.5]), pack_stamp(9, 0.1, 1, 2)],
        read_stamp,
    ),
    "admission": ([admission()], messages.read_admission),
    "age": (
        [messages.pack_age(RUN, s, 2) for s in (0.0, 0.031, float("inf"))],
        messages.read_age,
    ),
    "claim": (claims(), messages.read_claim),
}


def told(name: str, plain: Any) -> dict[str, Any]:
    """What Python has read, in the words of the firmware."""
    if name == "beat":
        words = plain.tick._asdict() | {"run": plain.run, "stops": plain.stops}
        return dict(words)
    if name == "claim":
        return {"badge": plain.badge, "holder": plain.holder.encode()}
    return dict(plain._asdict())


@pytest.mark.parametrize("name", SEEDS)
def test_what_is_right_is_taken(core: Core, name: str) -> None:
    for payload in SEEDS[name][0]:
        found = core.read(name, payload)
        assert found is not None, payload.hex()
        assert found.words() == told(name, SEEDS[name][1](payload))


@pytest.mark.parametrize("name", SEEDS)
def test_nothing_is_taken_that_python_refuses(core: Core, name: str) -> None:
    seeds, read = SEEDS[name]
    rng = random.Random(f"{name} 1")
    taken = 0
    for _ in range(TRIES):
        payload = mutate(rng, seeds)
        found = core.read(name, payload)
        try:
            wanted = told(name, read(payload))
        except WireError:
            assert found is None, payload.hex()
            continue
        if found is not None:
            taken += 1
            assert found.words() == wanted, payload.hex()
    assert taken > 0


@pytest.mark.parametrize("name", SEEDS)
def test_a_part_of_a_message_is_none(core: Core, name: str) -> None:
    for payload in SEEDS[name][0]:
        for size in range(len(payload)):
            assert core.read(name, payload[:size]) is None
        assert core.read(name, payload + b"\xc0") is None


@pytest.mark.parametrize(
    "bad",
    [
        [RUN, 0, 0.02, 0.02, 1.0, 3, 2],
        [RUN, 1, float("nan"), 0.02, 1.0, 3, 2],
        [RUN, 1, 0.02, float("inf"), 1.0, 3, 2],
        [RUN, 1, 0.02, 0.02, -1.0, 3, 2],
        [RUN, 1, 0.02, 0.02, 1, 3, 2],
        [RUN, True, 0.02, 0.02, 1.0, 3, 2],
        [RUN, -1, 0.02, 0.02, 1.0, 3, 2],
        [0, 1, 0.02, 0.02, 1.0, 3, 2],
        [2**40, 1, 0.02, 0.02, 1.0, 3, 2],
        [RUN, 2**53 + 1, 0.02, 0.02, 1.0, 3, 2],
        [RUN, 1, 0.02, 0.02, 1.0, 3],
        {"run": RUN},
    ],
)
def test_no_tick(core: Core, bad: Any) -> None:
    with pytest.raises(WireError):
        messages.read_beat(pack(bad))
    assert core.read("beat", pack(bad)) is None


def test_a_word_that_comes_twice_is_refused(core: Core) -> None:
    twice = b"\x85" + pack("badge") + pack(BADGE)
    twice += b"".join(
        pack(key) + pack(word)
        for key, word in (("badge", 9), ("dt", 0.1), ("stops", 0), ("patience", 30.0))
    )
    assert core.read("admission", twice) is None


# -- the others --------------------------------------------------------------


def test_the_newest_tick_of_a_clock(core: Core) -> None:
    plain = Tick(412, 8.24, 0.02, 0.5, 3).to_plain() | {"stops": 0}
    assert core.newest(pack(plain)) == 412
    for bad in ({}, {"t": 1.0}, plain | {"n": 0.5}, [1, 2]):
        assert core.newest(pack(bad)) is None


def test_calls_take_no_arguments(core: Core) -> None:
    for good in (b"", pack({"args": [], "kwargs": {}}), pack({"args": []}), pack({})):
        assert core.takes("call_read", good)
    for bad in (
        pack({"args": [1], "kwargs": {}}),
        pack({"kwargs": {"a": 1}}),
        pack({"what": []}),
        pack(7),
        b"\xc1",
    ):
        assert not core.takes("call_read", bad)
