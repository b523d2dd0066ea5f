"""A Woodbot on an open fabric: to everybody there it is a robot like any other."""

from typing import Any

import pytest

from rems_net.agents.clock.clock import Clock
from rems_net.client import Fabric
from rems_net.errors import AgentError
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.message import pack, pack_stamp
from rems_net.router.session import Session
from tests.agents.runs import until
from tests.firmware.golden import schemas
from tests.firmware.protocol.world import LONG, World, drive, figures, row

COMMAND = schemas()["command"]
ENCODING = f"{COMMAND.name}@{COMMAND.digest}"


def put(
    session: Session, payload: bytes, stamp: bytes | None = None, **more: str
) -> None:
    """Command it as any program does."""
    key = session.key("robot", "w7", "command")
    encoding = more.get("encoding", ENCODING)
    session.putting(key, encoding)(payload, attachment=stamp)


def command(left: float, right: float = 0.0) -> bytes:
    return COMMAND({"wheel": {"left": left, "right": right}}).encode()


def joined(here: World) -> tuple[Clock, Fabric]:
    clock = here.clock()
    here.robot()
    fabric = here.fabric()
    until(lambda: row(fabric), LONG)
    return clock, fabric


def dropped(fabric: Fabric) -> dict[str, int]:
    """How often something was refused, by the beginning of the sentence."""
    found = fabric.why("robot/w7/command")
    reasons = [s.partition(" has dropped ")[2] for s in found if " dropped " in s]
    return {said: int(n) for n, _, said in (r.partition(" x: ") for r in reasons)}


def test_it_joins_ticks_and_is_asked(here: World) -> None:
    _, fabric = joined(here)
    seen = row(fabric)
    assert seen is not None
    assert seen["kind"] == "robot"
    assert fabric.schemas("robot/w7") == schemas()
    told = fabric.get("robot/w7/*")
    assert set(told) == {f"rems/robot/w7/{port}" for port in schemas()}
    assert told["rems/robot/w7/state"]["tick"] > 0
    assert set(told["rems/robot/w7/state"]["values"]) == {"x", "y", "heading"}
    one = fabric.get("robot/w*/sensors/lidar/front")
    assert list(one) == ["rems/robot/w7/sensors/lidar/front"]
    values = one["rems/robot/w7/sensors/lidar/front"]["values"]
    assert values["lidar/front"]["unit"] == "m"
    state = next(iter(fabric.robot("w7").watch("state", 1)))
    assert state.schema == schemas()["state"]
    assert figures(fabric)["connected"] is True
    with pytest.raises(AgentError, match="there is blink, figures, reset"):
        fabric.call("robot/w7", "jump", (), {})
    with pytest.raises(AgentError, match="it takes no arguments"):
        fabric.call("robot/w7", "blink", (3,), {})


def test_it_obeys_while_it_is_told(here: World) -> None:
    _, fabric = joined(here)
    drive(fabric)
    robot = fabric.robot("w7")
    assert robot.state.x > 0 or until(lambda: robot.state.x > 0, LONG)
    until(lambda: robot.command["wheel/left"] == 0.0, LONG)
    found = figures(fabric)
    assert found["safe"] == "what it was told is too old"
    assert found["expired"] >= 1
    robot.reset()
    until(lambda: robot.state.x == 0.0, LONG)


def test_what_it_obeys_carries_the_tick_of_who_said_it(here: World) -> None:
    """So anybody measures how long a command takes to the wheels."""
    clock, fabric = joined(here)
    session, box = fabric.session, Mailbox()
    session.watch(session.key("robot", "w7", "command"), box)
    said: set[int] = set()
    echoes: set[int] = set()

    def echoed() -> bool:
        tick = clock.tick
        said.add(tick.n)
        put(session, command(1.0), pack_stamp(tick.n, tick.t))
        while (mail := box.get(0.02)) is not None:
            assert isinstance(mail, Mail)
            stamp = mail.stamp()
            if stamp.badge and stamp.said != stamp.n:
                echoes.add(stamp.said)
        return len(echoes) > 3

    until(echoed, LONG)
    assert echoes <= said


def test_stop_is_a_latch(here: World) -> None:
    clock, fabric = joined(here)
    drive(fabric)
    stands = [("robot/w7", True)]
    until(lambda: [(r.robot, r.stands) for r in fabric.stop()] == stands, LONG)
    assert figures(fabric)["safe"] == "stopped"
    put(fabric.session, command(2.0))
    assert until(lambda: clock.broadcaster.stops % 2 == 1, LONG)
    # Its own answer holds beyond the clock.
    asked = fabric.session.ask(fabric.session.key("stop", "@holds"))
    assert any(mail.payload == pack(True) for mail in asked)
    assert fabric.release() == ["robot/w7"]
    drive(fabric)


