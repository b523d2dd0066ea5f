"""Plain words: no file may break more of the rules for sentences than it does today.

`python -m tests.words` names the files; after a rewrite, `--lower` shrinks the list.
"""

import json

import pytest

from tests.words import ALLOWED, counts, fragments, sentences

LIST: dict[str, dict[str, int]] = json.loads(ALLOWED.read_text(encoding="utf-8"))
FOUND = counts()


@pytest.mark.parametrize("rule", LIST)
def test_the_list_only_shrinks(rule: str) -> None:
    more = {
        file: f"{n} instead of {LIST[rule].get(file, 0)}"
        for file, n in FOUND[rule].items()
        if n > LIST[rule].get(file, 0)
    }
    assert not more, f"{rule}: {more}. The rules: python -m tests.words"


def test_what_is_counted() -> None:
    source = 'def f():\n    """Whether it is."""\n\ndef g():\n    """Return it."""\n'
    assert [*fragments(source)] == ["f: Whether it is."]
    page = "# Head\n\nOne sentence. A `one two` one:\n\n```py\ncode here\n```\n"
    assert [one for one in sentences(page) if one] == ["One sentence.", "A `x` one:"]
