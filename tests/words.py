"""Plain words: what a program can count of the seven rules for sentences.

`python -m tests.words` prints the files that break a rule.
"""

import ast
import io
import re
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.sources import ROOT, outside_expressions

#: words. A longer sentence of a page is hard to follow for a reader at school.
LONGEST = 30
#: Words for people, used for programs. In `stop_store.py` people say STOP.
PEOPLE = re.compile(
    r"\b(tell|tells|told|say|says|said(?! STOP)|saying|hear|hears|heard)\b", re.I
)
#: "who is late waits", "What is called so": a subject without a noun. A question has
#: one: "Who is there?"
HEADLESS = re.compile(
    r"(?:^|[.;:!?]\s+)(?:Who|Whoever|What|Whatever)\s(?!(?:is|are|can|do|to)\b[^.]*\?)"
    r"|\b(?<!those )(?<!one )(?<!anybody )(?<!somebody )(?:whoever|whatever)\b"
)
#: names in a text: what an f-string puts in, `names`, and parameters (`said: ...`)
CODE = re.compile(
    r"\{[^{}\n]*\}|`[^`\n]*`|(?m:(?:^\s*|\s\s|(?<=\. ))(?:\w+, )*\w+(?=: ))"
)
#: first words of a docstring that is a fragment, not an instruction
FRAGMENT = re.compile(
    "a|all|an|and|any|are|as|at|by|each|every|for|from|how|if|in|is|it|its|no|of|on|one"
    "|some|that|the|there|these|this|those|to|what|when|where|whether|which|who|whose"
    "|with"
)


def counts() -> dict[str, dict[str, int]]:
    """Return, for each rule, the files that break it and how often."""
    found: dict[str, Counter[str]] = {
        rule: Counter() for rule in ("people", "headless", "imperative", "long")
    }
    for path in sorted((ROOT / "rems_net").rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        source = path.read_text(encoding="utf-8")
        for text in texts(source):
            found["people"][name] += len(PEOPLE.findall(text))
            found["headless"][name] += len(HEADLESS.findall(text))
        found["imperative"][name] += sum(1 for _ in fragments(source))
    for path in pages():
        name = path.relative_to(ROOT).as_posix()
        for sentence in sentences(path.read_text(encoding="utf-8")):
            found["people"][name] += len(PEOPLE.findall(sentence))
            found["headless"][name] += len(HEADLESS.findall(sentence))
            found["long"][name] += len(sentence.split()) > LONGEST
    return {rule: dict(+files) for rule, files in found.items()}


def pages() -> list[Path]:
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]


def texts(source: str) -> Iterator[str]:
    """Comments and strings of a module that have a blank: what people read."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type in (tokenize.COMMENT, tokenize.STRING) and " " in token.string:
            yield " ".join(CODE.sub("x", token.string).strip("#:\"' ").split())


def fragments(source: str) -> Iterator[str]:
    """First lines of docstrings of functions that do not begin with a verb."""
    for node in outside_expressions(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef) or is_property(node):
            continue
        doc = ast.get_docstring(node) or ""
        word = re.match(r"[`'\"(]*([A-Za-z]*)", doc)
        if doc and word and (not word[1] or FRAGMENT.fullmatch(word[1].lower())):
            yield f"{node.name}: {doc.splitlines()[0]}"


def is_property(node: ast.FunctionDef) -> bool:
    """Whether it is read like an attribute, and so documented by a noun."""
    names = {ast.unparse(one).rpartition(".")[2] for one in node.decorator_list}
    return bool(names & {"property", "cached_property", "setter"})


def sentences(page: str) -> Iterator[str]:
    """The sentences of a page, without code, tables and headings."""
    text = re.sub(r"```.*?```", "", page, flags=re.DOTALL)
    kept = [
        line for line in text.splitlines() if not re.match(r"\s*(\||#|!\[|<)", line)
    ]
    for block in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) ", "\n".join(kept)):
        plain = re.sub(r"\]\([^)]*\)", "]", block)
        plain = re.sub(r"`[^`]*`", "`x`", plain)
        yield from re.split(r"(?<=[.!?:;])\s+", " ".join(plain.split()))


if __name__ == "__main__":
    for rule, files in counts().items():
        print(f"{rule}: {files}")
