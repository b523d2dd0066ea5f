"""docs/reliability.md: tables in marked places; all the rest of the page is kept."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.report import machine, table

__all__ = ["Section", "mend", "table", "write"]

BEGIN, END = "<!-- measured: {} -->", "<!-- end of {} -->"


@dataclass(frozen=True)
class Section:
    """What one measurement has to say: a paragraph and a table in Markdown."""

    name: str
    title: str
    text: str
    lines: str

    def show(self) -> str:
        begin, end = BEGIN.format(self.name), END.format(self.name)
        parts = [
            begin,
            f"## {self.title}",
            self.text,
            self.lines,
            f"*{machine()}*",
            end,
        ]
        return "\n\n".join(parts)


def mend(path: Path, section: Section) -> Section:
    """The section with the rows of the page that were not measured again.

    A row is known by its first two cells: what was done, and where.
    """
    page = path.read_text(encoding="utf-8")
    begin, end = BEGIN.format(section.name), END.format(section.name)
    old = page.partition(begin)[2].partition(end)[0]
    head, new = section.lines.splitlines()[:2], _rows(section.lines)
    rows = {key: new.pop(key, line) for key, line in _rows(old).items()} | new
    return replace(section, lines="\n".join([*head, *rows.values()]))


def _rows(text: str) -> dict[tuple[str, ...], str]:
    lines = [line for line in text.splitlines() if line.startswith("|")][2:]
    return {tuple(line.split("|")[1:3]): line for line in lines}


def write(path: Path, section: Section) -> None:
    """Replace the place of this section, or put it at the page's end.

    Raises ValueError for a place that has no end.
    """
    page = path.read_text(encoding="utf-8")
    begin, end = BEGIN.format(section.name), END.format(section.name)
    if begin in page and end not in page.partition(begin)[2]:
        raise ValueError(f"{path} has {begin!r}, and no {end!r} after it")
    place = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if place.search(page):
        page = place.sub(lambda _: section.show(), page, count=1)
    else:
        page = f"{page.rstrip()}\n\n{section.show()}\n"
    path.write_text(page, encoding="utf-8")
