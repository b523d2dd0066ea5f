"""What goes wrong on a line, for every kind of it, and what drivers make of that."""

import re
import time
from pathlib import Path

import pytest

from rems_net.agents.about.standing import SENT
from rems_net.agents.runtime import runtime
from rems_net.errors import AgentError
from tests.agents.runs import until
from tests.drivers.alone import keep
from tests.drivers.hardware.kinds import KINDS, STAND, Kind, agrees, true, turned

#: of a driver that notices a loss soon: tests wait for it
SOON = {"max_age": 0.3, "silence": 0.4}
#: seconds that a busy machine may take besides
BUSY = 1.0
SERIAL = ("create2", "dynabot")
FAULTS = [
    *(
        (name, f"{fault} 0.05")
        for name in SERIAL
        for fault in ("corrupt", "drop", "lose")
    ),
    ("woodbot", "lose 0.2"),  # TCP damages nothing, and there are fewer packets
]
every = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)


@pytest.mark.parametrize(("name", "fault"), FAULTS)
def test_packets_that_are_damaged(tmp_path: Path, name: str, fault: str) -> None:
    """Its loop is kept, what was damaged is counted, and no command is wrong."""
    kind = KINDS[name]
    with kind.opened(tmp_path) as (robot, emulator):
        emulator.order(fault)
        if kind.guarded:  # its commands have check sums
            emulator.order(f"{fault} heard")
            keep(robot, kind.ahead, lambda: emulator.heard.done > 5)
        keep(robot, kind.ahead, lambda: emulator.said.done > 5)
        if (name, fault) != (
            "create2",
            "lose 0.05",
        ):  # frames come oftener than it looks
            keep(robot, kind.ahead, lambda: kind.counted(robot) > 2)
        figures = robot.figures()
        assert figures["rejected"] < figures["cycles"] / 3
        assert figures["reconnects"] < 2, "more than a very busy machine adds"
        emulator.order("fine")
        keep(robot, STAND, lambda: kind.obeys(emulator) == kind.stands)
        if kind.at_port:
            keep(robot, STAND, lambda: turned(robot, emulator), seconds=5.0)
            # Without a connection each servo stopped by itself, at another moment. Then
            # the robot's path was no arc, and the turns do not give its end.
            if not robot.figures()["reconnects"]:
                keep(robot, STAND, lambda: agrees(robot, emulator), seconds=5.0)
        assert kind.told(emulator) == {*kind.stands, *kind.goes}


@every
def test_an_echo_and_late_answers(tmp_path: Path, kind: Kind) -> None:
    with kind.opened(tmp_path) as (robot, emulator):
        if kind.at_port:
            emulator.order("echo")
        emulator.order("late 0.01")
        before = robot.state.x

        def driven() -> bool:
            return robot.state.x > before + 0.01 and kind.obeys(emulator) == kind.goes

        keep(robot, kind.ahead, driven)
        assert robot.figures()["reconnects"] < 2


def unplugged(kind: Kind, folder: Path, seconds: float) -> None:
    with kind.opened(folder, **SOON) as (robot, emulator):

        def still() -> bool:
            at = true(emulator).x
            time.sleep(0.05)
            return bool(true(emulator).x == at)

        keep(robot, kind.ahead, lambda: kind.obeys(emulator) == kind.goes)
        begun = time.monotonic()
        emulator.order(f"unplug {seconds}")
        keep(robot, kind.ahead, lambda: not robot.figures()["connected"])
        # Nobody can tell it: whether it stands is up to the device.
        if kind.guarded:
            until(still)
        assert kind.obeys(emulator) == kind.goes
        for kept in kind.kept(emulator):
            kept.clear()
        keep(robot, kind.ahead, lambda: time.monotonic() > begun + seconds - 0.2)
        # From now on nobody says anything; it is back, and stands.
        until(lambda: robot.figures()["reconnects"] > 0)
        until(lambda: kind.obeys(emulator) == kind.stands)
        until(still)
        assert not kind.at_port or kind.told(emulator) == {*kind.stands}
        keep(robot, kind.ahead, lambda: kind.obeys(emulator) == kind.goes)
        keep(robot, STAND, lambda: kind.obeys(emulator) == kind.stands)
        if kind.at_port:  # its encoders have counted all the way
            keep(robot, STAND, lambda: agrees(robot, emulator))
        assert kind.told(emulator) == {*kind.stands, *kind.goes}


