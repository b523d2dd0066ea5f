"""A flood at any key changes nothing of others; a frozen watcher delays nobody."""

import sys
from pathlib import Path
from threading import Event

import pytest

from rems_net.router.mail import MAX_PAYLOAD, Mail, Mailbox
from rems_net.router.session import Session
from rems_net.router.settings import LARGEST, Link
from tests.agents.runs import until
from tests.reliability.floods import KEYS, LIMIT, PAYLOADS, Lab, Told
from tests.reliability.rig.rig import Rig, missing

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="the rig reads /proc, which is Linux's"
)
#: those that CI tries, on the loopback: a port that is read, one that nobody made
QUICK = ["rems/robot/other/state", "rems/{}/state"]
#: how often a run may be late for reasons of the machine's own
TRIES = 3
#: seconds in which a command comes; a router waited 3 s for who was frozen, and 5 s for
#: who says that he is there and reads nothing
SOON = 2.5
#: seconds by which a frozen watcher may keep up a fast run
KEPT_UP = 1.0


def check(lab: Lab, key: str, payload: str) -> None:
    """The same bytes, each time; and not much later, in one of some tries."""
    seen: list[tuple[Told, Told]] = []
    for _ in range(TRIES):
        quiet, flooded = lab.run("nothing"), lab.flooded(key, payload)
        assert quiet.ended == flooded.ended == 0
        assert flooded.flood.startswith("put ")
        assert flooded.recordings == quiet.recordings
        seen.append((quiet, flooded))
        if flooded.late - quiet.late < LIMIT:
            return
    pytest.fail("\n".join(" | ".join(told.cells(quiet)) for quiet, told in seen))


def test_a_short_flood_changes_nothing(tmp_path: Path) -> None:
    lab = Lab(tmp_path, duration=2.0)
    quiet = lab.run("nothing")
    for key in QUICK:
        told = lab.flooded(key, PAYLOADS["no msgpack"], rate=5000, seconds=1.0)
        assert quiet.ended == told.ended == 0, key
        assert told.flood.startswith("put 5000 "), key
        assert told.recordings == quiet.recordings, key


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("payload", PAYLOADS.values(), ids=list(PAYLOADS))
@pytest.mark.parametrize("key", KEYS)
def test_a_flood_changes_nothing(key: str, payload: str, tmp_path: Path) -> None:
    check(Lab(tmp_path), key, payload)


@pytest.mark.slow
@pytest.mark.root
@pytest.mark.skipif(bool(missing()), reason=missing())
@pytest.mark.timeout(600)
@pytest.mark.parametrize("key", KEYS)
def test_a_flood_from_another_machine(key: str, tmp_path: Path) -> None:
    check(Lab(tmp_path, apart=True), key, PAYLOADS["no msgpack"])


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_frozen_watcher_delays_nobody(tmp_path: Path) -> None:
    paced = Lab(tmp_path / "paced")
    quiet, told = paced.run("nothing"), paced.watched(frozen=True)
    assert told.recordings == quiet.recordings
    fast = Lab(tmp_path / "fast", pace="fast", duration=200.0)
    watched, frozen = fast.watched(frozen=False), fast.watched(frozen=True)
    assert frozen.recordings == watched.recordings
    assert frozen.spent - watched.spent < KEPT_UP
    assert told.late - quiet.late < LIMIT


def test_who_reads_nothing_holds_up_only_who_sends_to_him(tmp_path: Path) -> None:
    """A laptop is frozen, and its own team sends it what must not be lost."""
    assert any(_commands_come(tmp_path / str(i)) for i in range(TRIES))


def _commands_come(folder: Path) -> bool:
    with Rig(folder) as rig:
        _, endpoint = rig.router()
        watcher = rig.module("tests.reliability.programs.watcher", endpoint)
        words = endpoint, "team/x", "--rate", 1000, "--payload", "c1" * 40_000
        rig.module("tests.reliability.programs.flood", *words).wait_for("flooding")
        heard = Mailbox()
        with Session(Link(endpoint)) as robot, Session(Link(endpoint)) as anna:
            robot.watch("rems/robot/sim/command", heard)
            command = anna.publisher("rems/robot/sim/command")
            until(lambda: command.watched)
            watcher.wait_for("watching")
            watcher.freeze()
            came = 0
            for _ in range(20):
                command.put(b"1")
                if heard.get(SOON) is None:
                    break
                came += 1
                Event().wait(0.05)  # the flood fills the way to him meanwhile
            return came == 20


def test_nobody_fills_the_memory_of_the_router(tmp_path: Path) -> None:
    """A message is dropped before it is whole; who sent it goes on."""
    with Rig(tmp_path) as rig:
        _, endpoint = rig.router()
        heard = Mailbox()
        with Session(Link(endpoint)) as teacher, Session(Link(endpoint)) as anna:
            teacher.watch("team1/x", heard)
            publisher = anna.publisher("team1/x")
            until(lambda: publisher.watched)
            for size in (MAX_PAYLOAD, LARGEST, 1):
                publisher.put(bytes(size))
            mail = [heard.get(20.0) for _ in range(2)]
    assert [one.size for one in mail if isinstance(one, Mail)] == [MAX_PAYLOAD, 1]
