"""Fabric time: ticks, phases, every k-th tick, free-running members, pace."""

import os
import re
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.host.guard import Guard
from rems_net.agents.host.inbox import Inbox
from rems_net.agents.host.leases import Leases
from rems_net.agents.host.membership import Orphaned
from rems_net.agents.host.outlet import Done
from rems_net.agents.protocol.badge import badge_of
from rems_net.agents.protocol.complaints import Complaints
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import Admission, pack_age, pack_beat
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.tick import Tick, time_of
from rems_net.errors import AgentError, ExperimentError
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import PARTS, WAS_KILLED, Told, free_port, until
from tests.signals import KILL


def lab(ticks: int = 12, dt: float = 0.1, host: str = HERE, **more: Any) -> Experiment:
    made = Experiment("time", dt=dt, duration=ticks * dt, folder=PARTS, **more)
    made.record = False
    made.input("count", "parts.py:Count", host=host)
    made.output("counts", "parts.py:Counts", host=host)
    return made


def run(made: Experiment, out: Path, show: Told | None = None) -> list[list[str]]:
    """Return what its output counted; with `show`, on a fabric."""
    made.run(out, show=show or Told(), direct=show is None)
    text = (out / "counts.txt").read_text(encoding="utf-8")
    return [line.split() for line in text.splitlines()]


def series(rows: list[list[str]], name: str) -> list[tuple[int, int]]:
    """(tick, n) of what one agent said."""
    return [(int(r[0]), int(r[3])) for r in rows if r[2] == name]


def test_time_is_n_times_dt_and_never_drifts(tmp_path: Path) -> None:
    rows = run(lab(300), tmp_path)
    assert [int(r[0]) for r in rows] == list(range(1, 301))
    assert [float(r[1]) for r in rows] == [n / 10 for n in range(1, 301)]
    assert [r[1] for r in rows[:3]] == ["0.1", "0.2", "0.3"]


@given(
    n=st.integers(1, 2**53),
    dt=st.one_of(st.integers(1, 10**6).map(lambda k: k / 10**6), st.floats(1e-9, 1e3)),
)
def test_time_is_the_decimal_product_rounded_once(n: int, dt: float) -> None:
    exact = n * Fraction(repr(dt))
    found = time_of(n, dt)
    assert found == float(exact)
    if len(repr(dt)) < 9 and n < 10**6:  # short enough to be read as it is meant
        assert found == float(n * Decimal(repr(dt)))


def test_earlier_phases_are_read_at_n_and_all_else_at_n_minus_1(tmp_path: Path) -> None:
    made = lab()
    made.process("first", "parts.py:Pass", heard_from="input/count")
    made.process("second", "parts.py:Pass", heard_from="process/first")
    made.process("third", "parts.py:Pass", heard_from="process/second")
    rows = run(made, tmp_path)
    ticks = range(1, 13)
    assert series(rows, "count") == [(n, n) for n in ticks]
    assert series(rows, "first") == [(n, n) for n in ticks]
    assert series(rows, "second") == [(n, n - 1) for n in ticks]
    assert series(rows, "third") == [(n, max(n - 2, 0)) for n in ticks]


def test_a_cycle_within_one_phase_has_a_defined_outcome(tmp_path: Path) -> None:
    made = lab()
    made.process("a", "parts.py:Add", heard_from="process/b")
    made.process("b", "parts.py:Add", heard_from="process/a")
    rows = run(made, tmp_path)
    # Each reads what the other said at the tick before: both count together.
    assert series(rows, "a") == series(rows, "b") == [(n, n) for n in range(1, 13)]


def test_every_third_tick(tmp_path: Path) -> None:
    made = lab()
    made.process("third", "parts.py:Pass", heard_from="input/count", every=3)
    made.process("after", "parts.py:Pass", heard_from="process/third")
    rows = run(made, tmp_path)
    ticks = range(1, 13)
    assert series(rows, "third") == [(n, n - n % 3) for n in ticks]
    assert series(rows, "after") == [(n, (n - 1) - (n - 1) % 3) for n in ticks]
    # Its dt is the time from one of its steps to the next; the others keep theirs.
    steps = [r for r in rows if r[2] == "third" and int(r[0]) >= 3]
    assert {float(r[5]) for r in steps} == {0.3}
    assert {r[5] for r in rows if r[2] == "after"} == {"0.1"}


@pytest.mark.parametrize("every", [2.5, 0, -1, True, "2"])
def test_a_rate_that_does_not_divide_is_refused(every: Any) -> None:
    with pytest.raises(ExperimentError) as caught:
        lab().process("p", "parts.py:Pass", heard_from="input/count", every=every)
    assert str(caught.value) == (
        f"process 'p': every is {every!r}; expected a whole number from 1. (R0408)"
    )