def test_who_was_stopped_before_it_joined_stops_the_clock(here: World) -> None:
    here.robot()
    session = here.session()
    until(lambda: session.who(session.key("robot", "w7", "@alive")), LONG)
    until(lambda: _holds(session), LONG)
    clock = here.clock()
    until(lambda: clock.broadcaster.stops % 2 == 1, LONG)


def _holds(session: Session) -> bool:
    session.put(session.key("stop"), pack(True))
    asked = session.ask(session.key("stop", "@holds"))
    return bool(asked) and all(mail.payload == pack(True) for mail in asked)


def test_what_it_refuses_is_counted(here: World) -> None:
    clock, fabric = joined(here)
    session = fabric.session
    tick = clock.tick
    foreign = (clock.run_id ^ 1) << 24 | 3
    other = "cart.command@0123456789abcdef"
    put(session, b"\xc0" * 60)
    put(session, COMMAND({"wheel": {"left": 1.0, "right": 1.0}}).encode()[:-1])
    put(session, command(1.0).replace(b"\xcb?\xf0", b"\xcb\x7f\xf8"))  # NaN
    put(session, command(1.0), encoding=other)
    put(session, command(1.0), b"\x07")
    put(session, command(1.0), pack_stamp(tick.n, tick.t, foreign))
    put(session, command(1.0), pack_stamp(tick.n + 10_000, tick.t))
    until(lambda: clock.tick.n > tick.n + 60, LONG)
    put(session, command(1.0), pack_stamp(tick.n, tick.t))

    def all_of_them() -> dict[str, int] | None:
        found = dropped(fabric)
        return found if sum(found.values()) == 8 else None

    found: dict[str, int] = until(all_of_them, LONG)
    begins = sorted(said.split(",")[0] for said in found)
    assert begins == [
        "it is of the schema cart.command@0123456789abcdef",
        "it is stamped by no member of this run.",
        "it is stamped with a tick that was not made yet.",
        "its payload is refused: out_of_range",
        "its payload is refused: too_long",
        "its payload is refused: truncated",
        "its stamp is no [n",
        "what it answers to is older than a command may be.",
    ]
    digest = COMMAND.digest
    (sentence,) = (said for said in found if "cart.command" in said)
    assert f"robot/w7/command takes woodbot.command@{digest}" in sentence
    assert "wheel/left in rad/s" in sentence
    assert "rems get robot/w7" in sentence
    assert figures(fabric)["rejected"] == 8
    assert figures(fabric)["safe"] != ""


def test_a_command_that_is_said_again_is_refused(here: World) -> None:
    clock, fabric = joined(here)
    session, tick = fabric.session, clock.tick
    until(lambda: clock.tick.n > tick.n + 3, LONG)
    put(session, command(1.0), pack_stamp(clock.tick.n, clock.tick.t))
    until(lambda: fabric.robot("w7").command["wheel/left"] in (0.0, 1.0), LONG)
    put(session, command(2.0), pack_stamp(tick.n, tick.t))
    said = "its tick is not newer than that of what was obeyed."
    old = "what it answers to is older than a command may be."
    until(lambda: dropped(fabric).keys() & {said, old}, LONG)


def test_another_run_and_it_joins_again(here: World) -> None:
    first, fabric = joined(here)
    here.end_clock("rems")
    second = here.clock(dt=0.04)
    assert second.run_id != first.run_id
    until(lambda: row(fabric), LONG)
    until(lambda: fabric.get("robot/w7/state")["rems/robot/w7/state"]["tick"] > 0, LONG)
    drive(fabric)


def test_who_is_let_go_comes_again(here: World) -> None:
    clock, fabric = joined(here)
    seen: Any = row(fabric)
    member = clock.members.all["robot/w7"]
    clock.members.drop(member, "was out of sight")
    until(lambda: clock.members.all["robot/w7"].badge != member.badge, LONG)
    until(lambda: row(fabric), LONG)
    assert seen["agent"] == "robot/w7"


def test_a_name_that_is_taken_is_refused_and_told(here: World) -> None:
    clock, fabric = joined(here)
    here.robot()  # with another identity
    until(
        lambda: any("there is a robot/w7 already" in event.text for event in here.said),
        LONG,
    )
    assert len(clock.members.present()) == 1
    # It does not answer for the other, either.
    asked = fabric.session.ask(fabric.session.key("robot", "w7", "state"))
    assert len(asked) == 1
    drive(fabric)


def test_deaf_it_opens_another_session(
    here: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ticks are made and it hears none, though its questions are answered."""
    here.clock()
    robot = here.robot()
    fabric = here.fabric()
    until(lambda: row(fabric), LONG)
    opened, link = robot.link.opened, robot.link
    heard = type(link)._heard

    def deaf(mail: Mail) -> None:
        if link.opened > opened:
            heard(link, mail)

    monkeypatch.setattr(link, "_heard", deaf)
    until(lambda: link.opened > opened, LONG)
    drive(fabric)
