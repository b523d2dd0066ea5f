"""What Sphinx reads: the pages as they are, with lists of pages for the site's side."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from generated import page
from pygments.lexers import get_lexer_by_name
from pygments.util import ClassNotFound
from wordlist import entries, index

from rems_net.doors import DOORS

ROOT = Path(__file__).parents[2]
REFERENCE = "docs/reference/"
#: a file beside a page, which is shown below the paragraph that links it
PROGRAM = re.compile(r"\]\(((?:programs|rover)/[\w./]+)\)")
#: page -> its words in the index
INDEX: dict[str, list[str]] = {}


def read(app: Any, name: str, source: list[str]) -> None:
    """Complete the text of a page: `source` has one item, which is replaced.

    The first page gets the lists of all pages, a page of the reference its names.
    """
    if name == app.config.root_doc:
        known = sorted(app.env.found_docs - {name})
        source[0] = entries(source[0], _index(app)[name])
        source[0] += "".join(contents(source[0], known))
    elif name.startswith(REFERENCE):
        source[0] += page(name.removeprefix(REFERENCE))
    else:
        source[0] = entries("\n".join(_complete(source[0])), _index(app)[name])
    # A file that is no page is not part of the site: its name is shown.
    folder = (ROOT / name).parent
    link = re.compile(r"(?<!!)\[([^]]+)\]\(([\w./-]+)\)")
    source[0] = link.sub(lambda found: _named(found, folder), source[0])
    # A language that Pygments does not have is shown as plain text.
    source[0] = re.sub(r"^```(\w+)$", _fence, source[0], flags=re.MULTILINE)


def contents(text: str, known: list[str]) -> Iterator[str]:
    """Yield the lists of pages for the side of the site, as the README groups them.

    The first word of an item with links to pages is a caption, such as "Student" or
    "Robots". The reference follows, then pages that the README does not link.
    """
    left = [*known]
    groups: dict[str, list[str]] = {}
    for item in re.split(r"\n(?=- |#)", text):
        caption = re.match(r"- \*{0,2}([A-Z]\w+)", item)
        for link in re.findall(r"\]\(([\w./-]+)\.md[^)]*\)", item):
            if caption and link in left:
                left.remove(link)
                groups.setdefault(caption[1], []).append(link)
    doors = (f"{REFERENCE}{door.rpartition('.')[2]}" for door in DOORS)
    groups["Reference"] = [name for name in doors if name in left]
    groups["More"] = [name for name in left if not name.startswith(REFERENCE)]
    for name, some in groups.items():
        if some:
            lines = "\n".join(f"/{one}" for one in some)
            yield f"\n```{{toctree}}\n:hidden:\n:caption: {name}\n\n{lines}\n```\n"


def _index(app: Any) -> dict[str, list[str]]:
    """Return the words of each page that are found there, computed once."""
    if not INDEX:
        names = (name for name in app.env.found_docs if not name.startswith(REFERENCE))
        INDEX.update(index({n: (ROOT / f"{n}.md").read_text("utf-8") for n in names}))
    return INDEX


def _complete(text: str) -> Iterator[str]:
    """Yield the lines of a page, with each file after the paragraph that links it."""
    fenced, linked = False, list[str]()
    for line in [*text.splitlines(), ""]:
        begins = line.startswith("```") and not fenced
        while linked and (begins or not line):
            yield f"\n```{{literalinclude}} {linked.pop(0)}\n```\n"
        fenced ^= line.startswith("```")
        linked += [] if fenced else PROGRAM.findall(line)
        yield line


def _named(link: re.Match[str], folder: Path) -> str:
    """Return a link to a page as it is, one to another file as its name."""
    path = (folder / link[2]).resolve()
    if path.suffix == ".md" or not path.is_relative_to(ROOT) or not path.exists():
        return link[0]
    name = path.relative_to(ROOT).as_posix()
    return f"`{name}`" if name in link[1] else f"{link[1]} (`{name}`)"


def _fence(fence: re.Match[str]) -> str:
    try:
        get_lexer_by_name(fence[1])
    except ClassNotFound:
        return "```text"
    return fence[0]
