"""What `rems run` and `rems agent bring` say of machines before anything starts."""

import pytest

from tests.cli.conftest import KEYS
from tests.cli.placement.conftest import ON_B, Pair

BEFORE = {
    "one process on two machines": (
        ON_B.replace('command = "input/keys"\nmachine = "b"', 'command = "input/keys"'),
        "input/keys and robot/model share the process 'far', and are on machine b and "
        "this one; give both the same machine, or a host each.",
    ),
    "a file of elsewhere": (
        ON_B.replace("data/keys.csv", "../keys.csv"),
        '[[input]] "keys": ../keys.csv is ',
    ),
    "a file that is no data": (
        ON_B.replace("data/keys.csv", "keys.py"),
        "can't be had on another machine: a file is 'keys.py'; expected one that ends",
    ),
    "a machine that is no name": (
        ON_B.replace('machine = "b"', 'machine = "a/b"', 1),
        "machine is 'a/b'; a name has 1 to 63 letters",
    ),
}


@pytest.mark.parametrize("name", BEFORE)
def test_what_is_said_before_anything_starts(pair: Pair, name: str) -> None:
    anna, _ = pair
    lab, sentence = BEFORE[name]
    anna.write(lab_toml=lab, data__keys_csv=KEYS, keys_py=KEYS)
    (anna.folder.parent / "keys.csv").write_text(KEYS)
    status, _, error = anna.rems("run", "lab.toml")
    assert status == 2
    assert sentence in error


WORDS = {
    "no machine": ((), "required: --as. Type: rems agent bring --help"),
    "a file": (
        ("lab.toml", "--as", "b"),
        "rems agent bring has no place for 'lab.toml'.",
    ),
    "no terminal": (
        ("--as", "b"),
        "type it in a terminal",
    ),
    "no name": (("--as", "a/b"), "--as is 'a/b'; a name has 1 to 63 letters"),
}


@pytest.mark.parametrize("name", WORDS)
def test_words_that_say_nothing(pair: Pair, name: str) -> None:
    words, sentence = WORDS[name]
    status, _, error = pair[1].rems("agent", "bring", *words)
    assert status == 2
    assert sentence in error