def test_a_free_running_member_is_never_waited_for(tmp_path: Path) -> None:
    """It needs 50 ms for a step, and the ticks come every 5 ms."""
    made = lab(200, 0.005, pace=1)
    made.process("slow", "parts.py:Slow", heard_from="input/count")
    made.process("after", "parts.py:Pass", heard_from="process/slow", host=HERE)
    rows = run(made, tmp_path, Told())
    assert len(series(rows, "count")) == 200
    seen = [n for _, n in series(rows, "slow")]
    assert seen == sorted(seen)
    # It passes over ticks: at each of its steps it takes the newest there are.
    assert 3 <= len(set(seen)) <= 60
    late = [tick - n for tick, n in series(rows, "slow") if n]
    assert min(late) >= 0
    assert sorted(late)[len(late) // 2] < 100
    after = [n for _, n in series(rows, "after")]
    assert after == sorted(after)
    assert len(set(after)) >= 3


def test_a_held_tick_names_who_how_long_and_where(tmp_path: Path) -> None:
    made = lab()
    made.input("spin", "parts.py:Spin")
    made.process("follows", "parts.py:Pass", heard_from="input/spin", host=HERE)

    def end(clock: Clock) -> None:
        until(lambda: len(told.of("held")) >= 2)
        (spins,) = [s for s in clock.status() if s["agent"] == "input/spin"]
        os.kill(int(spins["host"].rpartition(":")[2]), KILL)

    told = Told(end)
    with pytest.raises(AgentError) as caught:
        made.run(tmp_path, show=told)
    assert str(caught.value) == f"input/spin: {WAS_KILLED} (R0522)"
    # An infinite loop of pure Python; who waits for it is not to blame.
    for line in told.of("held"):
        assert re.fullmatch(
            r"tick 5 is held by input/spin on \S+ "
            r"\(parts\.py, line \d+, in read\) for \d+\.\d s",
            line,
        ), line


@pytest.mark.parametrize(
    ("how", "ahead"),
    [
        ({"pace": "fast", "host": "count"}, AHEAD),
        ({"pace": 100}, AHEAD),  # those of 0.1 s that are due
        ({"pace": "fast", "on_failure": "drop"}, 1),
    ],
)
def test_who_depends_on_nobody_is_ahead_by_so_much_and_no_more(
    tmp_path: Path, how: dict[str, Any], ahead: int
) -> None:
    def look(clock: Clock) -> None:
        until(lambda: any("tick 5 is held by input/spin" in x for x in told.of("held")))
        seen.update({s["agent"]: s["tick"] for s in clock.status()}, clock=clock.tick.n)
        clock.pacing.end()
        pid = next(s["host"] for s in clock.status() if s["agent"] == "input/spin")
        os.kill(int(pid.rpartition(":")[2]), KILL)

    seen: dict[str, int] = {}
    told = Told(look)
    made = lab(40, **how)
    made.record = True
    made.input("spin", "parts.py:Spin")
    made.process("reads", "parts.py:Pass", heard_from="input/spin", host="reads")
    made.plans["output/counts"].host = "reads"
    with suppress(AgentError):
        made.run(tmp_path, show=told)
    done = {"input/spin": 4, "process/reads": 4, "output/counts": 4}
    done["output/recorder"] = 4
    clock, count = seen.pop("clock"), seen.pop("input/count")
    assert seen == done
    if how["pace"] == "fast":
        assert clock == count == 4 + ahead
    else:  # as many as were due when the clock began to wait
        assert 4 < count <= clock <= 4 + ahead


def test_ticks_are_done_one_by_one_whatever_was_lost() -> None:
    with Session(Link(f"tcp/127.0.0.1:{free_port()}", serve=True)) as session:
        guard = Guard(session)
        inbox = Inbox(
            session, "h", guard, print, Complaints(print), Leases(), Done(session)
        )
        inbox.watch()
        run = 5
        inbox.begin(Admission(badge_of(run, 1), 3, 0.1, 0, 30.0))
        membership = inbox.membership
        ticks = session.publisher(session.key("clock", "@step", "tick"))
        # 3 is what it begins with, 4 was lost and is said again, 5 comes twice; and
        # another run has ticks of its own.
        for n in (2, 3, 5, 6, 5, 4):
            ticks.put(pack_beat(run, Tick(n, n / 10, 0.1), 0))
            ticks.put(pack_beat(run + 1, Tick(n + 1, (n + 1) * 0.1, 0.1), 0))
        again, heard = 0, list[int]()
        while len(heard) < 4:
            beat = inbox.next_beat()
            again += beat is None
            membership.repeated = False
            heard += [beat.tick.n] if beat else []
        assert heard == [3, 4, 5, 6]
        assert again == 2


def test_a_clock_that_dies_as_it_lets_a_host_in_is_missed() -> None:
    """It was never seen, so it is not seen to go: nothing would wake the host."""
    with Session(Link(f"tcp/127.0.0.1:{free_port()}", serve=True)) as session:
        age = session.key("clock", "@age")
        session.answer_at_once(age, lambda q: q.answer(age, pack_age(6, 0.1, 0)))
        guard, done = Guard(session), Done(session)
        inbox = Inbox(session, "h", guard, print, Complaints(print), Leases(), done)
        inbox.distant = True
        inbox.watch()
        assert inbox.idle == float("inf")  # who asks may come first
        inbox.begin(Admission(badge_of(5, 1), 1, 0.1, 0, 30.0))
        with pytest.raises(Orphaned, match="another one has begun on this fabric"):
            inbox.next_beat()


def test_a_host_of_the_run_itself_obeys_no_other_clock() -> None:
    """A program that answers as another run's clock does not end it: its pipe does."""
    with Session(Link(f"tcp/127.0.0.1:{free_port()}", serve=True)) as session:
        age = session.key("clock", "@age")
        session.answer_at_once(age, lambda q: q.answer(age, pack_age(6, 0.1, 0)))
        guard, done = Guard(session), Done(session)
        inbox = Inbox(session, "h", guard, print, Complaints(print), Leases(), done)
        inbox.watch()
        inbox.begin(Admission(badge_of(5, 1), 1, 0.1, 0, 1.2))
        with pytest.raises(Orphaned, match="the clock is out of sight for"):
            inbox.next_beat()
