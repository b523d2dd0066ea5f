"""The lesson of docs/class.md, typed as it stands: on three machines, or on one.

A step is a bold line that names the laptop, and the block below it; a `text` block says
what is printed then. Numbers, passwords and names of laptops may differ from the page.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.agents.runs import free_port
from tests.commands import ROOT
from tests.reliability.rig.programs import Program, until
from tests.reliability.rig.rig import Rig

PAGE = ROOT / "docs" / "class.md"
#: the laptops of the page, and what each is called in its output
LAPTOPS = {
    "Teacher": "teachers-laptop",
    "Student 1": "annas-laptop",
    "Student 2": "bens-laptop",
}
#: the address on the page, and its code
ADDRESS, CODE = "192.168.1.20", "30AG-08M6"
#: s. A command that takes one second where the machine has nothing else to do.
SOON = 60.0
#: commands that only look: what they show may come a moment later
LOOKS = ("list", "get", "why", "router status")
_STEP = re.compile(
    r"^\*\*(Teacher|Student [12])\*\*((?:(?!\n\n)[^:])*):\n```(\w+)\n(.*?)^```$",
    re.M | re.S,
)
_PROMISE = re.compile(r"\n```text\n(.*?)^```$", re.M | re.S)


class Step(NamedTuple):
    """who: the laptop; how: what the page says of it; kind, text: of its block."""

    who: str
    how: str
    kind: str
    text: str
    promised: list[str]


def steps(until_heading: str = "") -> Iterator[Step]:
    """Yield the steps of the page, up to this heading."""
    page = PAGE.read_text(encoding="utf-8")
    if until_heading:
        page, found, _ = page.partition(f"\n## {until_heading}\n")
        assert found, until_heading
    for match in _STEP.finditer(page):
        who, how, kind, text = match.groups()
        promise = _PROMISE.match(page, match.end())
        shown = text if kind == "text" else promise[1] if promise else ""
        yield Step(who, " ".join(how.split()), kind, text, shown.splitlines())


class Lesson(Rig):
    """The laptops of the page. Use it by `with`, and do its steps one by one."""

    def build(self, *, machines: bool) -> Lesson:
        """Make a machine for each laptop, or give each a home on this one."""
        self.home, self.apart = self.folder, machines
        self.windows: list[tuple[str, str, Program]] = []
        for name in LAPTOPS.values():
            (self.home / name).mkdir()
            self._enter[name] = []
        self.at = f"127.0.0.1:{free_port()}"
        if machines:
            self.connect(*LAPTOPS.values())
            self.at = self.addresses["teachers-laptop"]
        return self

    def do(self, step: Step) -> None:
        """Do what the page says, and compare what it promises."""
        machine = LAPTOPS[step.who]
        window = re.search(r"the window of `(.+?)`", step.how)
        file = re.search(r"`([\w.]+)`$", step.how)
        if window:
            program = self._window(machine, window[1])
            if step.kind == "keys":
                self._press(program, step.text.strip())
            self._await(step, program)
        elif step.kind == "sh":
            self._type(step, machine)
        elif file and step.kind == "text":
            self._compare(step, (self.home / machine / file[1]).read_text("utf-8"))
        else:
            assert file, step
            (self.home / machine / file[1]).write_text(step.text, encoding="utf-8")

    def _type(self, step: Step, machine: str) -> None:
        lines = step.text.splitlines()
        if "leave it running" in step.how:
            (line,) = lines
            program = self._start(machine, line)
            self.windows.append((machine, line, program))
            self._await(step, program)
            return
        refused = "it is refused" in step.how
        shown = ""

        def holds() -> bool:
            nonlocal shown
            shown, well = "", True
            for line in lines:
                program = self._start(machine, line)
                well = well and bool(program.process.wait(SOON)) == refused
                shown += program.text()
            return well and not self._missing(step, shown)

        # A busy machine may call its network slow, or show an agent a moment later.
        looks = all(line.removeprefix("rems ").startswith(LOOKS) for line in lines)
        try:
            done = until(holds, "the promise", SOON) if looks else holds()
        except TimeoutError:
            done = False
        assert done, self._differs(step, shown)

    def _start(self, machine: str, line: str) -> Program:
        words = shlex.split(line.replace(ADDRESS, self.at))[1:]
        if words[:2] == ["router", "serve"] and not self.apart:
            words += ["--listen", f"tcp/{self.at}"]
        with pytest.MonkeyPatch.context() as keys:
            if words[:2] == ["router", "use"]:  # what a terminal asks for
                keys.setenv("REMS_PASSWORD", self._password(words[-1]))
            self.folder = self.home / machine
            return self.rems(*words, machine=machine)

    def _password(self, user: str) -> str:
        slips = self.home / "teachers-laptop" / "names.slips.txt"
        found = re.search(rf"--user {user}\n  password: (.+)\n", slips.read_text())
        assert found, user
        return found[1]

    def _window(self, machine: str, line: str) -> Program:
        found = [p for at, said, p in self.windows if at == machine and line in said]
        return found[-1]

    def _press(self, program: Program, keys: str) -> None:
        if keys != "Ctrl+C":
            program.tell(keys)
            return
        os.kill(program.pid, signal.SIGINT)
        program.process.wait(SOON)
        assert "Traceback" not in program.text(), program.text()

    def _await(self, step: Step, program: Program) -> None:
        def ready() -> bool:
            done = not self._missing(step, program.text())
            assert done or program.ended is None, self._differs(step, program.text())
            return done

        try:
            until(ready, "the promise", SOON)
        except TimeoutError:
            raise AssertionError(self._differs(step, program.text())) from None

    def _compare(self, step: Step, shown: str) -> None:
        assert not self._missing(step, shown), self._differs(step, shown)

    def _missing(self, step: Step, shown: str) -> list[str]:
        """Return the promised lines that were not printed, in any width of terminal."""
        flat = " ".join(shown.split())
        return [line for line in step.promised if not self._pattern(line).search(flat)]

    def _pattern(self, line: str) -> re.Pattern[str]:
        if not self.apart and re.search("rems router use tcp/|On other laptops", line):
            return re.compile("")  # nobody else reaches this machine's loopback
        text = re.escape(" ".join(line.split()))
        router = re.escape(self.at if self.apart else self.at.partition(":")[0])
        router += r"(:\d+)?"
        text = text.replace(re.escape(ADDRESS), "ROUTER").replace(
            re.escape(CODE), "CODE"
        )
        text = re.sub(r"(?<![\w.'-])\d+(\\\.\d+)?(?![\w'])", r"[\\d.]+", text)
        text = re.sub(r"(\w{4}\\-){2}\w{4}$", r"(\\w{4}-){2}\\w{4}", text)
        if not self.apart:
            text = re.sub(r"\w+s\\-laptop", r"\\S+", text)
        code = r"\w{4}-\w{4}"
        return re.compile(text.replace("ROUTER", router).replace("CODE", code))

    def _differs(self, step: Step, shown: str) -> str:
        missing = "\n".join(self._missing(step, shown))
        return (
            f"{step.who}{step.how}: {step.text}\nthe page promises\n{missing}\n"
            f"and this was printed\n{shown}"
        )


def follow(folder: Path, *, machines: bool, until_heading: str = "") -> int:
    """Follow the page up to a heading; return how many commands were typed."""
    with Lesson(folder / "lesson") as lesson:
        lesson.build(machines=machines)
        done = [*steps(until_heading)]
        for step in done:
            lesson.do(step)
    return sum(len(step.text.splitlines()) for step in done if step.kind == "sh")
