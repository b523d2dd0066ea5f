"""`rems stop` and `rems stop --release`, told by robots that know STOP."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rems_net.client import join
from rems_net.router.finding.remembered import remember
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Router, free_port, until
from tests.client.programs import programs
from tests.commands import Run, Running, Start

Robots = Callable[..., None]
FREE = "Let them go on with: rems stop --release\n"


@pytest.fixture
def robots(monkeypatch: pytest.MonkeyPatch) -> Iterator[Robots]:
    """A router without an experiment, and who is there beside it."""
    with Router() as router, programs() as start:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)

        def begin(*who: str) -> None:
            start("standin.py", router.endpoint, *who)
            with join() as fabric:
                here = fabric.session.who
                until(lambda: here("rems/clock/@alive") or here("rems/robot/*/@alive"))

        yield begin


def told(rems: Run) -> tuple[int, str, str]:
    """What it says once more: on a busy machine others may be late at first."""
    done = rems("stop")
    return done.returncode, done.stdout, done.stderr


def test_all_stand(robots: Robots, program: Run) -> None:
    robots("a=stands", "b=brakes")
    said = (
        "robot/a stands at tick 412 (8.24 s): confirmed\n"
        f"robot/b stands at tick 412 (8.24 s): confirmed\n{FREE}"
    )
    until(lambda: told(program) == (0, said, ""))


def test_one_does_not_answer_and_one_moves(robots: Robots, rems: Run) -> None:
    robots("a=stands", "b=mute", "c=moves")
    said = (
        "robot/a stands at tick 412 (8.24 s): confirmed\n"
        "robot/b has not answered: it may drive on until it is back\n"
        f"robot/c may move at tick 412 (8.24 s): STOP is sent, not confirmed\n{FREE}"
    )
    late = "rems: robot/b has not answered within 0.25 s\n"
    until(lambda: told(rems) == (1, said, late))


def test_no_robot(robots: Robots, rems: Run) -> None:
    robots("clock=robot/a")
    done = rems("stop")
    text = "no robot is there; one that comes will stand\n"
    assert (done.returncode, done.stdout) == (1, text + FREE)


def test_the_clock_releases(robots: Robots, program: Run) -> None:
    robots("clock=robot/a,robot/b")
    done = program("stop", "--release")
    said = "released: robot/a, robot/b\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")


def test_the_router_releases(robots: Robots, rems: Run) -> None:
    robots("a=stands")
    rems("stop")
    done = rems("stop", "--release")
    said = "released: the router kept a STOP; the next run may drive\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")
    done = rems("stop", "--release")
    said = "there was nothing to release: no experiment runs, and no STOP is kept\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")


def test_nobody_keeps_a_stop(rems: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A router that is Zenoh's own."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    monkeypatch.setenv("REMS_ROUTER", endpoint)
    with Session(Link(endpoint, serve=True)):
        done = rems("stop", "--release")
    assert (done.returncode, done.stdout) == (2, "")
    assert ": no clock and no router keeps a STOP." in done.stderr


REPEATED = " does not answer; STOP is repeated until it does. Ctrl+C gives up.\n"


def said_again(stop: Running, endpoint: str, back: Callable[[], object]) -> None:
    """`rems stop` goes on until the router is back, and robot a stands then."""
    assert stop.stderr is not None
    assert stop.stderr.readline() == f"rems: The router at {endpoint}{REPEATED}"
    back()
    out, _ = stop.communicate(timeout=60)
    assert stop.returncode == 0
    assert "robot/a stands at tick 412 (8.24 s): confirmed\n" in out
    assert "A robot that comes back later stands still, too.\n" in out


def test_a_router_that_was_joined_is_down(
    start: Start, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for folder in ("XDG_CONFIG_HOME", "APPDATA"):
        monkeypatch.setenv(folder, str(tmp_path))
    monkeypatch.delenv("REMS_ROUTER", raising=False)
    with Router() as router, programs() as beside:
        remember(router.endpoint, "rems")
        beside("standin.py", router.endpoint, "a=stands")
        router.kill()
        said_again(start("stop"), router.endpoint, router.start)


def test_the_router_of_rems_serve_is_down(start: Start) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"

    def serve() -> Running:
        process = start("router", "serve", "--listen", endpoint)
        assert process.stdout is not None
        assert process.stdout.readline().startswith("Open fabric 'rems'.")
        return process

    router = serve()
    with programs() as beside:
        beside("standin.py", endpoint, "a=stands")
        router.kill()
        router.wait()
        said_again(start("stop"), endpoint, serve)


def test_an_address_that_was_only_typed(
    rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REMS_ROUTER", f"tcp/127.0.0.1:{free_port()}")
    done = rems("stop")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("rems: No router answers at ")
