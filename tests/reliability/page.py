"""measured/reliability.md: tables in marked places; the rest of the page is kept."""

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
        parts = [f"{begin}\n## {self.title}", self.text, self.lines, f"*{machine()}*"]
        return "\n\n".join(parts) + f"\n{end}"


def mend(path: Path, section: Section, *, placed: bool) -> Section:
    """Return the section with what was not measured again, as the page has it.

    A row is known by its first cell. placed: whether the other cells are measured one
    by one, so that an empty one keeps the page's.
    """
    page = path.read_text(encoding="utf-8")
    begin, end = BEGIN.format(section.name), END.format(section.name)
    old = _rows(page.partition(begin)[2].partition(end)[0])
    head, new = section.lines.splitlines()[:2], _rows(section.lines)
    for title, cells in new.items():
        if placed and title in old:
            both = zip(cells, old[title], strict=True)
            cells[:] = [one if one.strip() else other for one, other in both]
    rows = {title: new.pop(title, cells) for title, cells in old.items()} | new
    lines = ["|".join(cells) for cells in rows.values()]
    return replace(section, lines="\n".join([*head, *lines]))


def _rows(text: str) -> dict[str, list[str]]:
    lines = [line for line in text.splitlines() if line.startswith("|")][2:]
    return {line.split("|")[1]: line.split("|") for line in lines}


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
