"""The host `here`: agents in the program of their run, as a thread beside the clock."""

import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, Input, Out, Process, Tick, Woodbot
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.plan import HERE
from rems_net.client import Fabric
from rems_net.errors import AgentError, ExperimentError, uncoded
from rems_net.events import warn
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import PARTS, Told, digest, until
from tests.commands import ROOT, environment
from tests.interrupts import APART, INTERRUPTED, interrupt


def lab(cls: type[Input] | None = None) -> Experiment:
    """A robot and its input in this program, and a second robot in a process."""
    made = Experiment("here", dt="20 ms", duration="2 s", folder=PARTS)

    class Keys(Input):
        """A class in a function: no process could import it."""

        command = Out(Woodbot.command)

        def step(self, tick: Tick) -> None:
            self.command = {"wheel/left": 3, "wheel/right": 2 + tick.t}

    made.input("keys", cls or Keys, host=HERE)
    made.robot("near", "woodbot", "kinematic", command="input/keys", host=HERE)
    made.robot("far", "woodbot", "kinematic", command="input/keys")
    return made


def test_the_same_bytes_as_in_an_engine(tmp_path: Path) -> None:
    told = Told()
    lab().run(tmp_path / "here", show=told)
    lab().run(tmp_path / "engine", direct=True)
    here, engine = (digest(tmp_path / w / "run.mcap") for w in ("here", "engine"))
    assert here == engine
    assert told.said == []  # no warning: a kinematic robot needs no pinned process


def test_it_starts_no_process_and_is_on_the_fabric(tmp_path: Path) -> None:
    """Another program reads its state, calls its verb, and stops it."""
    seen: list[Any] = []

    def look(clock: Clock) -> None:
        until(lambda: clock.tick.n > 3)
        with Session(Link(told.endpoint)) as session:
            fabric = Fabric(session)
            seen.extend(agent["host"] for agent in fabric.agents())
            robot = fabric.robot("sim")
            robot.command.update({"wheel/left": 3.0, "wheel/right": 3.0})
            until(lambda: robot.state["x"] > 0.01)
            robot.reset(initial={"x": 0.5})
            seen.append(robot.state["x"])
            seen.append([one.stands for one in fabric.stop()])
            fabric.release()
            seen.append([one for one in threading.enumerate() if "pyo3" in one.name])
            fabric.clock("end")

    made = Experiment("alone", dt="20 ms", duration=1000.0, pace=1.0, record=False)
    made.robot("sim", "woodbot", "kinematic", host=HERE)
    told = Told(look)
    made.run(tmp_path, show=told)
    host, x, stands, zenohs = seen
    assert host.endswith(f":{os.getpid()}")
    assert x == pytest.approx(0.5, abs=0.05)
    assert stands == [True]
    # Python waits for their end: a daemon among them aborted one program in ten.
    assert zenohs
    assert not any(thread.daemon for thread in zenohs)


class Boo(Input):
    command = Out(Woodbot.command)

    def step(self, tick: Tick) -> None:
        if tick.n == 50:
            raise ValueError("boo")


def test_an_agent_that_fails_is_named_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(AgentError) as caught:
        lab(Boo).run(tmp_path, show=Told())
    line = r"input/keys: ValueError: boo \(test_here\.py, line \d+, in step, tick 50\)"
    assert re.fullmatch(line, uncoded(caught.value))
    assert not [t for t in threading.enumerate() if t.name == "host here"]


class Raises(Process):
    """Fails, with the name of the thread that steps it."""

    def step(self, tick: Tick) -> None:
        if tick.n == 1:
            raise RuntimeError(threading.current_thread().name)


def test_the_run_goes_on_without_it_if_that_is_asked_for(tmp_path: Path) -> None:
    made = Experiment("drop", dt="20 ms", duration="0.2 s", on_failure="drop")
    made.process("one", Raises, host=HERE)
    made.robot("far", "woodbot", "kinematic")
    told = Told()
    made.run(tmp_path, show=told)
    assert told.clock is not None
    assert told.clock.tick.n == 10
    assert any("RuntimeError: host here" in line for line in told.said), told.said


class Doubtful(Input):
    command = Out(Woodbot.command)

    def step(self, tick: Tick) -> None:
        self.command = {"wheel/left": 1.0}
        if tick.n == 3:
            warn("odd", "three is odd")


def test_a_warning_begins_with_its_agent(tmp_path: Path) -> None:
    told = Told()
    lab(Doubtful).run(tmp_path, show=told)
    assert told.said == ["[input/keys] warning: three is odd"]


LOOP = """
import os, signal, threading, time
from rems_net import Experiment, Input, Out, Woodbot

class Loop(Input):
    command = Out(Woodbot.command)

    def step(self, tick):
        if tick.n == 5:
            later = time.monotonic() + 0.2  # tick 1 has reached the clock by then
            while time.monotonic() < later:
                pass
            print("in it", flush=True)
            while True:
                pass

lab = Experiment("loop", duration="1 s")
lab.input("keys", Loop, host="here")
lab.robot("sim", "woodbot", "kinematic", command="input/keys", host="here")
lab.run()
"""


def test_a_loop_without_end_is_named_and_ctrl_c_ends_the_program(
    tmp_path: Path,
) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", LOOP],
        cwd=tmp_path,
        env={**environment(), "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        **APART,
    ) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "in it\n"
        interrupt(program)
        _, said = program.communicate(timeout=60)
    assert program.returncode in INTERRUPTED
    stuck = r"an agent still computes in this program \(<string>, line 1\d, in step\)"
    assert re.search(stuck, said)
    assert re.search(r"Interrupted after tick \d \(0.\d0 s\)", said)


PORT = {"options": {"port": "/dev/ttyUSB0"}}
REFUSED = [
    ({"restart": 2}, "woodbot kinematic", "it has restart, and host = 'here'"),
    ({"machine": "b"}, "woodbot kinematic", "it has machine, and host = 'here'"),
    (PORT, "create2 create2", "it drives a device, which must stand still"),
]


@pytest.mark.parametrize(("words", "parts", "said"), REFUSED)
def test_what_must_not_live_here(words: dict[str, Any], parts: str, said: str) -> None:
    made = Experiment("no", duration="1 s")
    made.robot("sim", *parts.split(), host=HERE, **words)
    with pytest.raises(ExperimentError, match=f"robot 'sim': {said}"):
        made.check()
