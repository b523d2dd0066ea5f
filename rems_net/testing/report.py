"""Report: a finding explains one mistake, a report lists all of them."""

import textwrap
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

#: Columns. Width of a report.
WIDTH = 79
INDENT = " " * 14


@dataclass(frozen=True, slots=True)
class Finding:
    """One mistake: what was expected, what came, which line, and what to type."""

    expected: str
    came: str
    where: str = ""
    type: str = ""

    def lines(self) -> Iterator[str]:
        """Yield it as wrapped text; the code to type keeps its lines."""
        for name, text in asdict(self).items():
            head = f"    {name:8}  "
            for line in text.splitlines():
                yield from _wrapped(line, head)
                head = INDENT


@dataclass(slots=True)
class Outcome:
    """Result of one check.

    remark: what was measured, if all is well.  skipped: why the check was not done.
    notes: hints on what is not wrong, but could be better.
    """

    name: str
    findings: list[Finding] = field(default_factory=list)
    remark: str = ""
    skipped: str = ""
    notes: list[str] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """Whether nothing wrong was found."""
        return not self.findings

    def wrong(
        self, *, expected: str, came: str, where: str = "", type: str = ""
    ) -> None:
        """Add a mistake, if it is not there already."""
        found = Finding(expected, came, where, type)
        if found not in self.findings:
            self.findings.append(found)

    def lines(self) -> Iterator[str]:
        """Yield the outcome as lines of text."""
        verdict, said = "WRONG", ""
        if not self.findings:
            verdict, said = "-" if self.skipped else "ok", self.skipped or self.remark
        yield from _wrapped(f"{verdict:5}  {said}".rstrip(), f"  {self.name:9} ", 18)
        for finding in self.findings:
            yield from finding.lines()
        for note in self.notes:
            yield from _wrapped(note, "    note      ")


@dataclass(slots=True)
class Report:
    """Results of all checks of one robot. `print(report)` is for people."""

    title: str
    outcomes: list[Outcome] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """Whether nothing wrong was found."""
        return all(one.ok for one in self.outcomes)

    @property
    def findings(self) -> list[Finding]:
        """Every mistake."""
        return [found for one in self.outcomes for found in one.findings]

    def __getitem__(self, name: str) -> Outcome:
        """Return the outcome of the check with that name."""
        return next(one for one in self.outcomes if one.name == name)

    def verdict(self) -> str:
        """Return the last line: how many checks failed."""
        wrong = sum(not one.ok for one in self.outcomes)
        looked = sum(not one.skipped for one in self.outcomes)
        if wrong:
            return f"{wrong} of {looked} checks found something wrong."
        return f"It does what a robot must: {looked} checks, nothing wrong."

    def __str__(self) -> str:
        lines = [line for one in self.outcomes for line in one.lines()]
        return "\n".join([self.title, *lines, self.verdict()])

    def to_plain(self) -> dict[str, Any]:
        """Return it as plain values for JSON."""
        plain = {"robot": self.title, "ok": self.ok}
        return plain | {"checks": [asdict(one) for one in self.outcomes]}


def _wrapped(text: str, head: str, indent: int = len(INDENT)) -> list[str]:
    if text.startswith(" "):  # a line of code
        return [f"{head}{text}"]
    return textwrap.wrap(
        f"{head}{text}",
        WIDTH,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
        drop_whitespace=True,
    ) or [head.rstrip()]