@every
def test_unplugged_and_back(
    tmp_path: Path, kind: Kind, capfd: pytest.CaptureFixture[str]
) -> None:
    unplugged(kind, tmp_path, 1.0)
    said = capfd.readouterr()
    lost = r"warning: robot/b has lost its device \(.+\); it tries to reach it again\n"
    back = r"warning: robot/b is back after \d\.\d s: it obeys its commands now\n"
    # Once for each outage; a machine that is very busy may add one of its own.
    assert re.search(f"{lost}(.*\n)*{back}", said.err), said.err
    assert re.search(r"robot/b: \d+ exchanges at \d+ Hz, .*, \d reconnected", said.out)


@pytest.mark.slow
@every
def test_unplugged_for_5_s(tmp_path: Path, kind: Kind) -> None:
    unplugged(kind, tmp_path, 5.0)


@every
def test_closed_while_it_is_unplugged(
    tmp_path: Path, kind: Kind, capfd: pytest.CaptureFixture[str]
) -> None:
    with kind.opened(tmp_path, **SOON) as (robot, emulator):
        keep(robot, kind.ahead, lambda: kind.obeys(emulator) == kind.goes)
        emulator.order("unplug 60")
        keep(robot, kind.ahead, lambda: not robot.figures()["connected"])
        with pytest.raises(OSError, match="not connected"):
            robot.perform(lambda: None)
        begun = time.monotonic()
        said = ""
        try:
            robot.close()
        except AgentError as error:
            said = str(error)
        assert time.monotonic() - begun < 1 + BUSY
    if robot.stops_alone is None:
        assert "out of reach for" in said
        assert "s: it may drive on; switch it off. (R0311)" in said
    else:
        assert said == ""
        assert "s: it stands by its own watchdog" in capfd.readouterr().err


@pytest.mark.parametrize("name", SERIAL)
def test_without_power(tmp_path: Path, name: str) -> None:
    """It starts anew, stands, and counts from zero: its path does not jump."""
    kind = KINDS[name]
    with kind.opened(tmp_path, **SOON) as (robot, emulator):
        keep(robot, kind.ahead, lambda: robot.state.x > 0.03)
        emulator.order("brownout 0.5")
        keep(robot, kind.ahead, lambda: not robot.figures()["connected"])
        before = robot.state.x
        until(lambda: robot.figures()["reconnects"] > 0)
        assert kind.obeys(emulator) == kind.stands
        keep(robot, kind.ahead, lambda: robot.state.x > before + 0.01)
        assert robot.state.x < before + 0.1


@every
def test_what_a_receipt_may_say(tmp_path: Path, kind: Kind) -> None:
    """It says that the robot stands only while it does: obeying, cut off, and back."""
    with kind.opened(tmp_path, **SOON) as (robot, emulator):

        def becomes(what: str) -> bool:
            standing = robot.standing
            assert not (standing.is_sure and kind.moves(emulator))
            return bool(standing.kind == what)

        keep(robot, kind.ahead, lambda: kind.obeys(emulator) == kind.goes)
        assert robot.standing == SENT
        runtime(robot).stopped = True
        keep(robot, kind.ahead, lambda: becomes("confirmed"))
        runtime(robot).stopped = False
        keep(robot, kind.ahead, lambda: kind.obeys(emulator) == kind.goes)
        emulator.order("unplug 2")
        keep(robot, kind.ahead, lambda: robot.standing.kind == "lost")
        runtime(robot).stopped = True
        if kind.guarded:
            keep(robot, kind.ahead, lambda: becomes("lost") and robot.standing.is_sure)
        else:
            assert str(robot.standing).endswith(": it may drive on; switch it off")
        keep(robot, kind.ahead, lambda: becomes("confirmed"))
