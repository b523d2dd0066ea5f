"""Plain words: no file breaks a rule for sentences that a program can hold."""

from tests.sources import uncollected
from tests.words import counts, fragments, sentences


def test_no_sentence_breaks_a_rule() -> None:
    with uncollected():
        found = {rule: files for rule, files in counts().items() if files}
    assert not found, "The rules are in tests/words.py."


def test_what_is_counted() -> None:
    source = 'def f():\n    """Whether it is."""\n\ndef g():\n    """Return it."""\n'
    assert [*fragments(source)] == ["f: Whether it is."]
    page = "# Head\n\nOne sentence. A `one two` one:\n\n```py\ncode here\n```\n"
    assert [one for one in sentences(page) if one] == ["One sentence.", "A `x` one:"]
