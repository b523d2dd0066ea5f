"""It never gives up: the core over a real session, and a router that fails.

The figures of issue are printed; only the slow test holds them, on a quiet machine.
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

Fault = Callable[[Serve], tuple[float, float]]


@contextmanager
def driven(folder: Path, serve: Serve, second: str = "") -> Iterator[Servos]:
    """A robot in a process of its own, which somebody drives."""
    with ExitStack() as stack:
        session = stack.enter_context(Session(Link(serve.endpoint)))
        more = {"router2": second} if second else {}
        fleet = Fleet(session, ["woodbot-1"], print, servos=folder, more=more)
        stack.enter_context(fleet)
        for endpoint in filter(None, (serve.endpoint, second)):
            stack.enter_context(Driver(endpoint, "woodbot-1"))
        servos = Servos(folder, "woodbot-1")
        until(lambda: servos.drives, 60)
        yield servos


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
    with Serve() as serve, driven(tmp_path, serve) as servos:
        for _ in range(3):
            print("killed:", judge(servos, *killed(serve), strict=False))


def test_a_router_that_is_frozen(tmp_path: Path) -> None:
    compiled()
    with Serve() as serve, driven(tmp_path, serve) as servos:
        print("frozen 10 s:", judge(servos, *frozen(serve, 10), strict=False))


def test_a_router_at_another_address(tmp_path: Path) -> None:
    compiled()
    with Serve() as serve:
        other = free_port()
        with driven(tmp_path, serve, f"tcp/127.0.0.1:{other}") as servos:
            gone = serve.kill()
            until(lambda: not servos.drives)
            serve.port = other
            print("moved:", judge(servos, gone, serve.start(), strict=False))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_as_promised(tmp_path: Path) -> None:
    """Standing within 0.6 s each time, and back within 6 s, on a quiet machine."""
    compiled()
    with Serve() as serve, driven(tmp_path, serve) as servos:
        for turn in range(20):
            print(turn, "killed:", judge(servos, *killed(serve), strict=True))
        for seconds in (10, 60):
            told = judge(servos, *frozen(serve, seconds), strict=True)
            print(f"frozen {seconds} s:", told)
