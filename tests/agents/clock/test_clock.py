"""A clock: its pace, what it is told, and that a fabric has one."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import inf, nan
from pathlib import Path

import pytest

from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.serving import serve
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.terms import Terms
from rems_net.client import Fabric, join
from rems_net.errors import AgentError, FabricError
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.clock.test_time import lab, run
from tests.agents.runs import Router, Told, until


@pytest.mark.parametrize(("pace", "least"), [(1.0, 1.0), (2.0, 0.5)])
def test_no_tick_comes_before_it_is_due(
    tmp_path: Path, pace: float, least: float
) -> None:
    begun: list[float] = []

    def note(clock: Clock) -> None:
        until(lambda: clock.tick.n >= 1)
        begun.append(time.monotonic())

    made = lab(100, 0.01, pace=pace)
    rows = run(made, tmp_path, Told(note))
    assert len(rows) == 100
    assert time.monotonic() - begun[0] > (least - 0.1) * 0.9


def test_a_second_clock_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def second(clock: Clock) -> None:
        monkeypatch.setenv("REMS_ROUTER", clock.session.link.endpoint)
        with pytest.raises(FabricError) as caught:
            lab().run(tmp_path / "b", show=Told())
        assert "has a clock already: another experiment runs at tcp/" in str(
            caught.value
        )

    assert len(run(lab(100, 0.01, pace=1), tmp_path / "a", Told(second))) == 100


def test_of_two_clocks_that_start_at_once_one_stays_at_most() -> None:
    def start(together: threading.Barrier, opened: list[str]) -> None:
        with Session(Link(router.endpoint)) as session:
            together.wait()
            with suppress(FabricError):
                Clock(session, Terms(0.1)).open()
                opened.append(session.id)
            together.wait()

    with Router() as router:
        for _ in range(10):
            opened: list[str] = []
            given = threading.Barrier(2), opened
            threads = [threading.Thread(target=start, args=given) for _ in range(2)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            assert len(opened) <= 1


@contextmanager
def open_fabric(dt: float, pace: float) -> Iterator[tuple[Fabric, Clock]]:
    """An open fabric whose clock has these settings; it ends with this."""
    clocks: list[Clock] = []
    with Router() as router, Session(Link(router.endpoint)) as session:
        thread = threading.Thread(target=serve, args=(session, dt, pace, clocks.append))
        thread.start()
        until(lambda: clocks)
        try:
            with join(at=router.endpoint) as fabric:
                yield fabric, clocks[0]
        finally:
            clocks[0].pacing.end()
            thread.join()


@pytest.mark.parametrize("pace", [5e-324, 1e-300, 1e300, inf, nan, -1, True, "fats"])
def test_a_pace_that_no_clock_can_keep(pace: float | str) -> None:
    with open_fabric(0.02, 1.0) as (fabric, clock):
        with pytest.raises(AgentError, match="a factor of real time, "):
            fabric.clock("pace", pace)
        assert fabric.clock("pace", 0.001) == 0.001
        assert fabric.clock("pace", 2) == 2.0
        assert clock.tick.n < 1000


def test_a_pace_with_ticks_of_many_hours() -> None:
    with open_fabric(1000.0, 1.0) as (fabric, _):
        with pytest.raises(AgentError, match="1e\\+06 s of real time; expected 3600 s"):
            fabric.clock("pace", 0.001)
        assert fabric.clock("pace", 0.5) == 0.5


def test_an_open_fabric_needs_a_pace() -> None:
    with open_fabric(0.02, 1.0) as (fabric, _):
        with pytest.raises(AgentError, match="does not wait for agents, so it needs a"):
            fabric.clock("pace", "fast")
        assert fabric.clock("pace", 1.0) == 1.0


def test_a_clock_that_is_always_late_reads_its_letters() -> None:
    """It never waits for its next tick, and for no agent."""
    with open_fabric(1e-9, 1e4) as (fabric, clock):
        until(lambda: clock.tick.n > 1000)
        assert fabric.clock("pace", 0.001) == 0.001
        fabric.clock("pause")
        clock.pacing.step(10**12)  # a fabric would wait for the last of them
        until(lambda: clock.tick.n > 10_000)
        stood = fabric.clock("pause")
        assert _stands(clock) < stood + 2 * AHEAD


def test_paused_stepped_resumed_and_ended(tmp_path: Path) -> None:
    seen: list[int] = []

    def tell(clock: Clock) -> None:
        fabric: Fabric = until(_join)
        with fabric:
            until(lambda: clock.tick.n >= 3)
            fabric.clock("pause")
            until(lambda: clock.pacing.paused)
            stood = until(lambda: _stands(clock))
            assert fabric.clock("step", 5) == stood + 5
            assert _stands(clock) == stood + 5
            with pytest.raises(AgentError, match="expected a whole number from 1"):
                fabric.clock("step", 0)
            fabric.clock("pace", "fast")
            fabric.clock("resume")
            until(lambda: clock.tick.n > stood + 50)
            seen.append(fabric.clock("end"))

    made = lab(1_000_000, 0.01, "count", pace=1)
    rows = run(made, tmp_path, Told(tell))
    assert [int(r[0]) for r in rows] == list(range(1, len(rows) + 1))
    assert [float(r[1]) for r in rows] == [n / 100 for n in range(1, len(rows) + 1)]
    assert seen[0] <= len(rows) < 1_000_000


def _join() -> Fabric | None:
    try:
        return join()
    except FabricError:
        return None


def _stands(clock: Clock) -> int:
    """The tick at which the clock stands still, or 0 while it moves."""
    n = clock.tick.n
    threading.Event().wait(0.2)
    return n if clock.tick.n == n else 0
