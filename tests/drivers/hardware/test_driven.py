"""A driver and its device: what goes wrong on a line, and what the device hears."""

import re
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import combine
from rems_net.agents.runtime import runtime
from rems_net.drivers.hardware.driven import Driven
from rems_net.errors import AgentError, RemsError, SchemaError, uncoded
from rems_net.testing.checks.standing import Guard
from tests.agents.runs import until
from tests.drivers import alone
from tests.drivers.hardware.cart import Device, drive, opened
from tests.drivers.hardware.parts import Cart, SerialCart

#: seconds that a busy machine may take besides
BUSY = 1.0


def keep(robot: Any, until_true: Callable[[], Any], seconds: float = 20.0) -> None:
    """Drive it until something is so."""
    alone.keep(robot, {"speed": 0.5, "turn": 0.0}, until_true, seconds)


def test_obeys_and_stands_at_the_end(tmp_path: Path) -> None:
    with Device(tmp_path) as device:
        with opened(device) as robot:
            assert robot.reading_age < 1
            assert robot.state == Cart.state.schema()
            assert sys.getswitchinterval() < 0.001, "it waits for no other thread"
            keep(robot, lambda: robot.state.x > 0.1)
            assert device.speed == 0.5
            assert robot.figures()["safe"] == ""
        heard = device.heard()
    assert heard[0]["heard"] == [0.0, 0.0]
    assert [0.5, 0.0] in [note["heard"] for note in heard]
    assert heard[-1]["heard"] == [0.0, 0.0]
    # One request after the other, none twice: the device saw to the rest.
    assert [note["number"] for note in heard] == list(range(1, len(heard) + 1))


def test_stops_when_nobody_calls_drive(tmp_path: Path) -> None:
    """A host whose stepping thread is stuck in somebody's code."""
    with Device(tmp_path) as device, opened(device) as robot:
        keep(robot, lambda: device.speed == 0.5)
        before = robot.figures()["expired"]
        robot.drive(robot.command, 0.02)
        last = time.monotonic()
        until(lambda: device.speed == 0.0)
        stood = next(n["t"] for n in device.heard(last) if n["heard"][0] == 0.0)
        assert stood - last < 0.5 + BUSY
        assert robot.figures()["expired"] > before
        keep(robot, lambda: device.speed == 0.5)


def test_the_lease_says_how_old_a_command_is(tmp_path: Path) -> None:
    """Told anew at every tick what its source said long ago."""
    with Device(tmp_path) as device, opened(device) as robot:
        run, guard = runtime(robot), Guard()
        run.guard = guard
        run.source_ticks["command"] = 7
        keep(robot, lambda: device.speed == 0.5)
        guard.oldness = 0.6
        keep(robot, lambda: device.speed == 0.0)
        guard.oldness = 0.1
        keep(robot, lambda: device.speed == 0.5)
        guard.stopped = True
        said = time.monotonic()
        keep(robot, lambda: device.speed == 0.0)
        stood = next(n["t"] for n in device.heard(said) if n["heard"][0] == 0.0)
        assert stood - said < 0.1 + BUSY
        guard.stopped, guard.oldness = False, 0.0
        keep(robot, lambda: device.speed == 0.5)


