"""STOP is put first and asked for later, with or without a clock."""

import time
from collections.abc import Callable, Iterator

import pytest

from rems_net.agents.about.standing import Standing
from rems_net.client import Fabric, Receipt, join
from rems_net.events import listening
from rems_net.router.mail import Mail, Mailbox
from tests.agents.runs import Router, calm, until
from tests.client.programs import Start, programs

Robots = Callable[..., Fabric]


@pytest.fixture
def start() -> Iterator[Start]:
    with programs() as started:
        yield started


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def robots(
    start: Start, told: list[str], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Robots]:
    """A router without an experiment, and who is there beside it."""
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        with listening(lambda event: told.append(event.text)), join() as fabric:

            def begin(*who: str) -> Fabric:
                start("standin.py", router.endpoint, *who)
                names = {word.partition("=")[0] for word in who} - {"clock"}
                tokens = fabric.session.key("robot", "*", "@alive")
                until(lambda: len(fabric.session.who(tokens)) == len(names))
                return fabric

            yield begin


def test_every_robot_says_that_it_stands(robots: Robots, told: list[str]) -> None:
    fabric = robots("a=stands", "b=stands")
    begun = calm()
    receipts = fabric.stop()
    assert calm() - begun < 0.25
    assert receipts == [
        Receipt("robot/a", Standing("confirmed"), 412, 8.24),
        Receipt("robot/b", Standing("confirmed"), 412, 8.24),
    ]
    assert str(receipts[0]) == "robot/a stands at tick 412 (8.24 s): confirmed"
    assert told == []


def test_it_is_put_before_anybody_is_asked(robots: Robots) -> None:
    fabric = robots("a=mute")
    box = Mailbox()
    fabric.session.watch("rems/stop", box)
    fabric.stop()
    first = box.get(20.0)
    assert isinstance(first, Mail)
    assert (first.key, first.payload) == ("rems/stop", b"\xc3")


def test_who_brakes_is_waited_for(robots: Robots, told: list[str]) -> None:
    fabric = robots("a=stands", "b=brakes")
    begun, least = calm(), time.monotonic() + 0.25
    assert all(receipt.stands for receipt in fabric.stop())
    assert time.monotonic() > least
    assert calm() - begun < 1.0
    assert told == []


def test_who_does_not_answer_is_named_and_who_moves_is_told(
    robots: Robots, told: list[str]
) -> None:
    fabric = robots("a=stands", "b=mute", "c=moves")
    begun, least = calm(), time.monotonic() + 1.0
    a, b, c = fabric.stop()
    assert time.monotonic() >= least
    assert calm() - begun < 1.5
    assert (a.stands, b.stands, c.stands) == (True, False, False)
    assert str(b) == "robot/b has not answered: it may drive on until it is back"
    assert (
        str(c) == "robot/c may move at tick 412 (8.24 s): STOP is sent, not confirmed"
    )
    assert told == ["robot/b has not answered within 0.25 s"]


@pytest.mark.parametrize("way", ["silent", "complete", "garbage", "maps", "refuse"])
def test_a_stranger_delays_no_stop(robots: Robots, start: Start, way: str) -> None:
    fabric = robots("a=stands", "b=stands")
    endpoint = fabric.session.link.endpoint
    start("stranger.py", endpoint, way, "**", "robot/*/@stopped", "stop/@release")
    until(lambda: fabric.session.ask(f"rems/stranger/{way}", first=True))
    begun = calm()
    assert [receipt.stands for receipt in fabric.stop()] == [True, True]
    assert calm() - begun < 0.5
