"""Users of a router, and what they ask for."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from rems_net.router.mail import Question
from rems_net.router.session import Session
from tests.agents.runs import until

ANNA, TEAM = "seven green: herons", "ein kalter Teekessel für uns"
USERS = f"""\
[members]
anna = "{ANNA}"

[guests]
team1 = "{TEAM}"
"""

NAMES = """\
Name;Team
Anna Berg;team1
Ben Cho;Team2
Çelik Öz;team1
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "users.toml"
    path.write_text(USERS, encoding="utf-8")
    path.chmod(0o600)
    return path


@pytest.fixture
def names(tmp_path: Path) -> Path:
    path = tmp_path / "names.csv"
    path.write_text(NAMES, encoding="utf-8")
    return path


def empty(question: Question) -> None:
    question.answer(question.key, b"")


def asks(
    who: Session, owner: Session, allowed: Sequence[str], refused: Sequence[str]
) -> None:
    """He is answered at the first keys; the router drops what he asks at the others."""
    for key in (*allowed, *refused):
        owner.answer_at_once(key, empty)
    until(lambda: who.ask(allowed[-1], timeout=0.5))
    for key in allowed:
        assert [mail.key for mail in who.ask(key)] == [key]
    for key in refused:
        assert who.ask(key, timeout=0.5) == []
        assert len(owner.ask(key)) == 1
