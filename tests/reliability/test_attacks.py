"""Attacks are held off: `python -m tests.reliability attacks` has all of them."""

from pathlib import Path

import pytest

from tests.reliability.attacks import Attack, attacks

TESTED = "tests.reliability.attacking.tested"

#: those of `tested` are tests of other rooms: CI runs them there
ALL = [one for one in attacks() if one.perform.__module__ != TESTED]


@pytest.mark.parametrize(
    "attack",
    [
        pytest.param(
            one, id=one.perform.__name__, marks=() if one.quick else pytest.mark.slow
        )
        for one in ALL
    ],
)
def test_it_is_held_off(attack: Attack, tmp_path: Path) -> None:
    outcome = attack.run(tmp_path)
    assert outcome.held, outcome.now


def test_each_has_a_row_of_its_own() -> None:
    assert len({one.name for one in attacks()}) == len(attacks()) > len(ALL)
