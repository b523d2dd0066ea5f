"""A person's hand on a robot: one driver, fresh commands only, and then still."""

import re
import time
from pathlib import Path

import pytest

from rems_net.client import Fabric
from rems_net.client.driving import PERIOD, Driving
from rems_net.client.proxy import Proxy
from rems_net.errors import ExperimentError, FabricError
from rems_net.router.mail import Mail, Mailbox
from tests.agents.runs import calm, until
from tests.cli.complaint import complaint
from tests.cli.conftest import robot, row, stands, text
from tests.commands import Run, Start
from tests.dashboard.test_viewers import viewer

AHEAD = {"ahead": 50.0}


def hold(hand: Driving, proxy: Proxy, x: float) -> None:
    """Drive until the robot is so far."""

    def there() -> bool:
        hand.keep()
        hand.send(AHEAD)
        return bool(proxy.state.x > x)

    until(there)


def taken(hand: Driving) -> str:
    """Ask for the lease again; return the name of the person who took it."""
    hand.keep()
    return hand.taken


def test_a_robot_is_driven_and_stands_when_the_hand_lets_go(still: Fabric) -> None:
    box = Mailbox()
    still.session.watch(still.session.key("robot", "alice", "command"), box)
    proxy = still.robot("alice")
    with Driving(still, "robot/alice", by="anna") as hand:
        assert hand.drives
        until(lambda: hand.seen.n > 0)
        hold(hand, proxy, proxy.state.x + 0.01)
        hand.rest()
        begun = calm()
        until(lambda: stands(proxy))
        assert calm() - begun < 1.0
        while box.get(0.0) is not None:  # what was put before
            pass
        for _ in range(5):  # standing still is published once, not for ever
            hand.send({})
            hand.keep()
        came = [mail for _ in range(20) if isinstance(mail := box.get(0.05), Mail)]
        # The robot publishes what it obeys; the hand publishes nothing.
        assert all(mail.stamp().badge != hand._badge for mail in came)


def test_a_command_for_an_old_picture_is_not_obeyed(still: Fabric) -> None:
    """Stamped with the tick that the person saw: 0.6 s ago."""
    proxy = still.robot("alice")
    with Driving(still, "robot/alice") as hand:
        until(lambda: hand.seen.n > 0)
        old = hand.seen
        until(lambda: hand.seen.t > old.t + 0.65)
        before = proxy.state.get()
        for _ in range(10):
            hand.send(AHEAD, seen=(old.n, old.t))
            hand.keep()
            time.sleep(PERIOD)
        assert proxy.state.get() == before
        hold(hand, proxy, before["x"] + 0.005)


def test_what_was_sent_in_a_pause_ends_sooner(still: Fabric) -> None:
    """Its program may be gone when time goes on: 0.2 s of 0.5 s are left."""
    proxy = still.robot("alice")
    with Driving(still, "robot/alice") as hand:
        hold(hand, proxy, proxy.state.x + 0.005)
        still.clock("pause")
        end = time.monotonic() + 0.6
        while time.monotonic() < end:
            hand.keep()
            hand.send(AHEAD)
            time.sleep(PERIOD)
        t, before = hand.seen.t, proxy.state.get()
        still.clock("resume")
        ends = [t]

        def over() -> bool:
            state = hand.state()
            if state is not None and state["x"] != before["x"]:
                before["x"] = state["x"]
                ends.append(hand.seen.t)
            return hand.seen.t > t + 0.7

        until(over)
        assert 0.0 < ends[-1] - t < 0.3


def test_a_hand_that_is_gone_stops_the_robot(still: Fabric) -> None:
    """No command comes any more: the robot stands, and another person may drive."""
    proxy = still.robot("alice")
    gone = Driving(still, "robot/alice", by="anna")
    gone.open()
    until(lambda: gone.seen.n > 0)
    hold(gone, proxy, proxy.state.x + 0.01)
    begun = calm()
    until(lambda: stands(proxy))
    assert calm() - begun < 2.0

    def free() -> bool:
        with Driving(still, "robot/alice", by="ben") as other:
            return other.drives

    until(free)


