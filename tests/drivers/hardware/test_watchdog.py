"""What a driven robot obeys: its laws, without a device."""

import time
from math import inf, nan
from threading import Event

import pytest
from hypothesis import given, strategies as st

from rems_net.agents.runtime import Runtime
from rems_net.agents.wall import wall
from rems_net.drivers.hardware.periodic import Periodic
from rems_net.drivers.hardware.watchdog import Watchdog
from rems_net.testing.checks.standing import Guard
from tests.drivers.hardware.parts import COMMAND

PERIOD = 0.02
SAFE, AHEAD = COMMAND(), COMMAND(speed=0.5)


def standing(guard: Guard | None = None, *, stopped: bool = False) -> Runtime:
    """The run state of a robot."""
    run = Runtime("robot", ("command",), 1, False)
    run.guard, run.stopped = guard, stopped
    return run


def trusting(run: Runtime, max_age: float = 0.5) -> Watchdog:
    """One whose device answered before anything was told."""
    watchdog = Watchdog(run, max_age, COMMAND, PERIOD)
    watchdog.trust()
    return watchdog


ages = st.floats(0, 2) | st.sampled_from([0.47, 0.49, 0.5, 0.51, inf, nan])


@given(age=ages, stop=st.booleans(), own=st.booleans(), said=st.none() | st.just(7))
def test_a_command_is_obeyed_only_if_all_is_well(
    age: float, stop: bool, own: bool, said: int | None
) -> None:
    """Far from the moment of the fault, which is long past."""
    robot = standing(Guard(stop, age), stopped=own)
    watchdog = trusting(robot)
    watchdog._since -= 100
    watchdog.tell(AHEAD, said)
    fine = age <= 0.5 - PERIOD - 0.001 and not stop and not own and said is not None
    bad = not age <= 0.5 - PERIOD or stop or own or said is None
    chosen = watchdog.choose()
    assert chosen == (AHEAD if fine else SAFE) or not (fine or bad)
    assert (watchdog.why == "") == (chosen == AHEAD)


def test_without_a_lease_the_call_of_drive_counts() -> None:
    watchdog = trusting(standing(), 1.0)
    watchdog.tell(AHEAD, None)
    assert watchdog.choose() == AHEAD
    Event().wait(1.0)  # it grows old
    assert watchdog.choose() == SAFE
    assert watchdog.expired == 1
    assert watchdog.choose() == SAFE
    assert watchdog.expired == 1
    watchdog.tell(SAFE, None)
    watchdog.choose()
    Event().wait(1.0)  # it grows old
    assert watchdog.choose() == SAFE
    assert watchdog.expired == 1, "who was told to stand has not been stopped"


def test_no_tick_makes_it_old_however_fresh_the_lease_says_it_is() -> None:
    watchdog = trusting(standing(Guard(oldness=0.0)), 1.0)
    watchdog.tell(AHEAD, 1)
    assert watchdog.choose() == AHEAD
    Event().wait(1.0)  # it grows old
    assert watchdog.choose() == SAFE


def test_what_was_said_before_stop_was_released_is_past() -> None:
    robot = standing(guard := Guard(oldness=0.01))
    watchdog = trusting(robot)
    Event().wait(0.02)
    watchdog.tell(AHEAD, 1)
    assert watchdog.choose() == AHEAD
    guard.stopped = True
    assert watchdog.choose() == SAFE
    guard.stopped = False
    assert watchdog.choose() == SAFE
    assert watchdog.why == "no new command since it stopped"
    watchdog.tell(AHEAD, 1)  # again, by its last hop; its source said it before
    guard.oldness = 0.3
    assert watchdog.choose() == SAFE
    guard.oldness = 0.0
    Event().wait(0.001)
    watchdog.tell(AHEAD, 2)
    assert watchdog.choose() == AHEAD


def test_what_was_said_before_a_loss_is_past() -> None:
    watchdog = trusting(standing())
    watchdog.tell(AHEAD, None)
    assert watchdog.choose() == AHEAD
    watchdog.distrust("not connected")
    assert (watchdog.choose(), watchdog.why) == (SAFE, "not connected")
    watchdog.tell(AHEAD, None)
    watchdog.trust()
    assert watchdog.choose() == SAFE
    watchdog.tell(AHEAD, None)
    assert watchdog.choose() == AHEAD


def test_who_changes_a_command_changes_his_own() -> None:
    watchdog = trusting(standing())
    told = AHEAD.copy()
    watchdog.tell(told, None)
    told.speed = 1.0
    chosen = watchdog.choose()
    assert chosen == AHEAD
    chosen.speed = -1.0
    assert watchdog.choose() == AHEAD
    watchdog.safe.speed = 1.0
    assert watchdog.safe == SAFE


def test_deadlines_do_not_drift_and_are_not_made_up_for() -> None:
    periodic = Periodic(0.01)
    begun, ending = periodic._due, Event()
    for _ in range(5):
        assert periodic.wait(ending)
    missed = periodic.missed
    Event().wait(0.055)  # five deadlines go by
    assert periodic.wait(ending)
    assert periodic.missed >= missed + 4
    assert periodic.worst >= 0.004
    turns = (periodic._due - begun) / 0.01
    assert turns == pytest.approx(round(turns), abs=1e-6)
    ending.set()
    assert not periodic.wait(ending)


def test_the_wall_clock_goes_on() -> None:
    outer, before, inner = time.perf_counter(), wall(), time.perf_counter()
    Event().wait(0.02)
    least, after, most = time.perf_counter(), wall(), time.perf_counter()
    assert least - inner - 0.001 < after - before < most - outer + 0.001
