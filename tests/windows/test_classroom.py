"""The lesson of docs/class.md, with the first student's laptop under Wine."""

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from tests.network.lab import Lab
from tests.network.lesson import LAPTOPS, SOON, Lesson, Step, steps
from tests.reliability.rig.programs import Program
from tests.reliability.rig.rig import HERE, Rig, missing
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
    """The recording has the bytes of the run on one machine."""
    with MixedLab(tmp_path / "lab") as lab:
        lab.system = apart
        lab.build()
        lab.services()
        lab.file(duration=3)
        lab.says("a", "run", "lab.toml", "--alone", "--out", "alone")
        _, endpoint = lab.router("hub")
        run, bring = lab.run_and_bring(endpoint)
        assert run.process.wait(SOON) == 0, run.text() + bring.text()
        assert lab.rows() == 60
        assert lab.digest("here") == lab.digest("alone")
