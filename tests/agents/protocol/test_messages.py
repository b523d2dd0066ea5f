"""Every word between a clock and its hosts: read with all checks, or refused."""

import random
from typing import Any

import pytest

from rems_net.agents.about.reasons import KINDS
from rems_net.agents.about.wiring import Entry, reads_itself
from rems_net.agents.protocol.complaints import Complaints
from rems_net.agents.protocol.messages import (
    Age,
    Beat,
    pack_age,
    pack_beat,
    read_age,
    read_beat,
    read_farewell,
    read_request,
)
from rems_net.agents.protocol.roster import Roster, entry_to_plain
from rems_net.agents.tick import Tick
from rems_net.errors import WireError
from rems_net.router.message import Stamp, pack, pack_stamp, read, read_stamp
from tests.agents.protocol.fuzz import (
    DIGEST,
    ENTRY,
    OTHERS,
    READERS,
    REQUEST,
    ROSTER,
    RUN,
    attack,
    keys_of_the_page,
)


def test_the_page_names_every_key_and_each_has_a_reader() -> None:
    asked = {key for key in READERS if ", answered" not in key}
    assert keys_of_the_page() == asked | OTHERS | {"rems/clock/roster"}


def test_a_short_attack() -> None:
    taken = attack(random.Random(2026), 60_000)
    assert all(taken.values()), taken


@pytest.mark.parametrize("key", READERS)
def test_what_is_written_is_read(key: str) -> None:
    reader, messages = READERS[key]
    for message in messages:
        reader(message)


def test_words_come_back() -> None:
    tick = Tick(7, 0.7, 0.1, 1.0, 3)
    assert read_beat(pack_beat(RUN, tick, 2)) == Beat(RUN, tick, 2)
    assert read_request(REQUEST.to_wire()) == REQUEST
    silent = read(REQUEST.to_wire())
    assert silent.pop("numerics") == REQUEST.numerics
    assert read_request(pack(silent)).numerics == ""
    assert Roster.from_wire(ROSTER.to_wire()) == ROSTER
    assert read_age(pack_age(RUN, float("inf"), 0)) == Age(RUN, float("inf"), 0)
    assert read_stamp(pack_stamp(7, 0.7, 5)) == Stamp(7, 0.7, 5, 7)
    assert read_stamp(pack_stamp(7, 0.7, 5, 3)) == Stamp(7, 0.7, 5, 3)
    assert len(pack_stamp(7, 0.7, 2**63)) <= 22


BEAT = [RUN, 7, 0.7, 0.1, 1.0, 3, 0]


@pytest.mark.parametrize(
    ("at", "value"),
    [
        (0, 0),
        (0, 2**40),
        (1, 0),
        (1, "7"),
        (1, True),
        (1, 2**60),
        (2, float("inf")),
        (2, float("nan")),
        (2, 1),
        (3, 0.0),
        (3, 1e300),
        (4, -1.0),
        (4, "fast"),
        (5, -1),
        (5, None),
        (6, 0.5),
    ],
)
def test_a_tick_that_is_none(at: int, value: Any) -> None:
    words = [*BEAT[:at], value, *BEAT[at + 1 :]]
    with pytest.raises(WireError, match="expected a tick"):
        read_beat(pack(words))


@pytest.mark.parametrize("payload", [5.5, {}, [], [1] * 8, "tick", None])
def test_other_shapes(payload: Any) -> None:
    for key, (reader, _) in READERS.items():
        if "@call" not in key:
            with pytest.raises(WireError):
                reader(pack(payload))


def changed(**more: Any) -> bytes:
    return pack(read(REQUEST.to_wire()) | more)


def entry(**more: Any) -> list[dict[str, Any]]:
    return [entry_to_plain(ENTRY) | more]