def test_replies_that_do_not_fit(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A fifth of them: the loop goes on, nothing wrong is told or believed."""
    with Device(tmp_path) as device:
        with opened(device) as robot:
            device.tell("corrupt 0.2")
            before = -1.0
            while robot.figures()["rejected"] < 10:
                drive(robot, 0.02)
                assert before <= robot.state.x < 100
                before = robot.state.x
            keep(robot, lambda: robot.reading_age < 0.1)
        # Told what it was told, and never anything else.
        told = {tuple(note["heard"]) for note in device.heard()}
        assert told == {(0.0, 0.0), (0.5, 0.0)}
    said = capfd.readouterr()
    assert said.err.count("robot/b passes over a reply, and counts such: ") == 1
    assert re.search(r", \d+ rejected", said.out)


def test_replies_that_are_lost_or_late(tmp_path: Path) -> None:
    with Device(tmp_path) as device, opened(device) as robot:
        device.tell("drop 0.2")
        keep(robot, lambda: robot.figures()["rejected"] >= 5)
        device.tell("fine")
        device.tell("late 0.12")
        before = robot.figures()["rejected"]
        keep(robot, lambda: robot.figures()["rejected"] >= before + 3)
        device.tell("fine")
        # The late ones are thrown away: it does not stay a reply behind.
        before = robot.figures()["rejected"]
        keep(robot, lambda: robot.reading_age < 0.05 and device.speed == 0.5)
        assert robot.figures()["rejected"] < before + 20


def device_threads() -> list[threading.Thread]:
    return [t for t in threading.enumerate() if t.name.startswith("device of")]


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("exception", r"wheels fell off"),
        ("list", r"exchange\(\) returned \[1\.0\]; expected None, or fields by port.*"),
        ("port", r".*the ports are state\. Did you mean 'state'\?"),
        ("field", r".*'xx'.*"),
        ("exit", "3"),
    ],
)
def test_a_mistake_of_the_driver_ends_it_standing(
    tmp_path: Path, how: str, sentence: str
) -> None:
    with Device(tmp_path) as device:
        robot = combine(Cart, SerialCart)(
            "b", options={"port": str(device.link), "fail_at": 20, "how": how}
        )
        robot.prepare()
        robot.open()
        with pytest.raises((Exception, SystemExit)) as caught:
            keep(robot, lambda: False, 5)
        assert not isinstance(caught.value, AssertionError)
        assert re.fullmatch(sentence, uncoded(caught.value), re.DOTALL), caught.value
        until(lambda: not device_threads())
        assert device.speed == 0.0
        robot.close()


def test_the_device_at_the_port_says_nothing(tmp_path: Path) -> None:
    with Device(tmp_path) as device:
        device.tell("hang 3")
        with pytest.raises(AgentError, match="no reply that fits for"):
            opened(device).__enter__()


def test_what_else_is_done_on_the_line(tmp_path: Path) -> None:
    """Verbs that talk to the device do so between two exchanges, in its thread."""
    with Device(tmp_path) as device:
        with opened(device) as robot:
            thread = robot.perform(threading.current_thread)
            assert thread.name == "device of robot/b"
            with pytest.raises(ZeroDivisionError):
                robot.perform(lambda: 1 / 0)
            name = robot.perform(lambda: robot.perform(threading.current_thread).name)
            assert name == thread.name, "it would wait for itself"
            with pytest.raises(TimeoutError):
                robot.perform(lambda: threading.Event().wait(0.3), seconds=0.05)
            done: list[int] = []
            with pytest.raises(TimeoutError):
                robot.perform(lambda: done.append(1), seconds=0.0)
            robot.perform(lambda: None, seconds=5)
            assert not done, "given up, and yet done"
            keep(robot, lambda: device.speed == 0.5)
        assert robot.perform(threading.current_thread) is threading.main_thread()


def test_reset(tmp_path: Path) -> None:
    with Device(tmp_path) as device, opened(device) as robot:
        robot.initial = {"x": 7.0}
        keep(robot, lambda: 0 < robot.state.x < 7)
        robot.reset()
        assert robot.state.x == 7.0
        keep(robot, lambda: robot.state.x < 7)


def test_figures(tmp_path: Path) -> None:
    robot: Any = combine(Cart, SerialCart)("b", options={"port": "x"})
    robot.prepare()
    with pytest.raises(AgentError, match="not open"):
        robot.figures()
    robot.close()
    with Device(tmp_path) as device, opened(device) as robot:
        while True:  # a machine that is so busy as to break the line: once more
            begun, before = time.monotonic(), robot.figures()
            drive(robot, 1.0)
            lasted, after = time.monotonic() - begun, robot.figures()
            if before["reconnects"] == after["reconnects"]:
                break
        # Every deadline is either kept or counted: none is lost.
        turns = sum(after[what] - before[what] for what in ("cycles", "missed"))
        assert turns == pytest.approx(lasted * 50, abs=10 + 25 * BUSY)
        assert after["worst"] >= 0


def test_ticks_that_are_too_far_apart_are_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with Device(tmp_path) as device, opened(device) as robot:
        robot.drive(robot.command, 1.0)
        robot.drive(robot.command, 1.0)
    assert (
        capfd.readouterr().err.count(
            "robot/b stops between two ticks: they come every 1 s, and a command lives "
            "0.5 s"
        )
        == 1
    )


def test_a_run_asks_for_a_lower_rate(tmp_path: Path) -> None:
    """And for no higher one, nor for one at which commands would be too old."""
    with Device(tmp_path) as device, opened(device, rate="20 Hz") as robot:
        first, begin = robot.figures()["cycles"], time.monotonic()
        keep(robot, lambda: robot.figures()["cycles"] >= first + 8)
        assert time.monotonic() - begin > 7 / 20
    for rate, sentence in (
        (51, "robot/b has rate = 51 Hz; expected 50 Hz at most, which is SerialCart's"),
        (3, "rate is 3.0; expected exchanges per second, at least 4, since a command"),
    ):
        robot = combine(Cart, SerialCart)("b", options={"port": "x", "rate": rate})
        with pytest.raises(SchemaError, match=sentence):
            robot.prepare()


def test_mistakes_before_anything_moves() -> None:
    class Slow(SerialCart):
        rate = 1.0

    class Empty(Driven):
        pass

    with pytest.raises(
        SchemaError, match=r"SlowCart\.rate is 1\.0; .* at least 4, since"
    ):
        combine(Cart, Slow)("b", options={"port": "x"}).prepare()
    with pytest.raises(SchemaError, match=r"rems board ports"):
        combine(Cart, SerialCart)("b").prepare()
    robot = combine(Cart, Empty)("b")
    robot.prepare()
    with pytest.raises(NotImplementedError, match=r"define exchange\(self, command\)"):
        robot.open()
    assert issubclass(AgentError, RemsError)
