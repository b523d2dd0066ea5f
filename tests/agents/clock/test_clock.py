"""A clock: its pace, what it is told, and that a fabric has one."""

import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from rems_net.agents.clock.clock import Clock
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
