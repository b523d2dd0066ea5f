"""A run that was held, and members that were away: told, and nobody driven through."""

import re
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.clock.pacing import Pacing
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.plan import HERE
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event, listening
from tests.agents.bringing import bring
from tests.agents.runs import PARTS, Router, Told, alive, digest, in_one_host, until
from tests.signals import freeze, thaw


def lab(seconds: float = 2.0, **more: Any) -> Experiment:
    usual: dict[str, Any] = {"dt": 0.02, "pace": 1, "folder": PARTS, "record": False}
    made = Experiment("late", duration=seconds, **usual | more)
    made.input("steady", "parts.py:Steady", host=HERE)
    made.robot("cart", "parts.py:Cart", "parts.py:Euler", command="input/steady")
    made.output("csv", "csv", host=HERE)
    return made


def stays(what: Callable[[], object], seconds: float = 0.3) -> bool:
    """Whether it is the same that much later."""
    first = what()
    threading.Event().wait(seconds)
    return what() == first


@pytest.mark.parametrize(
    ("dt", "pace", "late", "ahead"),
    [
        (0.001, 1.0, 0.0005, 1),  # in time: one by one
        (0.001, 1.0, 0.002, AHEAD),
        (0.02, 1.0, 0.03, 5),  # 0.1 s of ticks
        (0.1, 1.0, 0.15, 1),
        (0.1, 100.0, 0.01, AHEAD),
        (0.1, 0.0, 0.0, AHEAD),
    ],
)
def test_ticks_that_are_due_are_sent_together(
    dt: float, pace: float, late: float, ahead: int
) -> None:
    """At 1 kHz a busy machine took three times as long: each tick waited for one."""
    pacing = Pacing(dt, pace)
    pacing.set(pace)
    pacing._anchor -= dt / pace + late if pace else 0.0  # tick 1 is late
    assert pacing.ahead() == ahead
    pacing.pause()
    assert pacing.ahead() == (1 if pace else AHEAD)


#: a tick, and two moments between which it was the newest
Noted = tuple[float, int, float]


def frozen_for(
    name: str, seconds: float, noted: list[Noted]
) -> Callable[[Clock], None]:
    """Freeze a host, and note when ticks came afterwards, to the last."""

    def do(clock: Clock) -> None:
        until(lambda: clock.tick.n > 10)
        pid = clock.members.all[name].pid
        freeze(pid)
        threading.Event().wait(seconds)
        thaw(pid)
        pause = threading.Event()
        while not noted or noted[-1][1] < 100:
            noted.append((time.monotonic(), clock.tick.n, time.monotonic()))
            pause.wait(0.01)

    return do


def fastest(noted: list[Noted]) -> float:
    """Times real time, for certain, over a tenth of a second and up to half of one."""
    best = 0.0
    for begun, n, _ in noted:
        for _, m, ended in noted:
            if 0.1 <= ended - begun <= 0.5:
                best = max(best, (m - n) * 0.02 / (ended - begun))
    return best


def test_a_held_run_goes_on_in_real_time(tmp_path: Path) -> None:
    noted: list[Noted] = []
    told = Told(frozen_for("robot/cart", 1.6, noted))
    assert lab().run(tmp_path, show=told).ticks == 100
    said, *_ = told.of("late")
    why = r"; ticks waited \d+\.\d s for .*robot/cart on .*"
    late = re.fullmatch(rf"(\d+\.\d) s late: real time goes on from here{why}", said)
    assert late, said
    assert float(late[1]) > 1.0  # a busy machine adds to it
    # Seen before: 32 times real time.
    assert fastest(noted) < 3.0


def test_small_losses_are_told_together() -> None:
    told: list[Event] = []
    pacing = Pacing(0.01, 1.0)
    pacing.set(1.0)
    with listening(told.append):
        for _ in range(9):
            threading.Event().wait(0.3)
            pacing.make(1)
    (said,) = told  # and not again soon, however slow the machine is
    assert said.kind == "late"
    assert re.fullmatch(r"1\.\d s late: real time goes on from here", said.text)


def test_how_long_to_wait_is_checked() -> None:
    with pytest.raises(
        ExperimentError, match="wait: back is -1; expected 1e-9 s to 1e9 s"
    ):
        lab(wait={"back": -1})
    with pytest.raises(ExperimentError, match=r"wait has 'bakc'.*Did you mean 'back'"):
        lab(wait={"bakc": 1})
    with pytest.raises(ExperimentError, match=r'Write wait=\{"back": "30 s"\}'):
        lab(patience=3)


# -- out of sight ----------------------------------------------------------------------


def away(seconds: float = 4.0, **more: Any) -> Experiment:
    made = in_one_host(lab(seconds, **more), HERE)
    cart = ("parts.py:Cart", "parts.py:Euler")
    made.robot("b", *cart, command="input/steady", machine="b")
    return made