def test_one_person_drives_and_hands_over_after_five_seconds(
    still: Fabric, rems: Run
) -> None:
    with (
        Driving(still, "robot/alice", by="anna") as anna,
        Driving(still, "robot/alice", by="ben") as ben,
    ):
        assert anna.drives
        assert not ben.drives
        assert ben.other is not None
        assert ben.other.drives
        assert ben.other.name.startswith("anna on ")
        assert still.drivers() == {"robot/alice": ben.other.name}
        done = rems("list")
        assert done.stdout.splitlines()[0].split()[-1] == "driver"
        assert ben.other.name in done.stdout
        begun = time.monotonic()

        def handed() -> bool:
            anna.keep()
            ben.keep()
            ben.send(AHEAD)
            time.sleep(PERIOD)
            if not ben.drives and anna.other is not None:
                assert anna.other.name.startswith("ben on ")
                assert not anna.other.drives
            return ben.drives

        until(handed)
        assert time.monotonic() - begun > 4.0
        until(lambda: taken(anna))
        assert anna.taken.startswith("ben on ")
        assert not anna.drives


def test_a_person_who_gives_up_gets_nothing(still: Fabric) -> None:
    """A request ends when it is not repeated."""
    with Driving(still, "robot/alice", by="anna") as anna:
        with Driving(still, "robot/alice", by="ben"):
            until(lambda: taken(anna) or anna.other)
        begun = time.monotonic()
        while time.monotonic() - begun < 6.0:
            anna.keep()
            time.sleep(0.1)
        assert anna.drives
        assert anna.other is None
        assert not anna.taken
    assert still.drivers() == {}


def test_a_teacher_takes_all(still: Fabric) -> None:
    with Driving(still, "robot/alice", by="anna") as anna:
        assert still.take("robot/alice").startswith("anna on ")
        until(lambda: taken(anna))
        anna.send(AHEAD)
        assert not anna.drives


def test_what_cannot_be_driven(still: Fabric) -> None:
    for key, sentence in {
        "robot/bob": "there is no robot/bob. Did you mean 'robot/alice'?",
        "output/log": "there is no output/log.",
    }.items():
        with pytest.raises(FabricError, match=sentence), Driving(still, key):
            pass


def test_inputs(
    start: Start, still: Fabric, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A stick that a person moves drives a robot; a file is no such input."""
    keys = tmp_path / "keys.csv"
    keys.write_text("time [s],inpt.wh.l,inpt.wh.r\n60,1,1\n", encoding="utf-8")
    file = start("agent", "start", "input", str(keys), "--name", "keys")
    stick = start("agent", "start", "input", "hand", "--name", "stick")
    until(lambda: row(still, "input/stick") and row(still, "input/keys"))
    wood = ("agent", "start", "robot", "woodbot", "kinematic", "--name", "wood")
    driven = start(*wood, "--to", "command=input/stick")
    until(lambda: row(still, "robot/wood"))
    proxy = still.robot("wood")
    with Driving(still, "input/stick") as hand:
        hold(hand, proxy, 0.01)
    until(lambda: stands(proxy))
    with (
        pytest.raises(FabricError, match=r"input/stick commands robot/wood there"),
        Driving(still, "robot/wood"),
    ):
        pass
    said = complaint(capsys, "drive", "robot/wood", "input/stick")
    assert "input/stick commands robot/wood there" in said
    with (
        pytest.raises(FabricError, match=r"input/keys cannot be driven: expected"),
        Driving(still, "input/keys"),
    ):
        pass
    for program in (driven, stick, file):
        text(program)


def test_an_arm_has_no_wheels(start: Start, still: Fabric) -> None:
    arm = start(
        *("agent", "start", "robot", "youbot_arm", "kinematic", "--name", "arm")
    )
    until(lambda: row(still, "robot/arm"))
    with (
        pytest.raises(ExperimentError, match="a stick cannot drive robot/arm"),
        Driving(still, "robot/arm"),
    ):
        pass
    text(arm)


def test_a_robot_that_leaves_while_a_viewer_drives_it(
    start: Start, still: Fabric
) -> None:
    bob = robot(start, "bob")
    until(lambda: row(still, "robot/bob"))
    page = start("dashboard", "--no-qr", "--viewers")
    assert page.stdout is not None
    lines = (re.search(r"ws://\S+", line) for line in page.stdout)
    with viewer(next(one for one in lines if one).group()) as one:
        one.name("/robot/bob/command")
        until(lambda: one.pushed() and "robot/bob" in still.drivers())
        text(bob)
        until(lambda: one.pushed() and one.said)
        assert one.said == ["robot/bob has left; nothing drives it."]
    text(page)
