"""It never gives up: the core over a real session, and a router that fails.

What is promised is held by the slow test alone, on a quiet machine; others print it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from rems_net.firmware.fleet import Fleet
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until
from tests.firmware.emulated.scene import Driver, Serve, Servos, compiled

#: s of wall time: to stand still, and to be back, as promised; and on a busy machine
STANDS, BACK = 0.6, 6.0
STANDS_BUSY, BACK_BUSY = 3.0, 60.0
#: times that the router is killed, and bytes by which the robot may grow meanwhile
KILLED, GROWTH = 100, 4_000_000

Fault = Callable[[Serve], tuple[float, float]]


@contextmanager
def driven(
    folder: Path, serve: Serve, second: str = ""
) -> Iterator[tuple[Servos, int]]:
    """A robot in a process of its own, which somebody drives; and its pid."""
    with ExitStack() as stack:
        session = stack.enter_context(Session(Link(serve.endpoint)))
        more = {"router2": second} if second else {}
        fleet = Fleet(session, ["woodbot-1"], print, servos=folder, more=more)
        stack.enter_context(fleet)
        for endpoint in filter(None, (serve.endpoint, second)):
            stack.enter_context(Driver(endpoint, "woodbot-1"))
        servos = Servos(folder, "woodbot-1")
        until(lambda: servos.drives, 60)
        yield servos, fleet.pids[0]


def judge(servos: Servos, gone: float, back: float, *, strict: bool) -> str:
    """Wait until it drives again; how long it took to stand, and to be back [s]."""
    until(lambda: servos.drove(back) < float("inf"), BACK_BUSY)
    stood, drove = servos.stood(gone, back), servos.drove(back)
    assert stood < (STANDS if strict else STANDS_BUSY)
    assert drove < (BACK if strict else BACK_BUSY)
    return f"stood after {stood:.2f} s, back {drove:.2f} s after its router"


def killed(serve: Serve) -> tuple[float, float]:
    """Its router is gone for a second, and its clock with it."""
    gone = serve.kill()
    until(lambda: time.monotonic() > gone + 1.0)
    return gone, serve.start()


def frozen(serve: Serve, seconds: float) -> tuple[float, float]:
    """Its router takes connections, and says nothing."""
    gone = serve.freeze()
    until(lambda: time.monotonic() > gone + seconds, seconds + 1)
    return gone, serve.thaw()


def test_a_router_that_is_killed_again_and_again(tmp_path: Path) -> None:
    compiled()
    with Serve() as serve, driven(tmp_path, serve) as (servos, _):
        for _ in range(3):
            print("killed:", judge(servos, *killed(serve), strict=False))


def test_a_router_that_is_frozen(tmp_path: Path) -> None:
    compiled()
    with Serve() as serve, driven(tmp_path, serve) as (servos, _):
        print("frozen 10 s:", judge(servos, *frozen(serve, 10), strict=False))


def test_a_router_at_another_address(tmp_path: Path) -> None:
    compiled()
    with Serve() as serve:
        other = free_port()
        with driven(tmp_path, serve, f"tcp/127.0.0.1:{other}") as (servos, _):
            gone = serve.kill()
            until(lambda: not servos.drives)
            serve.port = other
            print("moved:", judge(servos, gone, serve.start(), strict=False))


def taken(pid: int) -> tuple[int, int]:
    """What a process has: bytes of memory, and threads and open files."""
    folder = Path(f"/proc/{pid}")
    status = (folder / "status").read_text(encoding="ascii")
    line = next(one for one in status.splitlines() if one.startswith("VmRSS"))
    counted = len([*(folder / "task").iterdir()]) + len([*(folder / "fd").iterdir()])
    return 1024 * int(line.split()[1]), counted


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_as_promised(tmp_path: Path) -> None:
    """Standing within 0.6 s each time, back within 6 s, and nothing is left behind."""
    compiled()
    with Serve() as serve, driven(tmp_path, serve) as (servos, pid):
        for turn in range(KILLED):
            print(turn, "killed:", judge(servos, *killed(serve), strict=True))
            if turn == KILLED // 10:
                before = taken(pid)
        after = taken(pid)
        print(f"bytes, threads and files: {before}, at the end {after}")
        assert after[0] < before[0] + GROWTH
        assert after[1] <= before[1] + 4
        for seconds in (10, 60):
            told = judge(servos, *frozen(serve, seconds), strict=True)
            print(f"frozen {seconds} s:", told)