@pytest.mark.parametrize(
    ("payload", "sentence"),
    [
        (changed(agents=[]), "its agents is []; expected one or more."),
        (
            changed(agents=[{}]),
            "an agent is {}; expected a map of key, host, outs, reads, every, "
            "lockstep, since, badge.",
        ),
        (
            changed(agents=entry(key=5)),
            "an agent is 5; expected <kind>/<name>, such as 'robot/sim'.",
        ),
        (
            changed(agents=entry(key="wheel/sim")),
            "an agent is 'wheel/sim'; expected <kind>/<name>, such as 'robot/sim'.",
        ),
        (
            changed(agents=entry(key="clock/tick")),
            "an agent is 'clock/tick'; expected <kind>/<name>, such as 'robot/sim'.",
        ),
        (
            changed(agents=entry(key="robot/\x1b[2J")),
            r"an agent is '\x1b[2J'; a name has 1 to 63 letters, digits, '_', '-' or "
            "'.', begins with a letter or a digit, and ends with no '.'.",
        ),
        (
            changed(agents=entry(every=0)),
            "every of robot/sim is 0; expected a whole number from 1 to "
            "9007199254740992.",
        ),
        (
            changed(agents=entry(badge=7)),
            "the badge of robot/sim is 7; expected 0, before it joins.",
        ),
        (
            changed(agents=entry(host="other")),
            "the host of robot/sim is 'other'; expected 'robot/sim', its own.",
        ),
        (
            changed(closing="//##"),
            "closing is '//##'; expected a port of its own, such as 'robot/sim/state'.",
        ),
        (
            changed(closing="robot/b/state"),
            "closing is 'robot/b/state'; expected a port of its own, such as "
            "'robot/sim/state'.",
        ),
        (changed(schemas={}), f"its schemas is []; expected {DIGEST} of robot/sim."),
        (
            changed(schemas={"\0": b""}),
            r"a schema's digest is '\x00'; expected a digest of 16 hexadecimal digits.",
        ),
        (
            changed(machine="lap\x1b]0;top"),
            r"its machine is 'lap\x1b]0;top'; expected at most 255 printable "
            "characters.",
        ),
        (changed(pid=-1), "its pid is -1; expected a whole number from 0 to"),
        (changed(ticket="x"), "its ticket is 'x'; expected a whole number from 0 to"),
        (changed(numerics=1), "its numerics is 1; expected at most 300 printable"),
        (changed(numerics="x" * 301), "its numerics is 'xxx"),
    ],
)
def test_a_host_that_joins_with_nonsense(payload: bytes, sentence: str) -> None:
    with pytest.raises(WireError) as caught:
        read_request(payload)
    assert str(caught.value).startswith(sentence)


def test_an_agent_twice() -> None:
    with pytest.raises(WireError, match="expected each of them once"):
        read_request(changed(agents=entry() * 2))


def test_last_words_are_fit_to_be_shown() -> None:
    words = {"badge": 5, "made": [], "failed": ["robot/a", "it said \x1b[31m"]}
    assert read_farewell(pack(words)).failed == ("robot/a", "it said ?[31m")
    for failed in (["a"], "ab", 5, ["a", 5], ["a", "b", "c"], ["a", "x" * 5_000]):
        with pytest.raises(WireError):
            read_farewell(pack(words | {"failed": failed}))


def test_a_roster_without_a_schema() -> None:
    bad = Roster(1, 1, {"robot/sim": ENTRY}, {})
    with pytest.raises(WireError, match="it has no schema for robot/sim/state"):
        Roster.from_wire(bad.to_wire())


def test_each_kind_of_complaint_is_told_once_and_counted() -> None:
    told: list[str] = []
    complaints = Complaints(lambda kind, text: told.append(text))
    complaints.about("rems/clock/tick", "it is -1; expected a tick.")
    complaints.about("rems/clock/tick", "it has no badge.")
    for n in range(50_000):  # most of which are counted, and not looked at
        complaints.about("rems/clock/tick", f"it is {n}; expected a tick.")
    assert told == [
        "what came at rems/clock/tick is passed over: it is -1; expected a tick.",
        "what came at rems/clock/tick is passed over: it has no badge.",
    ]
    for n in range(3 * KINDS):
        complaints.about(f"rems/robot/{'abcdefghij'[n % 10]}{n}/state", "no badge.")
    assert len(told) == KINDS + 2  # two of them at one key
    told.clear()
    complaints.total()
    assert told[0] == "50002 messages at rems/clock/tick were passed over"
    assert len(told) == 2


def test_a_process_that_hears_itself() -> None:
    """What it wrote does not make what it hears older; what others say does."""
    agents = {
        key: Entry(key, key, {"value": DIGEST}, reads)
        for key, reads in {
            "input/keys": [],
            "process/a": ["input/keys", "process/b/value"],
            "process/b": ["process/a/value"],
            "process/c": ["robot/x/value"],
            "robot/x": ["process/c/value"],
        }.items()
    }
    assert reads_itself(agents, "process/a", "process/b")
    assert not reads_itself(agents, "process/a", "input/keys")
    assert not reads_itself(agents, "process/c", "robot/x")
