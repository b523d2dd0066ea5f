"""A run that is ended while its hosts start: nothing is left, nothing is shouted."""

import json
import os
import random
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.system.interrupts import without_ctrl_c
from tests.agents.runs import quiet, relatives, until
from tests.commands import Run, Running, Start, begun, command
from tests.interrupts import interrupt_all

HOSTS = 2
LAB = (
    '[experiment]\ndt = "0.1 s"\nduration = "60 s"\npace = 1\nrecord = false\n'
    + "".join(
        f'[[robot]]\nname = "r{i}"\ndefinition = "woodbot"\ndriver = "kinematic"\n'
        for i in range(HOSTS)
    )
)
#: seconds after the first host was started; a start takes some tenths of a second
MOMENTS = [0.0, 0.05, 0.15, 0.3, 0.6]
#: s. After that a host is gone: two, and a busy machine's one. Under Wine a Python
#: takes a second to start, before it looks for the program that started it.
GONE = 10.0 if sys.platform == "win32" else 3.0


@pytest.fixture(params=MOMENTS)
def starting(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Running, str]]:
    """A run whose hosts start, in a process group of its own; and their mark."""
    (tmp_path / "lab.toml").write_text(LAB)
    mark = f"START_MARK={tmp_path}"
    monkeypatch.setenv("START_MARK", str(tmp_path))
    process = begun(command("run", "lab.toml"), tmp_path)
    until(lambda: len(relatives(mark)) > 1)
    time.sleep(request.param + random.uniform(0.0, 0.02))  # the moment is the test
    yield process, mark
    if process.poll() is None:
        process.kill()
    process.communicate()


def test_killed(starting: tuple[Running, str]) -> None:
    process, mark = starting
    process.kill()
    until(lambda: not relatives(mark), GONE)


def test_ctrl_c(starting: tuple[Running, str]) -> None:
    """It reaches the whole group, as from a terminal."""
    process, mark = starting
    interrupt_all(process)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, "Traceback" in out + err) == (130, False), out + err
    # It may have come to its first ticks by then, and says so; or not to the run yet.
    told = quiet(err).strip()
    assert told.startswith("rems: Interrupted after tick ") or told in (
        "rems: Interrupted before the first tick.",
        "",
    )
    assert not relatives(mark)
    assert not list(Path(os.environ["XDG_RUNTIME_DIR"]).glob("rems_net/*"))


def test_ctrl_c_is_held_back_whichever_thread_hears_it() -> None:
    """Else a process that is half started is left behind."""
    other = threading.Thread(target=threading.Event().wait, args=(0.5,))
    other.start()
    reached = []

    def begin() -> None:
        with without_ctrl_c():
            if os.name == "nt":  # there this would end the process
                signal.raise_signal(signal.SIGINT)
            else:
                os.kill(os.getpid(), signal.SIGINT)
            other.join()
            reached.append(True)

    with pytest.raises(KeyboardInterrupt):
        begin()
    assert reached


def test_list_waits_until_all_are_there(
    folder: Path,
    rems: Run,
    start: Start,
) -> None:
    """Asked in the moment in which the run says where it is."""
    (folder / "lab.toml").write_text(LAB)
    process = start("run", "lab.toml")
    assert process.stdout is not None
    assert "fabric at" in process.stdout.readline()
    done = rems("list", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert [row["agent"] for row in json.loads(done.stdout)] == [
        f"robot/r{i}" for i in range(HOSTS)
    ]


def test_list_says_whom_the_run_waits_for(
    folder: Path,
    rems: Run,
    start: Start,
) -> None:
    away = LAB.replace('name = "r1"', 'name = "r1"\nmachine = "b"')
    (folder / "lab.toml").write_text(away)
    process = start("run", "lab.toml")
    assert process.stdout is not None
    assert any("fabric at" in line for line in process.stdout)
    done = rems("list", "--json")
    said = "rems: the run waits for robot/r1\n"
    assert (done.returncode, done.stderr) == (0, said)
    assert [row["agent"] for row in json.loads(done.stdout)] == ["robot/r0"]
