"""docs/class.md: every command of the lesson, on the laptop that the page says."""

from pathlib import Path

import pytest

from tests.network.lesson import follow
from tests.reliability.rig.rig import missing


@pytest.mark.root
@pytest.mark.slow
@pytest.mark.timeout(400)
@pytest.mark.skipif(bool(missing()), reason=missing())
def test_the_lesson_on_three_machines(tmp_path: Path) -> None:
    assert follow(tmp_path, machines=True) == 20


def test_the_lesson_begins_on_one_machine(tmp_path: Path) -> None:
    """Up to the agent of a team: each laptop is a home of its own here."""
    assert follow(tmp_path, machines=False, until_heading="A robot of the class") == 9


@pytest.mark.slow
def test_the_lesson_on_one_machine(tmp_path: Path) -> None:
    assert follow(tmp_path, machines=False) == 20
