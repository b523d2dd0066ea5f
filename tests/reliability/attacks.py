"""Attacks on a class: what each did at first, and what it does now.

`python -m tests.reliability attacks` performs them and writes the table. To add one,
write a function in a file of `attacking/` with the decorator `attack`, and name that
file in `FILES`.
"""

import importlib
import subprocess
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from tests import commands
from tests.agents.runs import Router
from tests.commands import Done, Running, command, finished
from tests.reliability.page import Section, table

#: files of `attacking/` with attacks, in the order of the table
FILES = ("stops", "members", "tested")
TEXT = """Programs that mean harm, performed by the suite on real routers, runs and
robots. *Before* is what they did at commit 97ade92, *now* what they do today. The
rights of a member with a password are in [a lesson with
teams](../class.md#who-may-do-what)."""


class Outcome(NamedTuple):
    """What an attack does now, in a few words, and whether it is held off."""

    now: str
    held: bool


class Bench:
    """What an attack is performed with; all that it starts ends with it.

    folder: an empty folder of its own
    """

    def __init__(self, folder: Path, stack: ExitStack):
        self.folder, self.stack = folder, stack

    def router(self, *more: str) -> Router:
        """A router in a process of its own: `python -m rems_net.router ...`."""
        return self.stack.enter_context(Router(*more))

    def rems(self, *words: str, **more: str) -> Done:
        """Run `rems words...` to its end; more: variables of its environment."""
        return finished(command(*words), self.folder, self.environment(more))

    def start(self, *words: str, **more: str) -> Running:
        """Start `rems words...`; it is killed at the end. Both outputs are one pipe."""
        process = subprocess.Popen(
            command(*words),
            cwd=self.folder,
            env=self.environment(more),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.stack.callback(process.communicate)
        self.stack.callback(process.kill)
        return process

    def environment(self, more: dict[str, str]) -> dict[str, str]:
        # Short, since sockets may be made there; and no router of the user's own.
        runtime = self.folder / "run"
        runtime.mkdir(exist_ok=True, mode=0o700)
        mine = {"XDG_RUNTIME_DIR": runtime, "XDG_CONFIG_HOME": runtime}
        return commands.environment(**{k: str(v) for k, v in mine.items()} | more)


Perform = Callable[[Bench], Outcome]


@dataclass(frozen=True)
class Attack:
    """name: what is done   before: what it did   quick: at most some 5 s"""

    name: str
    before: str
    perform: Perform
    quick: bool

    def run(self, folder: Path) -> Outcome:
        folder.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            return self.perform(Bench(folder, stack))


_found: list[Attack] = []


def attack(
    name: str, before: str, *, quick: bool = True
) -> Callable[[Perform], Perform]:
    """Put a function into the table."""

    def add(perform: Perform) -> Perform:
        _found.append(Attack(name, before, perform, quick))
        return perform

    return add


def attacks() -> list[Attack]:
    """All of them, in the order of the table."""
    for file in FILES:
        importlib.import_module(f"tests.reliability.attacking.{file}")
    return list(_found)


def measure(
    words: Sequence[str], folder: Path, tell: Callable[[str], None]
) -> list[tuple[Attack, Outcome]]:
    """Perform each attack; with words, those that have one of them in their name."""
    found = []
    for i, one in enumerate(attacks()):
        if words and not any(word in one.name for word in words):
            continue
        found.append((one, one.run(folder / f"attack-{i}")))
        tell(f"{one.name}: {found[-1][1].now}")
    return found


def section(found: Sequence[tuple[Attack, Outcome]]) -> Section:
    """What docs/measured/reliability.md says."""
    head = ["attack", "before", "now", "held"]
    rows = [
        [one.name, one.before, now.now, "yes" if now.held else "**no**"]
        for one, now in found
    ]
    return Section("attacks", "Attacks, before and now", TEXT, table(head, rows))
