"""The lesson of docs/class.md, with the first student's laptop under Wine."""

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from tests.network.lab import Lab
from tests.network.lesson import LAPTOPS, SOON, Lesson, Step, steps
from tests.reliability.rig.programs import Program
from tests.reliability.rig.rig import HERE, Rig, missing
from tests.windows.console import Console, console
from tests.windows.wine import Windows

pytestmark = [
    pytest.mark.slow,
    pytest.mark.wine,
    pytest.mark.root,
    pytest.mark.timeout(900),
    pytest.mark.skipif(bool(missing()), reason=missing()),
]


class Mixed(Rig):
    """Machines of which one has Windows."""

    system: Windows
    student: str

    def services(self) -> None:
        """Start Wine's services there: they would keep a program's pipe."""
        for words in (["wineserver", "-p"], ["wine", "cmd", "/c", "ver"]):
            subprocess.run(
                [*self._enter[self.student], *words],
                env=self.system.environment,
                check=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )

    def start(
        self, name: str, argv: Sequence[str], machine: str = HERE, router: str = ""
    ) -> Program:
        if machine == self.student:
            # Windows' Python wants pipes, and its status is that of the whole.
            shell = "bash", "-c", 'set -o pipefail; "$@" 2>&1 | cat', "wine"
            python = str(self.system.root / "python.exe")
            argv = [*shell, "wine", python, *argv[1:]]
        return super().start(name, argv, machine, router)

    def _environment(self, machine: str = HERE) -> dict[str, str]:
        made = super()._environment(machine)
        if machine == self.student:
            wine = self.system.environment
            made |= {k: v for k, v in wine.items() if "WINE" in k or k == "PYTHONPATH"}
        return made


class MixedLesson(Mixed, Lesson):
    """The laptops of the page; Anna's has Windows."""

    student = LAPTOPS["Student 1"]

    def _press(self, program: Program, keys: str) -> None:
        """Wine makes Ctrl+C of a signal to Windows' process, which the shell has."""
        tasks = Path(f"/proc/{program.pid}/task/{program.pid}/children")
        for child in tasks.read_text("ascii").split():
            command = Path(f"/proc/{child}/cmdline").read_bytes()
            if keys == "Ctrl+C" and b"python.exe" in command:
                os.kill(int(child), signal.SIGINT)
                program.process.wait(SOON)
                assert "Traceback" not in program.text(), program.text()
                return
        super()._press(program, keys)

    def _missing(self, step: Step, shown: str) -> list[str]:
        return super()._missing(step, shown.replace("\\", "/"))


class MixedLab(Mixed, Lab):
    """A class of machines; `b` has Windows."""

    student = "b"

    def typed(self, *words: str, router: str) -> AbstractContextManager[Console]:
        """Type `rems` with these words in a console of the student's laptop."""
        return console(
            self.system,
            self.folder,
            self.system.exe,
            "-m",
            "rems_net",
            *words,
            enter=self._enter[self.student],
            REMS_ROUTER=router,
        )


@pytest.fixture
def apart(kept: Windows, tmp_path: Path) -> Iterator[Windows]:
    """A system whose server starts in the student's namespace."""
    with kept.copied(tmp_path / "prefix") as copy:
        yield copy


def test_the_lesson_with_a_student_on_windows(apart: Windows, tmp_path: Path) -> None:
    typed = 0
    with MixedLesson(tmp_path / "lesson") as lesson:
        lesson.system = apart
        lesson.build(machines=True)
        lesson.services()
        for step in steps():
            lesson.do(step)
            typed += len(step.text.splitlines()) if step.kind == "sh" else 0
    assert typed == 20


def test_a_robot_that_windows_brings(apart: Windows, tmp_path: Path) -> None:
    """By the line of the page; the recording has the bytes of one machine's run."""
    with MixedLab(tmp_path / "lab") as lab:
        lab.system = apart
        lab.build()
        lab.services()
        lab.file(duration=3)
        lab.says("a", "run", "lab.toml", "--alone", "--out", "alone")
        _, endpoint = lab.router("hub")
        run = lab.rems("run", "lab.toml", "--out", "here", machine="a", router=endpoint)
        run.wait_for("fabric at", SOON)
        with lab.typed("agent", "bring", "--as", "b", router=endpoint) as shown:
            shown.wait_for(r"Start it\? \[y/N\]", SOON)
            shown.type("y\r")
            shown.wait_for("The run has ended", SOON)
            assert shown.status() == 0, shown.text
        assert run.process.wait(SOON) == 0, run.text()
        assert lab.rows() == 60
        assert lab.digest("here") == lab.digest("alone")


def test_a_router_that_has_moved(apart: Windows, tmp_path: Path) -> None:
    """The student's laptop is told so, and joins the new address."""
    with MixedLab(tmp_path / "lab") as lab:
        lab.system = apart
        served = lab.build().serve()
        lab.services()
        lab.says("b", "router", "use", "10.77.0.1")
        zoe = lab.zoe(machine="b")
        served.wait_for("^robot/zoe on ", SOON)
        served.kill()
        moved = lab.serve(machine="c")
        sentence = "no router answers at tcp/10.77.0.1:7447 any more; waiting. If it "
        zoe.wait_for(f"^warning: {sentence}", SOON)
        zoe.kill()
        assert "type: rems router forget" in lab.says("b", "list", status=2)
        assert "There: nobody yet." in lab.says("b", "router", "use", "10.77.0.4")
        lab.zoe(machine="b")
        moved.wait_for("^robot/zoe on ", SOON)


def test_the_page_of_a_run_on_windows(apart: Windows, tmp_path: Path) -> None:
    """A browser of Linux looks at it from another machine."""
    with MixedLab(tmp_path / "lab") as lab:
        lab.system = apart
        lab.build()
        lab.services()
        lab.file(duration=300, pace=1)
        _, endpoint = lab.router("hub")
        run = lab.rems("run", "lab.toml", "--alone", machine="b", router=endpoint)
        run.wait_for("fabric at", SOON)
        served = lab.rems("dashboard", "--no-qr", machine="a", router=endpoint)
        link = served.wait_for(r"http://\S+", SOON)[0]
        looking = lab.module("tests.windows.looking", link, "two", machine="a")
        assert looking.process.wait(SOON) == 0, looking.text()
