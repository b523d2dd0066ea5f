"""Write the index of the site: for each word, the three pages that explain it most.

The search of Sphinx counts a page that has a word once like one that is about it. It
prefers entries of an index, so each page gets one for each of its words.
"""

import re
from collections import Counter
from collections.abc import Iterable, Mapping

#: pages that are found by one word
BEST = 3
#: a word in a heading counts like so many in the text
HEADING, TITLE = 6, 20
#: a word; also with a hyphen, as in Wi-Fi, which is found as "wifi", too
WORD = re.compile(r"[a-z][a-z0-9]*(?:[-_][a-z0-9]+)*")


def index(pages: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the entries of each page in the index.

    pages: name -> its text, as Markdown. A page has the words for which it is one of
    the best by BM25, a measure of how often a text has a word for its length. They are
    main entries, marked by `!`. The very best page has a second entry, which is plain.
    """
    counts = {name: Counter(_words(text)) for name, text in pages.items()}
    usual = sum(one.total() for one in counts.values()) / len(counts)
    found: dict[str, list[str]] = {name: [] for name in pages}
    for word in sorted(set().union(*counts.values())):
        have = [name for name in counts if counts[name][word]]

        def rank(name: str, word: str = word) -> float:
            n, long = counts[name][word], counts[name].total() / usual
            return n / (n + 1.2 * (0.25 + 0.75 * long))

        some = sorted(have, key=rank, reverse=True)[:BEST]
        for name in some:
            found[name].append(f"! {word}")
        found[some[0]].append(word)
    return found


def _words(text: str) -> Iterable[str]:
    """Yield the words of a page; those of its headings several times."""
    for line in text.split("\n"):
        level = len(line) - len(line.lstrip("#"))
        times = {0: 1, 1: TITLE}.get(level, HEADING)
        for word in WORD.findall(re.sub(r"\]\([^)]*\)", " ", line).lower()):
            forms = {word, word.replace("-", ""), *re.split("[-_]", word)}
            for form in forms | {f.removesuffix("s") for f in forms}:
                if len(form) > 2:
                    yield from [form] * times


def entries(text: str, words: list[str]) -> str:
    """Return a page with its entries of the index after its first heading."""
    lines = ", ".join(words)
    first = re.compile(r"(?m)^# .*\n")
    return first.sub(lambda head: f"{head[0]}\n```{{index}} {lines}\n```\n", text, 1)
