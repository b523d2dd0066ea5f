"""A student's first hour, under Wine: what the README types, one after the other."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.dashboard.browser import Chromium, page_at
from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.timeout(300)]

#: an input, a robot, a process with a job, and an output: each is a process
LAB = """\
from rems_net import Experiment, In, Input, Out, Process, Schema, Woodbot
from rems_net.units import number


def root(value):
    import numpy  # a library that looks at the standard handles while it loads

    return float(numpy.sqrt(value))


class Ahead(Input):
    command = Out(Woodbot.command)

    def read(self, tick):
        return {"wheel/left": 3.0, "wheel/right": 2.5}


class Jobs(Process):
    state = In()
    result = Out(Schema("result", {"root": number()}))

    def open(self):
        self.root = 0.0

    def step(self, tick):
        if tick.n == 1:
            self.jobs.submit(root, 2.0, then=self.take, process=True)
        self.result["root"] = self.root

    def take(self, value):
        self.root = value


lab = Experiment("lab", dt="20 ms", duration="600 s", pace=1.0)
lab.input("ahead", Ahead)
lab.robot("sim", "woodbot", "kinematic", command="input/ahead")
lab.robot("other", "woodbot", "kinematic")
lab.process("jobs", Jobs, state="robot/sim/state")
lab.output("log", "csv")
lab.run()
"""

SHORT = """\
[experiment]
name = "short"
dt = "50 ms"
duration = "2 s"

[[robot]]
name = "sim"
definition = "woodbot"
driver = "kinematic"

[[output]]
name = "log"
type = "csv"
"""


@pytest.fixture(scope="module")
def folder(
    windows: Windows, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Path]:
    """A folder in which an experiment runs, in four processes, in real time."""
    folder = tmp_path_factory.mktemp("hour")
    (folder / "lab.py").write_text(LAB.replace("DURATION", '"600 s"'), encoding="utf-8")
    with windows.start(
        windows.exe, "-m", "rems_net", "run", "lab.py", cwd=folder
    ) as process:
        assert process.stdout is not None
        printed = ""
        while "fabric at" not in printed:
            line = process.stdout.readline()
            assert line, printed
            printed += line
        yield folder
        windows.rems("clock", "end", cwd=folder)
        printed = process.stdout.read()
        assert process.wait() == 0, printed


def test_the_demo(windows: Windows, tmp_path: Path) -> None:
    printed = windows.rems("demo", cwd=tmp_path)
    assert r"picture  runs\demo\comparison.png" in printed
    assert {path.name for path in (tmp_path / "runs" / "demo").iterdir()} >= {
        "kinematic.csv",
        "mujoco.csv",
        "run.mcap",
        "comparison.png",
    }


def test_a_run_is_seen_from_outside(windows: Windows, folder: Path) -> None:
    printed = windows.rems("list", cwd=folder)
    for agent in ("input/ahead", "robot/sim", "process/jobs", "output/log"):
        assert agent in printed
    assert "heading" in windows.rems("get", "'robot/*/state'", cwd=folder)
    printed = windows.rems("why", "robot/sim/command", cwd=folder)
    assert "input/ahead" in printed
    command = ["robot/other/command", "wheel/left=1"]
    windows.rems("put", *command, "--for", "1 s", cwd=folder)
    assert "1.41421" in windows.rems("get", "process/jobs/result", cwd=folder)
    printed = windows.rems("stop", cwd=folder)
    assert "robot/sim stands" in printed
    assert "robot/sim" in windows.rems("stop", "--release", cwd=folder)


def test_a_browser_sees_the_page(
    windows: Windows, folder: Path, chromium: Chromium
) -> None:
    page = windows.start(
        windows.exe, "-m", "rems_net", "dashboard", "--no-qr", cwd=folder
    )
    with page:
        assert page.stdout is not None
        link = next(line.split()[-1] for line in page.stdout if "http://" in line)
        tree = "document.querySelector('#tree').innerText"
        with page_at(link, chromium, f"{tree}.includes('sim')") as tab:
            lights = "document.querySelector('#lights').textContent"
            tab.until(f"{lights}.includes('live')")
        page.kill()


def test_a_sweep_has_workers(windows: Windows, tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text(SHORT, encoding="utf-8")
    words = ["sweep", "lab.toml", "--seeds", "4", "--workers", "2", "--out", "s"]
    assert "4 runs, in s\\table.csv" in windows.rems(*words, cwd=tmp_path)


def test_a_robot_of_ones_own(windows: Windows, tmp_path: Path) -> None:
    windows.rems("new", "robot", "my_robot", cwd=tmp_path)
    windows.rems("check", "my_robot.py", cwd=tmp_path)
    windows.rems("run", "my_robot.py", cwd=tmp_path)
    windows.rems("plot", "runs/my_robot", cwd=tmp_path)
    assert (tmp_path / "runs" / "my_robot" / "plot.png").stat().st_size > 10_000
