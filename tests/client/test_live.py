"""A running fabric from outside: asking, watching, commanding, and being killed."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgpack
import pytest

from rems_net.client import join
from rems_net.errors import FabricError
from rems_net.router.find import open_session, serve
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.session import Session
from tests.agents.runs import PARTS, alive, until
from tests.commands import python

SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("live", dt=0.02, duration="600 s", pace=1, folder={str(PARTS)!r})
lab.record = False
lab.input("wave", "parts.py:Wave", host="rest")
lab.robot("auto", "parts.py:Cart", "parts.py:Euler", command="input/wave")
lab.robot("free", "parts.py:Cart", "parts.py:Euler")
lab.output("log", "parts.py:Log", host="rest")
lab.run("out")
"""
#: the same, in which each robot has a process, and the others have none
TWO = SCRIPT.replace('"rest"', '"here"')


def roster(session: Session) -> list[dict[str, Any]]:
    answers = session.ask("rems/clock/roster?format=json")
    found: list[dict[str, Any]] = json.loads(answers[0].payload) if answers else []
    return found if len(found) == 4 and all(a["tick"] > 2 for a in found) else []


Lab = tuple[subprocess.Popen[str], Session]


@contextmanager
def running(folder: Path, text: str = SCRIPT) -> Iterator[Lab]:
    """A paced experiment in a process of its own, and a session beside it."""
    script = folder / "live.py"
    script.write_text(text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as place:
        place.setenv("XDG_RUNTIME_DIR", str(folder))
        folder.chmod(0o700)
        process = subprocess.Popen(
            [sys.executable, str(script)],
            cwd=folder,
            stderr=subprocess.PIPE,
            text=True,
        )

        def find_session() -> Session | None:
            try:
                return open_session()
            except FabricError:
                return None

        try:
            session = until(find_session)
            with session:
                until(lambda: roster(session))
                yield process, session
        finally:
            process.kill()
            process.communicate()


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    """One that the test ends."""
    with running(tmp_path) as lab:
        yield lab


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """One that goes on."""
    with running(tmp_path_factory.mktemp("live"), TWO) as lab:
        yield lab


def test_state_is_read_by_key(shared: Lab) -> None:
    _, session = shared
    answers = session.ask("rems/robot/*/state?format=json")
    assert {a.key for a in answers} == {
        "rems/robot/auto/state",
        "rems/robot/free/state",
    }
    auto = next(json.loads(a.payload) for a in answers if "auto" in a.key)
    assert auto["values"]["x"]["unit"] == "m"
    assert auto["values"]["x"]["value"] > 0
    assert auto["time"] == pytest.approx(auto["tick"] * 0.02)
    (field,) = session.ask("rems/robot/auto/state/x")
    assert field.key == "rems/robot/auto/state/x"
    assert msgpack.unpackb(field.payload) > 0


def test_watching_shows_every_tick_in_order(shared: Lab) -> None:
    _, session = shared
    box = Mailbox()
    session.watch("rems/robot/auto/state", box)
    mails = [box.get(20.0) for _ in range(20)]
    ticks = [m.stamp()[0] for m in mails if isinstance(m, Mail)]
    assert ticks == list(range(ticks[0], ticks[0] + 20))


def test_any_program_may_command_a_free_robot_and_it_stops_by_itself(
    shared: Lab,
) -> None:
    _, session = shared

    def x() -> float:
        (answer,) = session.ask("rems/robot/free/state/x")
        return float(msgpack.unpackb(answer.payload))

    assert x() == 0.0
    session.put("rems/robot/free/command", msgpack.packb({"speed": 1.0, "turn": 0.0}))
    until(lambda: x() > 0.3)

    def stands() -> bool:
        (answer,) = session.ask("rems/robot/free/command/speed")
        return bool(msgpack.unpackb(answer.payload) == 0.0)

    until(stands)
    # one command acts for max_age = 0.5 s and the tick in which it was seen
    assert 0.5 <= x() <= 0.6


@pytest.mark.slow  # three programs, each of which joins and ends
@pytest.mark.parametrize("end", ["", "raise SystemError('this is its end')", "work()"])
def test_a_program_that_does_not_close_its_fabric_ends(
    shared: Lab, tmp_path: Path, end: str
) -> None:
    """At its end, by an error, or when its last thread has used the fabric."""
    text = f"""
import threading, rems_net
robot = rems_net.join().robot("free")
robot.command["speed"] = "1 percent"
def work():
    def put():
        threading.main_thread().join()
        for _ in range(5):
            robot.command["speed"] = "2 percent"
        print("worked", flush=True)
    threading.Thread(target=put).start()
{end}
"""
    (tmp_path / "program.py").write_text(text, encoding="utf-8")
    endpoint = shared[1].link.endpoint
    done = python(tmp_path, "program.py", REMS_ROUTER=endpoint)
    error = done.stderr.splitlines()[-1:]
    assert error == (["SystemError: this is its end"] if "raise" in end else [])
    assert done.stdout == ("worked\n" if "work()" in end else "")


def test_a_command_that_does_not_fit_is_told_and_harms_nobody(shared: Lab) -> None:
    process, session = shared
    for payload in (b"\xc1", msgpack.packb({"speed": 9.0, "turn": 0.0}), b""):
        session.put("rems/robot/free/command", payload)
    session.put("rems/robot/auto/command", msgpack.packb({"speed": 0.0, "turn": 0.0}))
    assert process.stderr is not None
    # On a busy machine, the clock warns between them that it is late.
    warnings = (line for line in process.stderr if "dropped" in line)
    auto, free = sorted([next(warnings), next(warnings)])
    dropped = (
        r"\[robot/{0}\] warning: robot/{0}/command dropped a value from a program "
        r"outside the experiment \(1 so far, now at [\d.]+ s\): {1}\n"
    )
    assert re.fullmatch(dropped.format("free", ".*"), free)
    deaf = r"it is commanded by input/wave alone\. \(R0619\)"
    assert re.fullmatch(dropped.format("auto", deaf), auto)
    assert roster(session)


def test_a_command_that_its_robot_would_not_hear_is_refused(shared: Lab) -> None:
    """Before, it vanished without a word where it was given."""
    _, session = shared
    with join(at=session.link.endpoint) as fabric:
        fabric.robot("free").command.update({"speed": "0 m/s"})
        robot = fabric.robot("auto")
        for _ in range(2):
            with pytest.raises(FabricError) as caught:
                robot.command.update({"speed": "0 m/s"})
            assert str(caught.value) == (
                "input/wave commands robot/auto, so it takes no command from here; to "
                "command it from a program, leave out its connection to input/wave."
                " (R0619)"
            )


def test_no_process_survives_its_killed_parent(lab: Lab, tmp_path: Path) -> None:
    process, session = lab
    pids = [int(a["host"].rpartition(":")[2]) for a in roster(session)]
    assert len(set(pids)) == 3
    assert all(alive(pid) for pid in pids)
    process.kill()
    until(lambda: not any(alive(pid) for pid in pids), 5.0)
    last = (tmp_path / "out/log.txt").read_text(encoding="utf-8").splitlines()[-1]
    assert len(last.split()) == 5  # complete to its last line
    with pytest.raises(FabricError, match="No fabric 'rems' is running"):
        open_session()


def test_a_taken_port_is_passed_over() -> None:
    first, note = serve()
    second, note2 = serve()
    with first, second:
        assert first.link.endpoint != second.link.endpoint
        with open_session() as found:
            assert found.link.endpoint == second.link.endpoint
    note.unlink()
    note2.unlink()


def test_an_experiment_joins_the_router_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rems_net import Experiment

    session, note = serve()
    with session:
        box = Mailbox()
        session.watch("rems/robot/cart/state", box)
        monkeypatch.setenv("REMS_ROUTER", session.link.endpoint)
        lab = Experiment("told", dt=0.1, duration=1, folder=PARTS)
        lab.input("wave", "parts.py:Wave", host="a")
        cart = ("parts.py:Cart", "parts.py:Euler")
        lab.robot("cart", *cart, command="input/wave", host="a")
        assert lab.run(tmp_path).ticks == 10
        ticks = [
            m.stamp()[0]
            for m in (box.get(1.0) for _ in range(10))
            if isinstance(m, Mail)
        ]
        assert ticks == list(range(1, 11))
    note.unlink()
