"""measured/performance.md: one section per benchmark, replaced when it is run again."""

from __future__ import annotations

import os
import platform
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.contest import Spread

PACKAGES = ("eclipse-zenoh", "numpy", "msgpack", "mujoco", "dora-rs", "ray", "pyzmq")
MARK = "<!-- benchmark: {} -->"

HEAD = """# Performance

`python -m benchmarks` measures how fast rems_net is, beside others, and writes this
page. Ratios count, since figures differ from machine to machine. A ratio is of programs
that ran in turn, each in fresh processes: the median of neighbouring runs, with the
smallest and the largest.

```text
pip install -e '.[bench,plot]'
python -m benchmarks                      all of it, about half an hour
python -m benchmarks lockstep --repeats 9
python -m benchmarks --quick              does it run? writes nothing
```
"""


@dataclass(frozen=True)
class Target:
    """What was aimed at, and what came out. `at_least` or at most `bound`."""

    what: str
    found: Spread
    bound: float
    at_least: bool = True
    form: str = ".2f"

    @property
    def reached(self) -> bool:
        if self.at_least:
            return self.found.median >= self.bound
        return self.found.median <= self.bound

    def show(self) -> str:
        sign = "at least" if self.at_least else "at most"
        missed = "" if self.reached else ", **missed**"
        return (
            f"{self.what} {sign} {self.bound:g}: {self.found.show(self.form)}{missed}"
        )


@dataclass
class Section:
    """What one benchmark has to say. `text` is paragraphs and tables in Markdown."""

    name: str
    title: str
    text: list[str] = field(default_factory=list)
    targets: list[Target] = field(default_factory=list)

    def show(self) -> str:
        parts = [f"{MARK.format(self.name)}\n## {self.title}", *self.text]
        if self.targets:
            listed = "; ".join(target.show() for target in self.targets)
            parts.append(textwrap.fill(f"Targets, median (min to max): {listed}.", 98))
        parts.append(f"*{machine()}*")
        return "\n\n".join(parts) + "\n"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def machine() -> str:
    """What kind of machine, and which versions; neither names nor paths."""
    found = [f"Python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    busy = f"load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    cores = f"{os.cpu_count()} cores"
    where = f"{platform.system()} {platform.machine()}"
    return ", ".join(filter(None, [where, cores, busy, *found])) + "."


def write(path: Path, sections: Mapping[str, Section], order: Sequence[str]) -> None:
    """Put new sections in the place of old ones; keep those that were not run."""
    kept: dict[str, str] = {}
    if path.exists():
        parts = re.split(r"<!-- benchmark: (\w+) -->\n", path.read_text("utf-8"))
        kept = {
            name: MARK.format(name) + "\n" + text.rstrip() + "\n"
            for name, text in zip(parts[1::2], parts[2::2], strict=True)
        }
    kept.update({name: section.show() for name, section in sections.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    body = [kept[name] for name in order if name in kept]
    path.write_text("\n".join([HEAD, *body]), encoding="utf-8")
