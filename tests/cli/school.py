"""A class on this machine, for tests: its screens, its users and their passwords."""

import re
import threading
from pathlib import Path
from typing import Any, NamedTuple

from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import until
from tests.commands import Running


class Screen:
    """What a program prints, line by line, while it runs."""

    def __init__(self, process: Running):
        self.lines: list[str] = []
        for stream in (process.stdout, process.stderr):
            threading.Thread(target=self._read, args=(stream,), daemon=True).start()

    def _read(self, stream: Any) -> None:
        for line in stream:
            self.lines.append(line.rstrip("\n"))

    def matching(self, pattern: str) -> list[str]:
        return [line for line in self.lines if re.search(pattern, line)]

    def shows(self, pattern: str) -> None:
        until(lambda: self.matching(pattern), 30.0)


class Class(NamedTuple):
    """A class on this machine: its address, the screens, and the teacher's folders."""

    at: str
    folder: Path
    notes: Path
    serve: Screen
    agent: Screen

    def password(self, user: str) -> str:
        slips = (self.folder / "names.slips.txt").read_text()
        found = re.search(rf"--user {user}\n  password: (.+)\n", slips)
        assert found
        return found[1]

    def session(self, user: str, fabric: str = "rems") -> Session:
        password = self.password(user)
        return Session(Link(self.at, fabric=fabric, user=user, password=password))


def known_as(school: Class, user: str) -> dict[str, str]:
    password = school.password(user)
    return {"REMS_ROUTER": school.at, "REMS_USER": user, "REMS_PASSWORD": password}
