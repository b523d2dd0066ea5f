"""Meaning of the codes at the end of our messages: a page of text for each hundred.

An entry is a heading with the code, a paragraph, and two blocks: a wrong example, which
gives that message, and a right one. The tests run both.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from rems_net.errors import ExperimentError

#: a code as people type or paste it
CODE = re.compile(r"(?<![a-z0-9])R ?(\d{1,4})(?![a-z0-9])", re.I)
_HERE = Path(__file__).parent
_ENTRY = re.compile(r"^## (R\d{4}) (.+)\n", re.M)
_BLOCK = re.compile(r"^```(\w+) (wrong|right)\n(.*?)^```\n", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """An example of an entry.

    language: `python`, `toml`, `sh` or `xml`
    """

    language: str
    right: bool
    text: str


@dataclass(frozen=True)
class Entry:
    """A code and its meaning.

    group: subject of its hundred, such as "Values, units and schemas"
    text: a paragraph without line breaks
    """

    code: str
    title: str
    group: str
    text: str
    blocks: tuple[Block, ...]


def entries() -> dict[str, Entry]:
    """Return all entries by their codes, in order."""
    return {
        entry.code: entry
        for path in sorted(_HERE.glob("r*.md"))
        for entry in _entries(path.read_text(encoding="utf-8"))
    }


def find(asked: str) -> Entry:
    """Return the entry of a code, written in any way, or pasted within its message.

    Raises ExperimentError: there is no code in the text, or no entry for it.
    """
    known = entries()
    typed = asked.strip()
    numbers = [typed] if re.fullmatch(r"\d{1,4}", typed) else CODE.findall(asked)
    if not numbers:
        raise ExperimentError(
            f"{typed[:60]!r} has no code; a code stands at the end of a message and "
            "looks like R0104. For a list of all codes, type: rems explain (R0901)"
        )
    code = f"R{int(numbers[-1]):04}"
    if code not in known:
        near = min(known, key=lambda one: abs(int(one[1:]) - int(code[1:])))
        raise ExperimentError(
            f"there is no code {code}; the nearest one is {near}, {known[near].title!r}"
            ". For a list of all codes, type: rems explain (R0901)"
        )
    return known[code]


def _entries(page: str) -> list[Entry]:
    group = page.partition("\n")[0].removeprefix("# ")
    parts = _ENTRY.split(page)
    made = []
    for code, title, body in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
        blocks = tuple(
            Block(language, kind == "right", text)
            for language, kind, text in _BLOCK.findall(body)
        )
        text = " ".join(_BLOCK.sub("", body).split())
        made.append(Entry(code, title, group, text, blocks))
    return made