def with_student(
    tmp_path: Path, made: Experiment, beside: Callable[[Clock], None]
) -> tuple[int, str, Told]:
    """Run it with robot/b of another machine; its exit status and what it printed."""
    students: list[subprocess.Popen[str]] = []

    def start(clock: Clock) -> None:
        students.append(bring(PARTS, router=told.endpoint))
        beside(clock)

    told = Told(start)
    try:
        with suppress(AgentError):
            made.run(tmp_path / "teacher", show=told)
    finally:
        student = students[0]
        try:
            _, said = student.communicate(timeout=40)
        except subprocess.TimeoutExpired:
            student.kill()
            _, said = student.communicate()
    return student.returncode, said, told


def stop_and_go(seconds: float) -> Callable[[Clock], None]:
    def do(clock: Clock) -> None:
        until(lambda: clock.tick.n > 10)
        pid = clock.members.all["robot/b"].pid
        assert alive(pid)
        freeze(pid)
        threading.Event().wait(seconds)
        thaw(pid)

    return do


def test_a_machine_that_is_back_in_time_costs_time_only(tmp_path: Path) -> None:
    """A laptop that sleeps for longer than its lease of 2 s, and comes back."""
    made = away(2.0, wait={"back": 20})
    status, said, told = with_student(tmp_path, made, stop_and_go(4.0))
    assert status == 0, said
    assert not [line for line in told.lines if "out of sight" in line]


def test_who_was_given_up_says_so_on_its_own_side(tmp_path: Path) -> None:
    made = away(12.0, wait={"back": 1.0}, on_failure="drop")
    status, said, told = with_student(tmp_path, made, stop_and_go(6.0))
    (dropped,) = told.of("dropped")
    assert re.fullmatch(
        r"robot/b: is out of sight on \S+ for 1 s; dropped at tick \d+", dropped
    )
    assert status == 1
    assert re.search(
        r"\[robot/b\] warning: the clock gave this host up: is out of sight on \S+ "
        r"for 1 s: this host ends\n",
        said,
    )


def test_who_slept_through_the_end_of_a_run_leaves_the_next_one_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seen before: it removed the new robot, or drove along as a second writer."""
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        sleeper = bring(PARTS)
        frozen: list[int] = []

        def sleep(clock: Clock) -> None:
            until(lambda: clock.tick.n > 10)
            frozen.append(clock.members.all["robot/b"].pid)
            freeze(frozen[0])
            member = clock.members.all["robot/b"]
            # What it had said before may still be on its way.
            until(lambda: stays(lambda: (clock.tick.n, member.n)))
            assert member.owes(clock.tick.n)
            clock.pacing.end()

        try:
            with pytest.raises(AgentError):
                # It holds a tick for longer than it is given.
                away(4.0, wait={"back": 0.5}).run(tmp_path / "first", show=Told(sleep))

            def wake(clock: Clock) -> None:
                until(lambda: clock.tick.n > 10)
                thaw(frozen[0])

            told = Told(wake)
            second = away(4.0).run(tmp_path / "second", alone=True, show=told)
            assert second.ticks == 200
            _, said = sleeper.communicate(timeout=40)
        finally:
            sleeper.kill()
            sleeper.wait()
    assert sleeper.returncode == 1
    assert ": this host ends\n" in said
    monkeypatch.delenv("REMS_ROUTER")
    away(4.0).run(tmp_path / "alone", alone=True, pace="fast")
    assert digest(tmp_path / "second") == digest(tmp_path / "alone")


def test_a_run_that_waits_for_another_machine_can_be_ended(tmp_path: Path) -> None:
    made = in_one_host(lab(), HERE)
    made.robot("far", "parts.py:Cart", "parts.py:Euler", machine="b")

    def end(clock: Clock) -> None:
        clock.pacing.end()

    with pytest.raises(AgentError) as caught:
        made.run(tmp_path, show=Told(end))
    assert str(caught.value) == (
        "robot/far: had not come yet when the run was ended (R0521)"
    )


def test_a_run_that_waits_for_a_tick_can_be_ended(tmp_path: Path) -> None:
    def end(clock: Clock) -> None:
        until(lambda: clock.tick.n > 10)
        cart = clock.members.all["robot/cart"]
        freeze(cart.pid)
        until(lambda: cart.owes(clock.tick.n) and stays(lambda: clock.tick.n))
        clock.pacing.end()

    with pytest.raises(AgentError) as caught:
        lab(60.0).run(tmp_path, show=Told(end))
    # Its host waits for the other one, which waits for it: either may be named.
    why = (
        r"(robot/cart|input/steady): "
        r"had not done tick \d+ when the run was ended \(R0522\)"
    )
    assert re.fullmatch(why, str(caught.value))
